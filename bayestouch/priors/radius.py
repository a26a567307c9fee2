"""Priors of the composite radius R that follow from a prior over indenters: densities and point masses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray
from bayestouch.errors import InputError
from bayestouch.priors.parameters import Prior

Quantity = Literal["R", "r_c", "curvature"]

QUANTITIES: tuple[Quantity, ...] = ("R", "r_c", "curvature")
# Bisection steps that find the probability below a value from a prior's quantiles, to the last bit.
HALVINGS = 60


@dataclass(frozen=True)
class DerivedRadius:
    """Prior of R that follows from a prior of R, r_c or the curvature 1/r_c, truncated at knife edge and flat.

    With ``1/R = 1/r_b + 1/r_c`` a density of r_c is multiplied by ``dr_c/dR = (r_b/(r_b - R))²``, a density of the
    curvature by ``1/R²``.

    Attributes
    ----------
    prior : Prior
        Prior of the quantity, in mm, or 1/mm for the curvature.
    quantity : {"R", "r_c", "curvature"}
        Quantity of the prior.
    outer_radius_mm : float
        ``r_b``.
    """

    prior: Prior
    quantity: Quantity
    outer_radius_mm: float

    def __post_init__(self) -> None:
        low, high = self._shares
        if not high - low > 1e-12:
            raise InputError(f"indenter: nothing of the prior of {self.quantity} ({self.prior}) lies from edge to flat")

    @property
    def support(self) -> tuple[float, float]:
        ends = self._to_radius(np.clip(self.prior.support, *self._ends))
        return float(ends.min()), float(ends.max())

    def log_density(self, value: ArrayLike) -> FloatArray:
        radius, outer = np.asarray(value, dtype=float), self.outer_radius_mm
        inside = (radius >= 0) & (radius <= outer)
        safe = np.where(inside, radius, 0.5 * outer)
        with np.errstate(divide="ignore", invalid="ignore"):
            if self.quantity == "R":
                density = self.prior.log_density(safe)
            elif self.quantity == "r_c":
                density = self.prior.log_density(safe * outer / (outer - safe)) - 2 * np.log1p(-safe / outer)
            else:
                density = self.prior.log_density(1 / safe - 1 / outer) - 2 * np.log(safe)
        # At the ends 0 · inf may occur; these points have probability zero.
        density = np.where(np.isnan(density), -np.inf, density)
        low, high = self._shares
        return np.where(inside, density - np.log(high - low), -np.inf)

    def quantile(self, probability: ArrayLike) -> FloatArray:
        low, high = self._shares
        share = np.asarray(probability, dtype=float)
        # R decreases with the curvature.
        share = 1 - share if self.quantity == "curvature" else share
        return self._to_radius(self.prior.quantile(low + (high - low) * share))

    def __str__(self) -> str:
        return f"{self.prior} in {'1/r_c (1/mm)' if self.quantity == 'curvature' else f'{self.quantity} (mm)'}"

    @property
    def _ends(self) -> tuple[float, float]:
        """Smallest and largest value of the quantity, from knife edge to flat (curvature: from flat to edge)."""
        return (0.0, self.outer_radius_mm) if self.quantity == "R" else (0.0, np.inf)

    @cached_property
    def _shares(self) -> tuple[float, float]:
        """Probabilities of the prior below these two values."""
        low, high = self._ends
        return _probability_below(self.prior.quantile, low), _probability_below(self.prior.quantile, high)

    def _to_radius(self, value: ArrayLike) -> FloatArray:
        number, outer = np.asarray(value, dtype=float), self.outer_radius_mm
        if self.quantity == "R":
            return np.asarray(np.clip(number, 0.0, outer))
        with np.errstate(divide="ignore"):
            return np.asarray(1 / (1 / outer + (1 / number if self.quantity == "r_c" else number)))


def _probability_below(quantile: Callable[[float], FloatArray], value: float) -> float:
    if np.isinf(value):
        return 1.0
    low, high = 0.0, 1.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if float(quantile(middle)) <= value else (low, middle)
    return 0.5 * (low + high)


@dataclass(frozen=True)
class RadiusOfTips:
    """Prior of R with a point mass for each known tip and, optionally, a density for other indenters.

    Attributes
    ----------
    indenter_radius_mm : tuple of float
        ``r_c`` of the tips: 0 a knife edge, inf a flat.
    weights : tuple of float
        Probabilities of the tips; the rest of 1 is the probability of the density.
    density : Prior or None
        Density of R in mm for an indenter that is none of the tips.
    outer_radius_mm : float
        ``r_b``.
    edge_radius_mm : float
        Radius of the knife edges, for a calibration that found them blunt.
    """

    indenter_radius_mm: tuple[float, ...]
    weights: tuple[float, ...]
    density: Prior | None
    outer_radius_mm: float
    edge_radius_mm: float = 0.0

    @property
    def radius_mm(self) -> FloatArray:
        """Composite radius R of each tip in mm."""
        radius = np.asarray(self.indenter_radius_mm, dtype=float)
        radius = np.where(radius == 0, self.edge_radius_mm, radius)
        with np.errstate(divide="ignore"):
            composite = 1 / (1 / self.outer_radius_mm + 1 / radius)
        # The inverse of an inverse is not always the same number, and r_c of a flat must be infinite again.
        return np.where(np.isinf(radius), self.outer_radius_mm, composite)

    @property
    def n_alternatives(self) -> int:
        """Number of tips, plus one if there is a density."""
        return len(self.weights) + (self.density is not None)

    @property
    def share(self) -> float:
        """Probability of the density."""
        return 1 - sum(self.weights) if self.density is not None else 0.0

    @property
    def support(self) -> tuple[float, float]:
        ends = (*self.radius_mm, *(self.density.support if self.density is not None else ()))
        return float(min(ends)), float(max(ends))

    def log_density(self, value: ArrayLike) -> FloatArray:
        """Log probability at the radius of a tip, log density elsewhere."""
        radius = np.asarray(value, dtype=float)
        out = np.full(radius.shape, -np.inf)
        if self.density is not None:
            out = self.density.log_density(radius) + np.log(self.share)
        for tip, weight in zip(self.radius_mm, self.weights, strict=True):
            out = np.where(radius == tip, np.log(weight), out)
        return out

    def quantile(self, probability: ArrayLike) -> FloatArray:
        """Radius for a uniform random number: a tip below the sum of the weights (not ordered), else the density."""
        number = np.asarray(probability, dtype=float)
        sums = np.cumsum(self.weights)
        tip = np.searchsorted(sums, number, side="right")
        chosen = self.radius_mm[np.minimum(tip, len(sums) - 1)]
        if self.density is None:
            return np.asarray(chosen)
        rest = np.clip((number - sums[-1]) / self.share, 0.0, 1.0)
        return np.where(tip < len(sums), chosen, self.density.quantile(rest))

    def __str__(self) -> str:
        tips = [f"{w:.3g} at r_c = {r:g} mm" for r, w in zip(self.indenter_radius_mm, self.weights, strict=True)]
        return ", ".join(tips if self.density is None else [*tips, f"{self.share:.3g} {self.density}"])
