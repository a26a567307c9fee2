"""A finger that is written out, and models of it by the quick evaluator and by the chain."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from independent.finger import SMALL, Press, build
from independent.finger import Finger as WrittenOut

from bayestouch.contact import composite_radius
from bayestouch.data.sensor import Finger
from bayestouch.finger.known_touches import KnownTouches
from bayestouch.finger.layout import FlatLayout
from bayestouch.finger.model import FingerModel
from bayestouch.finger.series import Reach, TouchSeries
from bayestouch.model.observations import UntimedTouches

REFERENCE = 200.0


@dataclass(frozen=True)
class Case:
    """A finger three times: written out, as a model that uses the quick evaluator, and as one that has the chain."""

    finger: WrittenOut
    press: Press
    quick: FingerModel
    chain: FingerModel
    vector: np.ndarray


def three_times() -> Case:
    """A small finger with touches of five tips."""
    rng = np.random.default_rng(3)
    finger = build(SMALL, rng)
    tip = np.repeat([0.0, 1.59, 6.01, 25.25, np.inf], 14)
    press = Press(tip, rng.uniform(-40, 40, len(tip)), rng.uniform(160, 240, len(tip)))
    m, body, peak = SMALL.n_elements, SMALL.body, finger.peak
    built = Finger(body.core, body.outer, SMALL.depth, tuple(SMALL.angles))
    at = FlatLayout(m, discrepancy=False)
    own = [np.log(peak / REFERENCE), finger.depth, np.radians(finger.angle)]
    vector = np.concatenate([*own, [body.poisson, np.log(finger.modulus)]])
    radius = composite_radius(tip, body.outer)
    chain = FingerModel(
        observed=UntimedTouches(len(tip)),
        peak=peak,
        reference_load=REFERENCE,
        finger=built,
        layout=at,
        flat_prior=None,
        sign=np.ones(m),
        contact="layer",
        largest_load=300.0,
        pose=np.stack([radius, np.radians(press.angle), press.load]),
    )
    blank = np.zeros((len(tip), m))
    known = KnownTouches(
        radius_mm=radius,
        angle=np.radians(press.angle),
        load=press.load,
        load_reads=np.ones(len(tip)),
        readings=blank,
        counts=np.ones(blank.shape, dtype=np.int64),
        scatter=np.zeros(m),
        scatter_dof=np.zeros(m),
    )
    reach = Reach(
        sigma=(body.poisson - 0.03, body.poisson + 0.03),
        log_mu=(float(vector[at.log_mu]) - 0.5, float(vector[at.log_mu]) + 0.5),
        depth=float(finger.depth.max()) + 0.2,
    )
    series = TouchSeries.of(known, built, at, np.ones(m), reach, "layer")
    return Case(finger, press, replace(chain, evaluator=series), chain, vector)
