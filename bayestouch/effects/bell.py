"""Bells of effects that are strongest somewhere and fall off around it."""

from __future__ import annotations

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.effects.effect import EffectParameter
from bayestouch.priors.parameters import Normal

#: How a bell falls off: little is known of it beforehand, and where the effect is small the data say little.
TAILS = EffectParameter(
    "tails", "", "-1: a parabola, 0: a normal bell, 1: a Lorentzian", Normal(0.0, 0.5, -1.0, 2.0), (0.0,)
)
# Nearer to zero than this no number tells the bell from a normal one.
NORMAL = 1e-9


def bell(square: FloatArray, tails: float) -> FloatArray:
    """``(1 + (2^tails - 1) u²)^(-1/tails)`` of the squared distance u²: one in the middle, a half where u is 1.

    Distances are in half widths, so that a fit that changes the tails need not change the width.

    Reference: K. Pearson, Phil. Trans. R. Soc. A 216, 429 (1916), type VII with the exponent 1/tails, and type II.
    """
    if abs(tails) < NORMAL:
        return np.asarray(np.exp2(-square))
    # Where a bell of finite reach has ended, the logarithm would be that of a number below zero.
    inside = np.maximum(np.expm1(tails * np.log(2)) * square, -1 + 1e-12)
    return np.asarray(np.exp(-np.log1p(inside) / tails))
