"""Noise of means and of samples, and rows made independent with variance one."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayestouch.affected.columns import WhiteColumns
from bayestouch.affected.observations import Observations
from bayestouch.effects.effect import Values
from bayestouch.fit import whiten_rank_one

FloatArray = NDArray[np.float64]


def moved_together(peak: FloatArray, shared: float) -> FloatArray:
    """What a shared error of size one does to readings of these peaks (m,): from own peak to mean peak."""
    return np.asarray(peak ** (1 - shared) * float(peak.mean()) ** shared)


@dataclass(frozen=True, eq=False)
class NoiseModel:
    """Noise of one reading, with what effects of the noise add.

    Attributes
    ----------
    sd : (m,) array
        Each element's own noise, in the unit of the readings.
    load_sd : (t,) array
        Standard error of each touch's load.
    peak : (m,) array
        Size of each element's peak reading: the unit of shares.
    share, power : float
        Further noise of sd ``share |signal/peak|^power``, over the peak.
    common : float
        Noise that all elements share in one sample, over the peak.
    common_touch : float
        The same in all samples of a touch.
    common_shared : float
        Whether these are of each element's own peak (0) or of the mean peak (1), or between.
    effects : tuple of (name, values)
        Effects of the noise that are in it.
    """

    sd: FloatArray
    load_sd: FloatArray
    peak: FloatArray
    share: float = 0.0
    power: float = 1.0
    common: float = 0.0
    common_touch: float = 0.0
    common_shared: float = 0.0
    effects: tuple[tuple[str, Values], ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Effects of the noise."""
        return tuple(name for name, _ in self.effects)

    def added(self, signal: FloatArray) -> FloatArray:
        """Variance of one reading that comes with the signal, shape of `signal` (..., m)."""
        return np.asarray((self.share * self.peak * np.abs(signal / self.peak) ** self.power) ** 2)

    def added_terms(self) -> dict[str, float]:
        """What effects of the noise add, by name."""
        return {name: getattr(self, name) for name in ("share", "power", "common", "common_touch", "common_shared")}

    @property
    def together(self) -> FloatArray:
        """What a shared error of size one does to each element's reading, (m,)."""
        return moved_together(self.peak, self.common_shared)

    def with_(self, **changes: object) -> NoiseModel:
        """The same with other values."""
        return replace(self, **changes)  # type: ignore[arg-type]  # checked when it is made


@dataclass(frozen=True, eq=False)
class Whitening:
    """Makes the readings of a touch, and those of a sample, independent with variance one.

    Attributes
    ----------
    root : (t, m, m) array
        Inverse Cholesky factor of the covariance of each touch's means: noise, and the load's error, which moves
        all elements together. Rows and columns of missing readings are zero.
    sample_sd, sample_shared : (n, m) arrays
        Noise of a sample, and what one standard deviation of its shared error does; inf where missing.
    """

    root: FloatArray
    sample_sd: FloatArray
    sample_shared: FloatArray

    @classmethod
    def of(cls, observed: Observations, noise: NoiseModel, signal: FloatArray, by_load: FloatArray) -> Whitening:
        """Whitening for touches of which the readings (t, m) and their derivative over the load are predicted."""
        means = observed.means
        counts = np.where(np.isnan(means.readings), 0, means.counts)
        present = counts > 0
        one = noise.sd**2 + noise.added(signal)
        variance = np.where(present, one / np.maximum(counts, 1), 1.0)
        reads = np.maximum(counts.max(axis=1), 1)
        common = np.sqrt(noise.common**2 / reads + noise.common_touch**2)[:, None] * noise.together
        covariance = np.einsum("ti,ij->tij", variance, np.eye(variance.shape[1]))
        for direction in (by_load * noise.load_sd[:, None], common):
            seen = np.where(present, direction, 0.0)
            covariance += seen[:, :, None] * seen[:, None, :]
        root = np.linalg.solve(np.linalg.cholesky(covariance), np.eye(variance.shape[1])[None])
        root = root * present[:, :, None] * present[:, None, :]
        row_sd = np.sqrt(one[observed.row_touch] / observed.weight[:, None])
        row_sd = np.where(np.isnan(observed.deviation), np.inf, row_sd)
        shared = noise.common * noise.together / np.sqrt(observed.weight)[:, None]
        return cls(np.asarray(root, dtype=np.float64), row_sd, np.where(np.isfinite(row_sd), shared, 0.0))

    @property
    def present(self) -> NDArray[np.bool_]:
        """Mean readings that are there, (t, m)."""
        return np.asarray((self.root != 0).any(axis=2))

    def columns(self, raw: FloatArray) -> WhiteColumns:
        """Whitened columns of mean readings (c, t, m)."""
        return WhiteColumns.of(raw, self.root)

    def touches(self, rows: FloatArray) -> FloatArray:
        """Whitened rows (..., t, m)."""
        return np.asarray(np.einsum("tij,...tj->...ti", self.root, np.nan_to_num(rows), optimize=True))

    def samples(self, rows: FloatArray) -> FloatArray:
        """Whitened deviations (..., n, m); zero where missing."""
        return whiten_rank_one(np.nan_to_num(rows), self.sample_sd, self.sample_shared)
