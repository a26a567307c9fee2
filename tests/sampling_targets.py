"""Log densities whose moments and quantiles are known, and proposals for them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

from bayestouch.array_types import FloatArray
from bayestouch.sampling import StudentTProposal

# Targets: log density up to a constant; true mean, sd and 5 and 95 % quantiles of each parameter.


@dataclass(frozen=True)
class Target:
    log_density: Callable[[FloatArray], FloatArray]
    mean: ArrayLike
    sd: ArrayLike
    first: stats.rv_continuous  # distribution of the first parameter

    def blocks(self, x: FloatArray, blocks: NDArray[np.intp]) -> FloatArray:
        assert x.shape[0] == len(blocks)
        return self.log_density(x)


def standard_normal(x: FloatArray) -> FloatArray:
    return -0.5 * (x**2).sum(axis=-1)


def _cut(shift: float) -> Callable[[FloatArray], FloatArray]:
    """Normal about `shift` cut off below 0, and a second parameter that follows it."""

    def log_density(x: FloatArray) -> FloatArray:
        inside = -0.5 * (x[..., 0] - shift) ** 2 - 0.5 * (x[..., 1] - x[..., 0] / 2) ** 2
        return np.where(x[..., 0] > 0, inside, -np.inf)

    return log_density


def _cut_target(shift: float) -> Target:
    first = stats.truncnorm(-shift, np.inf, loc=shift)
    mean, variance = first.mean(), first.var()
    return Target(_cut(shift), [mean, mean / 2], np.sqrt([variance, 1 + variance / 4]), first)


def _banana(x: FloatArray) -> FloatArray:
    return -0.5 * x[..., 0] ** 2 - 0.5 * ((x[..., 1] - 0.4 * x[..., 0] ** 2) / 0.5) ** 2


class _TwoNormals(stats.rv_continuous):
    def __init__(self, apart: float) -> None:
        super().__init__()
        self.apart = apart

    def _cdf(self, x: FloatArray) -> FloatArray:
        return (stats.norm.cdf(x - self.apart) + stats.norm.cdf(x + self.apart)) / 2


def _bimodal(x: FloatArray) -> FloatArray:
    return np.logaddexp(-0.5 * (x[..., 0] - 2.5) ** 2, -0.5 * (x[..., 0] + 2.5) ** 2) - 0.5 * x[..., 1] ** 2


NORMAL_2 = Target(standard_normal, [0, 0], [1, 1], stats.norm)
NORMAL_3 = Target(standard_normal, [0, 0, 0], [1, 1, 1], stats.norm)
BANANA = Target(_banana, [0, 0.4], [1, np.sqrt(0.32 + 0.25)], stats.norm)
BIMODAL = Target(_bimodal, [0, 0], [np.sqrt(1 + 2.5**2), 1], _TwoNormals(2.5))

BLOCKS = 200

# (target, centre and covariance of the proposal, round that most blocks need)
CASES = {
    "normal": (NORMAL_3, [0, 0, 0], np.eye(3), 1),
    "proposal a third as wide": (NORMAL_3, [0, 0, 0], 0.1 * np.eye(3), 2),
    "proposal five times as wide": (NORMAL_3, [0, 0, 0], 25 * np.eye(3), 2),
    "half of the mass beyond the edge": (_cut_target(0.3), [0.3, 0.15], [[1, 0.5], [0.5, 1.25]], 2),
    "mode on the edge": (_cut_target(-3), [0.1, 0], [[1, 0.5], [0.5, 1.25]], 2),
    "banana": (BANANA, [0, 0], [[1, 0], [0, 0.25]], 2),
    "one mode of two": (BIMODAL, [2.5, 0], np.eye(2), 2),
    "far off": (NORMAL_2, [20, 20], 0.01 * np.eye(2), 3),
}


def student_t(centre: ArrayLike, covariance: ArrayLike, blocks: int = BLOCKS, dof: float = 7) -> StudentTProposal:
    shape = np.asarray(centre, dtype=float)
    return StudentTProposal.from_covariance(np.tile(shape, (blocks, 1)), np.tile(covariance, (blocks, 1, 1)), dof)
