"""Small fingers that miss the model by functions of place, fitted without them."""

from __future__ import annotations

from functools import cache

import numpy as np
from known_fingers import dataset, known_touches, true_chain
from study_modules import study

from bayestouch.contact import composite_radius
from bayestouch.data.dataset import DataSet
from bayestouch.data.touches import Touches
from bayestouch.finger.fit import FingerFit, fit_finger
from bayestouch.finger.priors import FingerPriors

placed = study("_placed")
NOTHING = placed.Missed()
MAP, PLACE = placed.Missed(map_percent=2.0), placed.Missed(place_percent=2.0)
SURFACE = placed.Missed(curvature=0.012)


def missed_finger(missed: object, seed: int = 4) -> object:
    """The true finger of `known_fingers` with functions of place."""
    return placed.MissedFinger.of(true_chain(), missed, seed)


@cache
def missed_data(missed: object) -> DataSet:
    """Calibration touches of it."""
    table = known_touches(7, noise=8.0, step=1.5)
    finger = missed_finger(missed)
    place, load = np.radians(np.asarray(table.angle_deg)), np.asarray(table.load)
    radius = composite_radius(np.asarray(table.indenter_radius_mm), 12.7)
    added = finger.predict(radius, place, load) - finger.chain.predict(radius, place, load)  # type: ignore[attr-defined]
    return dataset(table.with_(readings=table.readings + added))


@cache
def missed_fit(missed: object) -> FingerFit:
    """The fit without functions of place."""
    return fit_of(missed_data(missed).calibration)


def fit_of(table: Touches | None) -> FingerFit:
    """A finger fitted to a table, without functions of place."""
    assert table is not None
    sensor = missed_data(NOTHING).sensor
    return fit_finger(table.averaged(), sensor.body, FingerPriors.of(sensor)[0])[0]  # type: ignore[arg-type]


def drifting() -> Touches:
    """A finger whose zeros drift, touched once everywhere from one end to the other."""
    table = missed_data(NOTHING).calibration
    assert table is not None
    edges = table.select(np.asarray(table.indenter_radius_mm) == 0)
    time = edges.touch / edges.touch.max()
    m = edges.readings.shape[1]
    wander = 40 * np.sin(np.pi * (2 + np.arange(m)) * time[:, None] / 3 + np.arange(m))
    return edges.with_(readings=edges.readings + wander)


def touches(n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Composite radius, location and load of touches that no calibration saw."""
    rng = np.random.default_rng(2)
    return rng.uniform(0.5, 12.0, n), rng.uniform(-0.6, 0.6, n), rng.uniform(170, 230, n)
