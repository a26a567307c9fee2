"""Noise of readings and loads, with the contributions of noise effects."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray
from bayestouch.chain.noise import Noise
from bayestouch.data.arrays import read_once
from bayestouch.effects.effect import Values
from bayestouch.effects.noise import NoiseEffect

# Smallest sd of one reading, over the peak: negligible, but not zero, because the whitening divides by it. Without
# repeats the sd of one reading counts as zero.
LEAST_SD = 1e-6
# Values of the noise at which its density is computed: their number, and their range in standard deviations of the
# prior about its mean. A noise farther from what was stated is no noise.
POINTS, REACH = 401, 5.0


def parts_shared(counts: FloatArray) -> FloatArray:
    """Parts of the variance of means over `counts` samples (t, m) by one error of each sample, (q, t, m).

    They are in units of the variance of one sample. Elements with the same number of samples have the same error: one
    part, 1/n. An element that lacks a few samples has the error of the others in those that it has, and so a part more,
    which only elements share that lack as many. The sum over parts of the root of the product of two elements is
    ``1/max(n_i, n_j)``, which is exact if the element with fewer samples has none that the other lacks. An element
    without samples counts as one that has all.
    """
    share = 1 / read_once(np.where(counts > 0, counts, counts.max(axis=1, keepdims=True)))
    level = share.min(axis=1, keepdims=True)
    parts = [np.broadcast_to(level, share.shape)]
    while (more := share > level).any():
        above = np.where(more, share, np.inf).min(axis=1, keepdims=True)
        above = np.where(np.isfinite(above), above, level)
        parts.append(np.where(more, above - level, 0.0))
        level = above
    return np.stack(parts)


@dataclass(frozen=True)
class AddedNoise:
    """Noise that noise effects add to each element's own noise; sizes are shares of the peak reading.

    Attributes
    ----------
    share, power : float
        Sd ``share |signal/peak|^power`` of noise that depends on the signal.
    common : float
        Sd of an error that all elements share, independent between samples.
    common_touch : float
        Sd of an error that all elements share, equal in all samples of a touch.
    common_shared : float
        Unit of these errors: each element's own peak (0), the mean peak (1), or between.
    """

    share: float = 0.0
    power: float = 1.0
    common: float = 0.0
    common_touch: float = 0.0
    common_shared: float = 0.0

    @property
    def adds(self) -> bool:
        """Whether there is any such noise."""
        return any((self.share, self.common, self.common_touch))

    def variance(self, signal: FloatArray, peak: FloatArray) -> FloatArray:
        """Part of the variance of one reading that depends on the signal, shape of `signal` (..., m)."""
        return np.asarray((self.share * peak * np.abs(signal / peak) ** self.power) ** 2)

    def together(self, peak: FloatArray) -> FloatArray:
        """Change of the readings per unit of a shared error, for elements with peaks (m,)."""
        return np.asarray(peak ** (1 - self.common_shared) * float(peak.mean()) ** self.common_shared)

    def for_peaks(self, ratio: float) -> AddedNoise:
        """The same noise for other peaks; `ratio` is old peak over new peak."""
        share = self.share * ratio ** (1 - self.power)
        return replace(self, share=share, common=self.common * ratio, common_touch=self.common_touch * ratio)

    def widened(self, excess: float) -> AddedNoise:
        """This noise multiplied by `excess`."""
        share, common, common_touch = (excess * each for each in (self.share, self.common, self.common_touch))
        return replace(self, share=share, common=common, common_touch=common_touch)

    def shared_variance(self, reads: ArrayLike) -> FloatArray:
        """Variance of the shared error of a mean over `reads` samples."""
        return np.asarray(self.common**2 / np.asarray(reads) + self.common_touch**2)

    def shared_errors(self, parts: FloatArray, peak: FloatArray) -> FloatArray:
        """Change of means by one sd of each error that elements share, (q, t, m), with `parts` from `parts_shared`."""
        variance = self.common**2 * (parts if self.common else parts[:1])
        variance[0] += self.common_touch**2
        return np.asarray(np.sqrt(variance) * self.together(peak))

    def mean_variance(self, signal: FloatArray, peak: FloatArray, counts: FloatArray) -> FloatArray:
        """Variance (t, m) of means over `counts` samples (t, m), for predicted signals (t, m)."""
        reads = read_once(counts)
        own = self.variance(signal, peak) / reads
        return np.asarray(own + self.shared_variance(reads) * self.together(peak) ** 2)

    def covariance(self, signal: FloatArray, peak: FloatArray, counts: FloatArray) -> FloatArray:
        """Covariance (t, m, m) of means over `counts` samples (t, m), for predicted signals (t, m).

        Of two elements, the one with fewer samples has them together with the other, see `parts_shared`.
        """
        together = self.together(peak)
        own = self.variance(signal, peak) / read_once(counts)
        most = np.maximum(counts[:, :, None], counts[:, None])
        common = self.shared_variance(read_once(most)) * np.outer(together, together)
        return np.asarray(common + own[:, :, None] * np.eye(len(peak)))


@dataclass(frozen=True, eq=False)
class NoiseModel:
    """Noise of one reading and of the loads.

    Attributes
    ----------
    sd : (m,) array
        Each element's own noise, in the unit of the readings.
    load_sd : (t,) array
        Standard error of the mean load of each touch, N/m or N.
    peak : (m,) array
        Absolute peak reading of each element, the unit of shares.
    added : AddedNoise
        Noise added by the noise effects.
    effects : tuple of (NoiseEffect, values)
        Noise effects of the model.
    lasting : Noise or None
        Noise whose discrepancy and share of the signal are included; averaging does not reduce them. None for a model
        without them.
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
        """Variance of means over `reads` samples, with the noise effects; shape of `signal` (..., m)."""
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

    def shared_errors(self, counts: FloatArray) -> FloatArray:
        """Change of means over `counts` samples (t, m) by one sd of each error that elements share, (q, t, m)."""
        return self.added.shared_errors(parts_shared(counts), self.peak)

    def shared_sd_of_sample(self, weight: FloatArray) -> FloatArray:
        """Change (n, m) of the deviation of a row of `weight` samples (n,) by one sd of the shared error."""
        return np.asarray(self.added.common * self.added.together(self.peak) / np.sqrt(weight)[:, None])

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the noise effects."""
        return tuple(effect.name for effect, _ in self.effects)

    def with_(self, **changes: object) -> NoiseModel:
        """The same noise with other values of some fields."""
        return replace(self, **changes)  # type: ignore[arg-type]  # a wrong name raises an error in `replace`


@dataclass(frozen=True)
class LoadNoise:
    """What is known of the noise of one reading of the force sensor without the readings of the elements.

    Attributes
    ----------
    mean, spread : float
        Log-normal prior: mean and standard deviation of the logarithm; the noise in N/m or N.
    scatter, freedom : float
        Sum of squares of the repeats of loads about their means, and its degrees of freedom.
    """

    mean: float
    spread: float
    scatter: float = 0.0
    freedom: float = 0.0

    @property
    def grid(self) -> FloatArray:
        """Logarithms of the noise at which densities are computed."""
        return np.asarray(self.mean + self.spread * np.linspace(-REACH, REACH, POINTS))

    def log_density(self, log_sd: FloatArray) -> FloatArray:
        """Log density of logarithms of the noise, up to a constant."""
        repeats = self.freedom * log_sd + 0.5 * self.scatter * np.exp(-2 * log_sd)
        return np.asarray(-0.5 * ((log_sd - self.mean) / self.spread) ** 2 - repeats)
