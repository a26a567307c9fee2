"""The first coordinate of a touch on a finger: one number w for every indenter, tips and densities alike.

A density of R between a and b lives on ``R = a + (b - a)/(1 + e^-w)``, which keeps R inside. A known tip, a point
mass, is a cell of unit length far below, all of whose points mean that tip; inside a cell the density is level. So a
discrete set of tips, or an edge beside something round, is a density of w like any other and is drawn like any other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray
from bayestouch.priors.parameters import Prior
from bayestouch.priors.radius import RadiusOfTips

# Cells end here. A density beside them loses what lies below: R within e^-16 (1e-7) of its lower end.
CELLS_END = -16.0


@dataclass(frozen=True, eq=False)
class IndenterCoordinate:
    """Indenters on a line.

    Attributes
    ----------
    prior : Prior
        Of R, mm: a density, or a `RadiusOfTips`.
    outer_radius_mm : float
        ``r_b``.
    """

    prior: Prior
    outer_radius_mm: float

    @property
    def tips(self) -> RadiusOfTips | None:
        """Prior of the tips, where there are any."""
        return self.prior if isinstance(self.prior, RadiusOfTips) else None

    @property
    def n_tips(self) -> int:
        """Number of tips."""
        return 0 if self.tips is None else len(self.tips.weights)

    @property
    def density(self) -> Prior | None:
        """Density of R beside the tips, or alone."""
        return self.prior if self.tips is None else self.tips.density

    @property
    def cells(self) -> FloatArray:
        """Lower ends of the tips' cells, (n_tips,)."""
        return CELLS_END - self.n_tips + np.arange(self.n_tips, dtype=float)

    def radius(self, w: FloatArray) -> FloatArray:
        """Composite radius R in mm, shape of `w`; 0 where w means nothing."""
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
        """R and r_c in mm, shape of `w`; a tip's r_c is what it was said to be, inf for a flat one.

        A density's R reaches ``r_b`` to the last bit for a flat; its r_c would be infinite, which means cannot hold:
        R stays just below.
        """
        outer = self.outer_radius_mm
        radius = self.radius(w)
        below = np.minimum(radius, outer * (1 - 1e-9))
        r_c = below * outer / (outer - below)
        if self.tips is None:
            return below, r_c
        tip, is_tip = self._tip(w)
        return np.where(is_tip, radius, below), np.where(is_tip, np.array(self.tips.indenter_radius_mm)[tip], r_c)

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
        """Number of the tip that w means, `n_tips` for the density beside them; shape of `w`."""
        tip, is_tip = self._tip(w)
        return np.where(is_tip, tip, self.n_tips)

    def log_shares(self, w: FloatArray) -> FloatArray:
        """Log share of each tip, and of the density beside them, among draws (chain, draw, t): (k, t)."""
        chosen = self.alternative(w)
        count = np.stack([(chosen == k).sum(axis=(0, 1)) for k in range(self.tips.n_alternatives if self.tips else 0)])
        # Half a draw each, so that what was not drawn is not impossible.
        return np.asarray(np.log(count + 0.5) - np.log(w.shape[0] * w.shape[1] + 0.5 * len(count)))

    def _tip(self, w: FloatArray) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """Number of the tip, and whether w is in a cell."""
        place = np.floor(w) - (CELLS_END - self.n_tips)
        is_tip = (place >= 0) & (place < self.n_tips)
        return np.where(is_tip, place, 0).astype(np.int64), is_tip
