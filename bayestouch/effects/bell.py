"""Bell-shaped function for effects that are largest at one location."""

from __future__ import annotations

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.effects.effect import EffectParameter
from bayestouch.priors.parameters import Normal

#: Shape of the tails. The prior is narrow, since the data hardly determine the shape where the effect is small.
TAILS = EffectParameter(
    "tails", "", "-1: a parabola, 0: a normal bell, 1: a Lorentzian", Normal(0.0, 0.5, -1.0, 2.0), (0.0,)
)
# If |tails| is below this, the bell equals a normal density (times a constant) to rounding.
NORMAL = 1e-9


def bell(square: FloatArray, tails: float) -> FloatArray:
    """Bell ``(1 + (2^tails - 1) u²)^(-1/tails)`` of the squared distance ``square`` = u²: 1 at u = 0, 1/2 at u = 1.

    The distance u is in half widths at half the height, which keeps `tails` and the width nearly independent in a fit.

    Reference: K. Pearson, Phil. Trans. R. Soc. A 216, 429 (1916), type VII with the exponent 1/tails, and type II.
    """
    if abs(tails) < NORMAL:
        return np.asarray(np.exp2(-square))
    # For tails < 0 the bell is zero beyond a finite distance; the bound avoids the logarithm of a negative number.
    inside = np.maximum(np.expm1(tails * np.log(2)) * square, -1 + 1e-12)
    return np.asarray(np.exp(-np.log1p(inside) / tails))
