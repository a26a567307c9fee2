"""Effects on simulated readings, written without those of the package: cross-talk, and drifts with time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

# The function of time is drawn at steps of this share of its length, and is straight in between.
STEP = 0.01

# Readings (n, m) without the effect and their times (n,), s: readings with it.
Change = Callable[[np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Leaks:
    """Each element reads a share of its neighbours' signals, more from one side, and less of elements further away.

    Attributes
    ----------
    share, reach, lean : float
        Share of each neighbour's signal; share of an element over that of the nearer one; excess from smaller angles.
    """

    share: float
    reach: float
    lean: float

    @classmethod
    def drawn(cls, seed: int) -> Leaks:
        """Random ones: 2 to 6 % of each neighbour."""
        rng = np.random.default_rng([seed, 82])
        return cls(rng.uniform(0.02, 0.06), rng.uniform(0.0, 0.4), 0.2 * float(np.clip(rng.standard_normal(), -2, 2)))

    def __call__(self, clean: np.ndarray, time_s: np.ndarray) -> np.ndarray:
        """Readings with them."""
        out = clean.copy()
        m = clean.shape[1]
        for reader in range(m):
            for other in range(m):
                if reader != other:
                    side = self.lean if other < reader else -self.lean
                    leak = self.share * (1 + side) * self.reach ** (abs(reader - other) - 1)
                    out[:, reader] += leak * clean[:, other]
        return out


@dataclass(frozen=True, eq=False)
class Course:
    """Random functions of time with a Matérn 3/2 correlation, drawn exactly.

    Attributes
    ----------
    sd : float
    length_s, until_s : float
        Correlation length; the functions begin at 0 s and end here.
    count : int
        Number of functions.
    seed : tuple of int
    """

    sd: float
    length_s: float
    until_s: float
    count: int
    seed: tuple[int, ...]

    def __call__(self, time_s: np.ndarray) -> np.ndarray:
        """Values (n, count) at times (n,)."""
        return np.stack([np.interp(time_s, self._times, each) for each in self._values.T], axis=1)

    @cached_property
    def _times(self) -> np.ndarray:
        return np.arange(0.0, self.until_s + 2 * STEP * self.length_s, STEP * self.length_s)

    @cached_property
    def _values(self) -> np.ndarray:
        away = np.sqrt(3) * np.abs(self._times[:, None] - self._times) / self.length_s
        root = np.linalg.cholesky((1 + away) * np.exp(-away) + 1e-10 * np.eye(len(away)))
        normal = np.random.default_rng(self.seed).standard_normal((len(away), self.count))
        return np.asarray(self.sd * root @ normal)


@dataclass(frozen=True, eq=False)
class DriftingZeros:
    """The zero of each element is a random function of time, over its peak reading."""

    course: Course
    peak: np.ndarray

    def __call__(self, clean: np.ndarray, time_s: np.ndarray) -> np.ndarray:
        """Readings with it."""
        return np.asarray(clean + self.peak * self.course(time_s))


@dataclass(frozen=True, eq=False)
class DriftingGain:
    """All gains, or each of them, change by a random function of time, a share."""

    course: Course

    def __call__(self, clean: np.ndarray, time_s: np.ndarray) -> np.ndarray:
        """Readings with it."""
        return np.asarray(clean * (1 + self.course(time_s)))
