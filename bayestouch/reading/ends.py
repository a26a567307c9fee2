"""Posteriors that an end of a prior cuts off: they are narrow, but wrong."""

from __future__ import annotations

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray
from bayestouch.reading.touch_reader import Drawn
from bayestouch.results.data import BEYOND

# A posterior is cut off by the end of a prior if most draws are in the outer hundredth of the prior, and their mean is
# nearer to the end than three of their sd: a sharp posterior that fits inside, and a wide one, have no such draws.
OUTER_SHARE, NEAR = 0.01, 3.0


def graded(statistics: Drawn, beyond: BoolArray) -> Drawn:
    """Statistics of touches with grade 0 where a touch is beyond the priors (t,), and with that reason."""
    grade = np.where(beyond, 0.0, statistics["grade"])
    return {**statistics, "grade": grade, BEYOND: beyond.astype(np.float64)}


def is_at_the_end(distance: FloatArray, width: float) -> BoolArray:
    """Whether draws pile up at an end of a prior, (t,); from their distances to it (chain, draw, t) and its width."""
    outside = (distance < OUTER_SHARE * width).mean(axis=(0, 1)) > 0.5
    return np.asarray(outside & (distance.mean(axis=(0, 1)) < NEAR * distance.std(axis=(0, 1))))
