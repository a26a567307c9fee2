"""Noise of readings and loads, with what effects of the noise add."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray
from bayestouch.chain.noise import Noise
from bayestouch.effects.effect import Values
from bayestouch.effects.noise import NoiseEffect

# Noise of a reading, over the peak, of a sensor whose noise is not known from repeats: none, but not zero.
LEAST_SD = 1e-6


@dataclass(frozen=True)
class AddedNoise:
    """What effects of the noise add to each element's own noise; sizes are shares of the peak reading.

    Attributes
    ----------
    share, power : float
        Noise of sd ``share |signal/peak|^power``.
    common : float
        Noise that all elements share in one sample.
    common_touch : float
        The same in all samples of a touch.
    common_shared : float
        Whether these are of each element's own peak (0) or of the mean peak (1), or between.
    """

    share: float = 0.0
    power: float = 1.0
    common: float = 0.0
    common_touch: float = 0.0
    common_shared: float = 0.0

    def variance(self, signal: FloatArray, peak: FloatArray) -> FloatArray:
        """Variance of one reading that comes with the signal, shape of `signal` (..., m)."""
        return np.asarray((self.share * peak * np.abs(signal / peak) ** self.power) ** 2)

    def together(self, peak: FloatArray) -> FloatArray:
        """What a shared error of size one does to readings of these peaks (m,): from own peak to mean peak."""
        return np.asarray(peak ** (1 - self.common_shared) * float(peak.mean()) ** self.common_shared)

    def for_peaks(self, ratio: float) -> AddedNoise:
        """The same noise where peaks are smaller by `ratio`, the old over the new."""
        share = self.share * ratio ** (1 - self.power)
        return replace(self, share=share, common=self.common * ratio, common_touch=self.common_touch * ratio)

    def shared_variance(self, reads: ArrayLike) -> FloatArray:
        """Variance of the shared error of the mean of so many samples."""
        return np.asarray(self.common**2 / np.asarray(reads) + self.common_touch**2)

    def covariance(self, signal: FloatArray, peak: FloatArray, reads: FloatArray) -> FloatArray:
        """Covariance (t, m, m) of means of so many samples (t,) of which the signal (t, m) is predicted."""
        together = self.together(peak)
        own = self.variance(signal, peak) / reads[:, None]
        common = self.shared_variance(reads)[:, None, None] * np.outer(together, together)
        return np.asarray(common + own[:, :, None] * np.eye(len(peak)))


@dataclass(frozen=True, eq=False)
class NoiseModel:
    """Noise of one reading and of the loads.

    Attributes
    ----------
    sd : (m,) array
        Each element's own noise, in the unit of the readings.
    load_sd : (t,) array
        Standard error of each touch's load.
    peak : (m,) array
        Size of each element's peak reading: the unit of shares.
    added : AddedNoise
        What effects of the noise add.
    effects : tuple of (NoiseEffect, values)
        Effects of the noise that are in it.
    lasting : Noise or None
        Discrepancy and share of the signal of a sensor, which averaging does not reduce; None for a model that is right
        within the noise of its readings.
    """

    sd: FloatArray
    load_sd: FloatArray
    peak: FloatArray
    added: AddedNoise = field(default_factory=AddedNoise)
    effects: tuple[tuple[NoiseEffect, Values], ...] = ()
    lasting: Noise | None = None

    @classmethod
    def of(cls, noise: Noise, load_sd: FloatArray, peak: FloatArray) -> NoiseModel:
        """The noise of a sensor for touches whose loads have standard errors (t,)."""
        return cls(np.maximum(noise.tactile_sd, LEAST_SD * peak), load_sd, peak, lasting=noise)

    def variance(self, signal: FloatArray, reads: ArrayLike) -> FloatArray:
        """Variance of means of so many samples (shape of `signal`, (..., m)) with what effects of the noise add."""
        own = self.own_variance(signal) / np.asarray(reads)
        return np.asarray(own + self.added.shared_variance(reads) * self.added.together(self.peak) ** 2)

    def own_variance(self, signal: FloatArray) -> FloatArray:
        """Variance of each element's own noise in one sample, shape of `signal` (..., m)."""
        return np.asarray(self.sd**2 + self.added.variance(signal, self.peak))

    def mean_variance(self, signal: FloatArray, counts: ArrayLike) -> FloatArray:
        """Variance of each element's own error in means of `counts` samples, shape of `signal` (..., m)."""
        averaged = self.own_variance(signal) / np.asarray(counts)
        lasting = 0.0 if self.lasting is None else self.lasting.lasting_variance(signal)
        return np.asarray(averaged + lasting)

    def shared_sd(self, reads: FloatArray) -> FloatArray:
        """What one sd of the shared error does to means of so many samples, (t, m)."""
        return np.asarray(np.sqrt(self.added.shared_variance(reads))[:, None] * self.added.together(self.peak))

    def shared_sd_of_sample(self, weight: FloatArray) -> FloatArray:
        """The same of the deviation of rows of so many samples (n,) from the mean of their touch, (n, m)."""
        return np.asarray(self.added.common * self.added.together(self.peak) / np.sqrt(weight)[:, None])

    @property
    def names(self) -> tuple[str, ...]:
        """Effects of the noise."""
        return tuple(effect.name for effect, _ in self.effects)

    def with_(self, **changes: object) -> NoiseModel:
        """The same with other values."""
        return replace(self, **changes)  # type: ignore[arg-type]  # a wrong name fails when it is made
