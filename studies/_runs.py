"""Intervals over runs of touches that follow each other: touches of one run share errors.

An interval is that of Student's t with one degree of freedom less than there are runs, and its standard error is by the
jackknife that leaves out whole runs (Miller, Biometrika 61 (1974) 1). A bootstrap would be too narrow with ten runs.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, logit
from scipy.stats import t as student

#: Probability of an interval.
SURE = 0.9

FloatArray = NDArray[np.float64]


def sums_of_runs(values: FloatArray, run: NDArray[np.int64]) -> FloatArray:
    """Sum of the values (t, k) over the touches of each run, (r, k)."""
    return np.array([values[run == each].sum(axis=0) for each in np.unique(run)])


def over_runs(sums: FloatArray, of_sums: Callable[[FloatArray], FloatArray]) -> tuple[float, float]:
    """A function of the sums over all runs, and half the width of its central 90 % interval.

    `sums` (r, k) are those of each run; `of_sums` is from (..., k) to (...).
    """
    runs = len(sums)
    if runs < 2:
        return float(of_sums(sums.sum(axis=0))), float("nan")
    without = of_sums(sums.sum(axis=0) - sums)
    error = np.sqrt((runs - 1) * np.var(without))
    return float(of_sums(sums.sum(axis=0))), float(student.ppf((1 + SURE) / 2, runs - 1) * error)


def share_over_runs(inside: FloatArray, touches: FloatArray) -> tuple[float, float, float]:
    """Share of touches of which something is true, from the numbers (r,) in each run, and its interval.

    The interval is symmetric in the logarithm of the odds: a share near 1 is not known equally well to both sides. If
    all touches are inside, or none, nothing says how well the share is known, and the ends are NaN.
    """
    share, half = over_runs(np.stack([inside, touches], axis=1), _ratio)
    if not 0 < share < 1:
        return share, float("nan"), float("nan")
    middle, wide = logit(share), half / (share * (1 - share))
    return share, float(expit(middle - wide)), float(expit(middle + wide))


def share_of_runs(inside: FloatArray, run: NDArray[np.int64]) -> tuple[float, float, float]:
    """Share of touches (t,), 1 or 0 each, and its interval."""
    sums = sums_of_runs(np.stack([inside, np.ones(len(inside))], axis=1), run)
    return share_over_runs(sums[:, 0], sums[:, 1])


def difference_of_rms(one: FloatArray, two: FloatArray, run: NDArray[np.int64]) -> tuple[float, float, float]:
    """Rms of `one` minus that of `two`, errors (t,) of the same touches, and its interval."""

    def of(sums: FloatArray) -> FloatArray:
        return np.asarray(np.sqrt(sums[..., 0] / sums[..., 2]) - np.sqrt(sums[..., 1] / sums[..., 2]))

    value, half = over_runs(sums_of_runs(np.stack([one**2, two**2, np.ones(len(one))], axis=1), run), of)
    return value, value - half, value + half


def _ratio(sums: FloatArray) -> FloatArray:
    return np.asarray(sums[..., 0] / sums[..., 1])
