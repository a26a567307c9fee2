"""Elements that average the strain over a part of the arc."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray


@dataclass(frozen=True, eq=False)
class ElementWeight:
    """Weight with which elements average the strain along the arc.

    A share `tails` of the weight is exponential on both sides, the rest is a running mean over the width. Both parts
    have the same variance, w²/12.

    Attributes
    ----------
    width_mm : float or (..., m) array
        Width w of all elements, or of each. The sign does not matter.
    tails : float or (..., 1, 1) array
        Share of the exponential part, 0 to 1.
    """

    width_mm: float | FloatArray
    tails: float | FloatArray = 0.0

    @classmethod
    def stacked(cls, weights: Sequence[ElementWeight | None]) -> ElementWeight | None:
        """Weights of n fingers as one, with widths (n, m) or (n, 1); all or none of the fingers have one."""
        known = [each for each in weights if each is not None]
        if not known:
            return None
        widths = np.stack([np.atleast_1d(each.width_mm) for each in known])
        return cls(widths, np.array([each.tails for each in known])[:, None, None])

    def of_modes(self, modes: FloatArray, radii_mm: FloatArray) -> FloatArray:
        """Mean of ``cos kθ`` over each element, over that at its middle, (..., m, n_modes).

        With ``u = k w/(2 r)`` it is ``sin(u)/u`` of the running mean, and ``1/(1 + u²/6)`` of the exponential part.

        Parameters
        ----------
        modes : (n_modes,) array
            Waves per turn k.
        radii_mm : (..., m) array
            Radii r of the elements.
        """
        u = modes * (np.asarray(self.width_mm) / radii_mm)[..., None] / 2
        return np.asarray((1 - self.tails) * np.sinc(u / np.pi) + self.tails / (1 + u**2 / 6))
