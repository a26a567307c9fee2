"""The first coordinate w of a touch on a finger: one number for every indenter, for known tips and for densities.

For a density of R between a and b, ``R = a + (b - a)/(1 + e^-w)``, which keeps R in this range. A known tip (a point
mass) is a cell of unit length in w, far below this range; all points of the cell are this tip, with a constant density.
Thus a prior with tips, or with an edge and a density, is also a density of w and is drawn in the same way.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray
from bayestouch.priors.parameters import Prior
from bayestouch.priors.radius import RadiusOfTips

# Upper end of the cells. The part of a density below it is lost: R within e^-16 (1e-7) of its lower end.
CELLS_END = -16.0


@dataclass(frozen=True, eq=False)
class IndenterCoordinate:
    """Conversion between w and the indenter.

    Attributes
    ----------
    prior : Prior
        Prior of R, mm: a density, or a `RadiusOfTips`.
    outer_radius_mm : float
        ``r_b``, mm.
    """

    prior: Prior
    outer_radius_mm: float

    @property
    def tips(self) -> RadiusOfTips | None:
        """The prior, if it has tips; else None."""
        return self.prior if isinstance(self.prior, RadiusOfTips) else None

    @property
    def n_tips(self) -> int:
        """Number of tips."""
        return 0 if self.tips is None else len(self.tips.weights)

    @property
    def density(self) -> Prior | None:
        """Density of R for indenters that are not known tips; None if there is none."""
        return self.prior if self.tips is None else self.tips.density

    @property
    def cells(self) -> FloatArray:
        """Lower ends of the cells of the tips, (n_tips,)."""
        return CELLS_END - self.n_tips + np.arange(self.n_tips, dtype=float)

    def radius(self, w: FloatArray) -> FloatArray:
        """Composite radius R in mm, shape of `w`; 0 where w is no indenter."""
        radius = np.zeros(np.shape(w))
        if self.density is not None:
            low, high = self.density.support
            with np.errstate(over="ignore"):
                radius = np.asarray(low + (high - low) / (1 + np.exp(-w)))
        if self.tips is None:
            return radius
        tip, is_tip = self._tip(w)
        return np.where(is_tip, self.tips.radius_mm[tip], radius)

    def indenter_radius(self, w: FloatArray) -> tuple[FloatArray, FloatArray]:
        """R and r_c in mm, shape of `w`; r_c of a tip is its stated radius, inf for a flat."""
        radius = self.radius(w)
        below, r_c = self.below_flat(radius)
        if self.tips is None:
            return below, r_c
        tip, is_tip = self._tip(w)
        return np.where(is_tip, radius, below), np.where(is_tip, np.array(self.tips.indenter_radius_mm)[tip], r_c)

    def below_flat(self, radius: FloatArray) -> tuple[FloatArray, FloatArray]:
        """R of a density (...), mm, and its r_c.

        R can equal ``r_b`` in double precision and r_c would be infinite, so that means of r_c would not exist: R is
        limited to just below ``r_b``.
        """
        outer = self.outer_radius_mm
        below = np.minimum(radius, outer * (1 - 1e-9))
        return below, below * outer / (outer - below)

    def log_density(self, w: FloatArray) -> FloatArray:
        """Log prior density of w, shape of `w`."""
        density, tips = self.density, self.tips
        if density is None:
            out = np.full(np.shape(w), -np.inf)
        else:
            low, high = density.support
            with np.errstate(over="ignore", divide="ignore"):
                share = 1 / (1 + np.exp(-w))
                jacobian = np.log(share) + np.log1p(-share)
            out = np.asarray(density.log_density(low + (high - low) * share) + (np.log(high - low) + jacobian))
        if tips is None:
            return out
        tip, is_tip = self._tip(w)
        with np.errstate(divide="ignore"):
            out = np.where(w >= CELLS_END, out + np.log(tips.share), -np.inf)
        return np.where(is_tip, np.log(tips.weights)[tip], out)

    def alternative(self, w: FloatArray) -> NDArray[np.int64]:
        """Index of the tip at w, `n_tips` for the density; shape of `w`."""
        tip, is_tip = self._tip(w)
        return np.where(is_tip, tip, self.n_tips)

    def log_shares(self, w: FloatArray) -> FloatArray:
        """Log share of each tip and, last, of the density among draws (chain, draw, t): (k, t)."""
        chosen = self.alternative(w)
        count = np.stack([(chosen == k).sum(axis=(0, 1)) for k in range(self.tips.n_alternatives if self.tips else 0)])
        # Half a draw is added to each alternative, so that the probability of a tip without draws is not zero.
        return np.asarray(np.log(count + 0.5) - np.log(w.shape[0] * w.shape[1] + 0.5 * len(count)))

    def _tip(self, w: FloatArray) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """Index of the tip, and whether w is in a cell."""
        place = np.floor(w) - (CELLS_END - self.n_tips)
        is_tip = (place >= 0) & (place < self.n_tips)
        return np.where(is_tip, place, 0).astype(np.int64), is_tip
