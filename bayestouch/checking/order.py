"""Whether touches follow their places, as in a scan."""

from __future__ import annotations

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.data.averages import TouchMeans

# Fewest touches of which the order is judged, and the largest distance of touches that follow each other, over that of
# touches in random order, for a scan. In random order it is 1 ± 0.2 for this number.
ENOUGH, NEAR = 40, 0.5
SCAN = (
    "touches were made in the order of their places: an error that belongs to a place then looks like a drift, and a "
    "drift may be blamed for either; take touches in random order, or at least the first places again at the end"
)


def in_scan_order(means: TouchMeans) -> bool:
    """Whether touches that follow each other are nearer in place than others; False for too few touches.

    They follow each other in time if all times are known, otherwise in the table. The median distance of touches that
    follow each other is compared with that of the same touches in random order. The few long ways back of a scan line
    by line do not matter to it.
    """
    axes = [axis for axis in (means.angle_deg, means.x_mm, means.y_mm) if axis is not None]
    if not axes:
        return False
    place = np.stack(axes, axis=1)
    if np.isfinite(means.time_s).all():  # a table may list the touches in another order
        place = place[np.argsort(means.time_s, kind="stable")]
    place = place[np.isfinite(place).all(axis=1)]
    if len(place) < ENOUGH:
        return False
    mixed = np.random.default_rng(0).permutation(place)
    return bool(_median_step(place) < NEAR * _median_step(mixed))


def _median_step(place: FloatArray) -> float:
    """Median distance of touches (t, D) that follow each other."""
    return float(np.median(np.sqrt((np.diff(place, axis=0) ** 2).sum(axis=1))))
