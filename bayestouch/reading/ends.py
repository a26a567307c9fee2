"""Touches with grade 0 whatever their draws are: an end of a prior cuts them off, or they have no reading."""

from __future__ import annotations

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray
from bayestouch.reading.touch_reader import Drawn
from bayestouch.results.data import BEYOND, UNREAD

# A posterior is cut off by the end of a prior if most draws are in the outer hundredth of the prior, and their mean is
# nearer to the end than three of their sd: a sharp posterior that fits inside, and a wide one, have no such draws.
OUTER_SHARE, NEAR = 0.01, 3.0


def graded(statistics: Drawn, beyond: BoolArray, counts: FloatArray) -> Drawn:
    """Statistics of touches, with grade 0 and the reason where a touch cannot be relied on.

    Parameters
    ----------
    statistics : dict of (t,) arrays
        Statistics of the draws, with ``grade``.
    beyond : (t,) bool array
        Touches beyond the priors: their posteriors are narrow, but wrong.
    counts : (t, m) array
        Number of reads of each element. Without any, the posterior of a touch is the prior, which draws meet well.
    """
    unread: BoolArray = np.asarray(~(counts > 0).any(axis=1))
    grade = np.where(beyond | unread, 0.0, statistics["grade"])
    reasons: dict[str, BoolArray] = {BEYOND: beyond & ~unread, UNREAD: unread}
    return {**statistics, "grade": grade, **{name: each.astype(np.float64) for name, each in reasons.items()}}


def is_at_the_end(distance: FloatArray, width: float) -> BoolArray:
    """Whether draws pile up at an end of a prior, (t,); from their distances to it (chain, draw, t) and its width."""
    outside = (distance < OUTER_SHARE * width).mean(axis=(0, 1)) > 0.5
    return np.asarray(outside & (distance.mean(axis=(0, 1)) < NEAR * distance.std(axis=(0, 1))))
