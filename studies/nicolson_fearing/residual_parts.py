"""What the edges leave over, parted: errors of location, a factor of all readings, and errors of the elements.

Only the last belong to the place and are there when a tip presses on it. A prober that is off by a little turns the
edge, and then the tip too: the tip is read where it is, with the R that it has. A factor of the touch changes P. Both
have known patterns over the elements, so that their sizes follow from the residuals alone (factor analysis with known
loadings, by expectation maximisation).

Source: D. B. Rubin and D. T. Thayer, EM algorithms for ML factor analysis, Psychometrika 47 (1982).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

ROUNDS = 60
"""Of the algorithm: sizes change by less than a hundredth after."""


@dataclass(frozen=True, eq=False)
class ResidualParts:
    """Residuals of edges as a normal distribution.

    Attributes
    ----------
    sizes : (k,) array
        Standard deviations of the touches' errors, one for each pattern.
    amounts : (edges, k) array
        Expected values of these errors.
    own : (m,) array
        Variance of the elements' errors, without that of noise.
    places : (edges, m) array
        Expected errors of the elements.
    """

    sizes: FloatArray
    amounts: FloatArray
    own: FloatArray
    places: FloatArray

    @classmethod
    def of(cls, residual: FloatArray, patterns: FloatArray, noise: FloatArray) -> ResidualParts:
        """Part residuals (edges, m) with patterns (edges, m, k) and variances of noise (m,)."""
        variance = (residual**2).mean(axis=0)
        square = variance.mean() / (patterns**2).mean(axis=(0, 1))  # each pattern could be all
        for _ in range(ROUNDS):
            weighted = patterns / variance[:, None]
            spread = np.linalg.inv(np.swapaxes(weighted, -1, -2) @ patterns + np.diag(1 / square))
            amounts = np.einsum("ekl,eml,em->ek", spread, weighted, residual)
            left = residual - np.einsum("emk,ek->em", patterns, amounts)
            square = (amounts**2 + np.einsum("ekk->ek", spread)).mean(axis=0)
            variance = (left**2 + np.einsum("emk,ekl,eml->em", patterns, spread, patterns)).mean(axis=0)
            variance = np.maximum(variance, noise)
        own = variance - noise
        return cls(np.sqrt(square), amounts, own, own / variance * left)
