"""Intervals over runs of touches that follow each other: touches of one run share errors."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

#: Bootstrap samples, and their seed.
SAMPLES, SEED = 4000, 0
#: Probability of an interval.
SURE = 0.9

FloatArray = NDArray[np.float64]


def over_runs(
    values: FloatArray, run: NDArray[np.int64], of_sums: Callable[[FloatArray], FloatArray]
) -> tuple[float, float, float]:
    """A function of the sums over touches of values (t, k), and its central 90 % interval.

    Whole runs are drawn with replacement (block bootstrap: Künsch, Annals of Statistics 17 (1989) 1217). `of_sums` is
    from (..., k) to (...).
    """
    sums = np.array([values[run == each].sum(axis=0) for each in np.unique(run)])
    chosen = np.random.default_rng(SEED).integers(len(sums), size=(SAMPLES, len(sums)))
    low, high = np.quantile(of_sums(sums[chosen].sum(axis=1)), [(1 - SURE) / 2, (1 + SURE) / 2])
    return float(of_sums(sums.sum(axis=0))), float(low), float(high)


def share_of_runs(inside: FloatArray, run: NDArray[np.int64]) -> tuple[float, float, float]:
    """Share of touches (t,), 1 or 0 each, and its interval."""
    return over_runs(np.stack([inside, np.ones(len(inside))], axis=1), run, ratio)


def ratio(sums: FloatArray) -> FloatArray:
    """First sum over the second, (..., 2) to (...)."""
    return np.asarray(sums[..., 0] / sums[..., 1])


def difference_of_rms(one: FloatArray, two: FloatArray, run: NDArray[np.int64]) -> tuple[float, float, float]:
    """Rms of `one` minus that of `two`, errors (t,) of the same touches, and its interval."""

    def of(sums: FloatArray) -> FloatArray:
        return np.asarray(np.sqrt(sums[..., 0] / sums[..., 2]) - np.sqrt(sums[..., 1] / sums[..., 2]))

    return over_runs(np.stack([one**2, two**2, np.ones(len(one))], axis=1), run, of)
