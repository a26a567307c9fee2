"""Possible further touches on a finger that could distinguish two models."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.data.touches import Touches
from bayestouch.model.base import PossibleTouches
from bayestouch.model.observations import Observations

# Number of locations, over the range that was touched.
LOCATIONS = 11


def possible_touches(known: Observations, load: FloatArray) -> PossibleTouches:
    """Touches on a grid of the tips that were used, locations over the range that was touched, and three loads.

    Parameters
    ----------
    known : Observations
        Touches that were made.
    load : (t,) array
        Loads of these touches, N/m.
    """
    table, means = known.table, known.means
    assert means.angle_deg is not None
    tips = np.unique(means.indenter_radius_mm)
    places = np.linspace(means.angle_deg.min(), means.angle_deg.max(), LOCATIONS)
    loads = np.array([load.min(), np.median(load), load.max()])
    tip, place, force = (axis.ravel() for axis in np.meshgrid(tips, places, loads, indexing="ij"))
    n, reads = len(tip), float(np.median(means.samples))
    rows = table.select(np.zeros(n, dtype=np.int64))
    rows = rows.with_(
        touch=np.arange(n),
        sample=np.zeros(n, dtype=np.int64),
        indenter_radius_mm=tip,
        angle_deg=place,
        load=force,
        time_s=np.full(n, np.nan),
        contact=np.ones(n),
        reads=np.full(n, reads),
        readings=_some_readings(table, n),
        readings_sd=None,
    )
    time = np.full(n, known.span[1])
    observed = Observations.of(rows, time, np.zeros(n), known.unit, known.history, known.span, known.sessions)
    return PossibleTouches(observed, tuple(_series(observed)))


def _series(observed: Observations) -> Iterator[tuple[str, IntArray]]:
    """Series of touches over all locations (words, indices): one tip at one load, or all tips at one load."""
    means = observed.means
    assert means.angle_deg is not None
    over = f"evenly from {means.angle_deg.min():.3g} to {means.angle_deg.max():.3g} degree"
    for load in np.unique(means.load):
        under = f"under {load:.3g} N/m"
        for tip in np.unique(means.indenter_radius_mm):
            with_what = "an edge" if tip == 0 else "a flat" if np.isinf(tip) else f"a tip of {tip:g} mm"
            rows = np.flatnonzero((means.load == load) & (means.indenter_radius_mm == tip))
            yield f"with {with_what}, {over}, {under}", rows
        yield f"with all the tips in turn, {over}, {under}", np.flatnonzero(means.load == load)


def _some_readings(table: Touches, n: int) -> FloatArray:
    """Zeros for elements with readings, NaN for those without: only predictions are compared."""
    alive = np.isfinite(table.readings).any(axis=0)
    return np.tile(np.where(alive, 0.0, np.nan), (n, 1))
