"""Noise of a pad with what effects of the noise add to it.

Each element then has a noise that depends on its signal, and errors that it shares with the others in a sample or in a
touch. In fits of a map, which are made element by element, shared errors count as errors of each element alone.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray
from bayestouch.chain.noise import Noise
from bayestouch.data.arrays import read_once
from bayestouch.model.noise import AddedNoise, parts_shared


@dataclass(frozen=True, eq=False)
class NoiseByEffects:
    """What effects of the noise add to the readings of a pad; m elements.

    Attributes
    ----------
    added : AddedNoise
        Sizes of the errors.
    peak, zero : (m,) arrays
        Peak readings, the unit of the sizes, and readings without touch: effects are functions of the whole reading.
    """

    added: AddedNoise
    peak: FloatArray
    zero: FloatArray

    def to(self, noise: Noise) -> PadNoise:
        """The noise of a sensor, whose `tactile_sd` is that of a reading without these effects, with them."""
        return PadNoise(**{each.name: getattr(noise, each.name) for each in fields(Noise)}, by_effects=self)

    def own_variance(self, signal: ArrayLike) -> FloatArray:
        """Variance that each element has for itself in one reading with a signal (..., m)."""
        return self.added.variance(self.zero + np.asarray(signal), self.peak)

    @property
    def shared_variance(self) -> FloatArray:
        """Variance of one reading by the error that all elements share in a sample, (m,)."""
        return np.asarray((self.added.common * self.added.together(self.peak)) ** 2)

    @property
    def shared_variance_of_touch(self) -> FloatArray:
        """Variance of readings by the error that all elements share in all samples of a touch, (m,)."""
        return np.asarray((self.added.common_touch * self.added.together(self.peak)) ** 2)


@dataclass(frozen=True, eq=False)
class NoiseWithEffects:
    """Noise of one reading by the scatter of the samples of touches.

    Attributes
    ----------
    own_sd : (m,) array
        Noise of each element without effects of the noise.
    by_effects : NoiseByEffects or None
        What the effects add; None if they add nothing.
    """

    own_sd: FloatArray
    by_effects: NoiseByEffects | None


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class PadNoise(Noise):
    """Noise of a pad with effects of the noise. `tactile_sd` is that of a reading without them.

    Attributes
    ----------
    by_effects : NoiseByEffects
        What the effects add.
    alone : bool
        Whether errors that elements share count as errors of each element alone.
    """

    by_effects: NoiseByEffects
    alone: bool = False

    def without_effects(self) -> Noise:
        """See `Noise.without_effects`."""
        names = (each.name for each in fields(Noise))
        return Noise(**{name: getattr(self, name) for name in names})

    def widened(self, excess: float) -> PadNoise:
        """See `Noise.widened`."""
        added = self.by_effects.added.widened(excess)
        return replace(super().widened(excess), by_effects=replace(self.by_effects, added=added))

    def apart(self) -> PadNoise:
        """See `Noise.apart`."""
        return replace(self, alone=True)

    def averaged_variance(self, counts: ArrayLike, signal: ArrayLike) -> FloatArray:
        """See `Noise.averaged_variance`; errors that elements share are a part of it."""
        one = self.tactile_sd**2 + self.by_effects.own_variance(signal) + self.by_effects.shared_variance
        return _averaged(one, counts)

    def lasting_variance(self, signal: ArrayLike) -> FloatArray:
        """See `Noise.lasting_variance`; errors that elements share in a touch are a part of it."""
        return super().lasting_variance(signal) + self.by_effects.shared_variance_of_touch

    def own_variance(self, counts: ArrayLike, signal: ArrayLike) -> FloatArray:
        """See `Noise.own_variance`."""
        if self.alone:
            return self.mean_variance(counts, signal)
        constant = _averaged(self.tactile_sd**2, counts) + self.discrepancy_sd**2
        return constant + self.own_signal_variance(counts, signal)

    def own_signal_variance(self, counts: ArrayLike, signal: ArrayLike) -> FloatArray:
        """See `Noise.own_signal_variance`."""
        averaged = _averaged(self.by_effects.own_variance(signal), counts)
        return averaged + super().own_signal_variance(counts, signal)

    def shared_errors(self, counts: FloatArray) -> FloatArray:
        """See `Noise.shared_errors`."""
        added = self.by_effects.added
        if self.alone or not (added.common or added.common_touch):
            return super().shared_errors(counts)
        return added.shared_errors(parts_shared(counts), self.by_effects.peak)


def _averaged(variance: FloatArray, counts: ArrayLike) -> FloatArray:
    """Variance of means over `counts` readings (..., m) from that of one; infinite without a reading."""
    counts = np.asarray(counts, dtype=float)
    return np.where(counts > 0, variance / read_once(counts), np.inf)
