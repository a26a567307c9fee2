"""Bells of effects that are strongest somewhere and fall off around it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayestouch.effects.effect import EffectParameter
from bayestouch.parameters import Normal

FloatArray = NDArray[np.float64]

#: How a bell falls off: little is known of it beforehand, and where the effect is small the data say little.
TAILS = EffectParameter(
    "tails", "", "-1: a parabola, 0: a normal bell, 1: a Lorentzian", Normal(0.0, 0.5, -1.0, 2.0), (0.0,)
)
# Nearer to zero than this no number tells the bell from a normal one.
NORMAL = 1e-9


def bell(square: FloatArray, tails: float) -> FloatArray:
    """``(1 + tails u²/2)^(-1/tails)`` of the squared distance u² in widths: one in the middle, curved as a normal bell.

    Reference: C. Tsallis, Introduction to Nonextensive Statistical Mechanics (2009), the q-Gaussian with q = 1 + tails.
    """
    if abs(tails) < NORMAL:
        return np.asarray(np.exp(-0.5 * square))
    # Where a bell of finite reach has ended, the logarithm would be that of a number below zero.
    inside = np.maximum(0.5 * tails * square, -1 + 1e-12)
    return np.asarray(np.exp(-np.log1p(inside) / tails))
