"""Noise of touches on a finger that depends on the signal."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.data.arrays import read_once
from bayestouch.model.noise import AddedNoise

# Least part of the variance of a reading that does not depend on the signal, over the part that does: far below that of
# any sensor, and above zero.
LEAST_OTHER = 1e-3


@dataclass(frozen=True, eq=False)
class SignalNoise:
    """Noise that depends on the signal: variance of the readings of t touches over that at their modes.

    Attributes
    ----------
    added : AddedNoise
        The noise.
    peak : (m,) array
        Peak readings, its unit.
    counts : (t, m) array
        Number of raw readings in each mean, at least 1.
    at_mode, other : (t, m) arrays
        Variance of each reading at the mode of its touch, and its part by all else.
    """

    added: AddedNoise
    peak: FloatArray
    counts: FloatArray
    at_mode: FloatArray
    other: FloatArray

    @classmethod
    def of(
        cls, added: AddedNoise, peak: FloatArray, counts: FloatArray, signal: FloatArray, covariance: FloatArray
    ) -> SignalNoise:
        """From the readings (t, m) at the modes, and the covariance (t, m, m) of the readings there."""
        counts = read_once(counts)
        own = added.variance(signal, peak) / counts
        # Effects in time change the signals of the covariance a little: no part of it becomes negative.
        other = np.maximum(np.einsum("tii->ti", covariance) - own, LEAST_OTHER * own)
        return cls(added, peak, counts, own + other, other)

    def select(self, index: IntArray) -> SignalNoise:
        """The noise of some of the touches."""
        return replace(self, counts=self.counts[index], at_mode=self.at_mode[index], other=self.other[index])

    def growth(self, predicted: NDArray[np.floating], blocks: IntArray) -> FloatArray:
        """Variance of predicted readings (B, W, m) of the touches `blocks` (B,), over that at the mode."""
        own = self.added.variance(np.asarray(predicted, dtype=np.float64), self.peak) / self.counts[blocks][:, None]
        return np.asarray((own + self.other[blocks][:, None]) / self.at_mode[blocks][:, None])
