"""What a user may know of the indenters that touch a finger, before any touch is read.

Every class here is an `IndenterPrior`: it gives the prior of the composite radius R on a finger. All of them leave
concave indenters out (R is at most ``r_b``).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol, runtime_checkable

import numpy as np

from bayestouch.errors import InputError
from bayestouch.output.summary import Summarised
from bayestouch.priors.parameters import Prior, Uniform
from bayestouch.priors.radius import QUANTITIES, DerivedRadius, Quantity, RadiusOfTips


@runtime_checkable
class IndenterPrior(Protocol):
    """Prior over indenters."""

    def radius_prior(self, outer_radius_mm: float) -> Prior:
        """Prior of R in mm on a finger of outer radius ``r_b``."""
        ...


@dataclass(frozen=True, repr=False)
class UniformRadius(Summarised):
    """Uniform in the composite radius R from a knife edge to a flat; the default."""

    def radius_prior(self, outer_radius_mm: float) -> Prior:
        """Uniform from 0 to ``r_b``."""
        return Uniform(0.0, outer_radius_mm)

    def __str__(self) -> str:
        return "uniform"


@dataclass(frozen=True, repr=False)
class UniformCurvature(Summarised):
    """Uniform in the curvature ``1/r_c``, from a flat to the sharpest indenter.

    Attributes
    ----------
    sharpest_mm : float
        Its radius r_c in mm, above 0: a knife edge has infinite curvature, and no uniform prior reaches it.
    """

    sharpest_mm: float

    def __post_init__(self) -> None:
        if not 0 < self.sharpest_mm < np.inf:
            raise InputError(
                f"indenter: a prior uniform in curvature needs the radius of the sharpest indenter in mm, "
                f"above 0, got {self.sharpest_mm:g}"
            )

    def radius_prior(self, outer_radius_mm: float) -> Prior:
        """Density ``∝ 1/R²`` between the sharpest indenter's R and ``r_b``."""
        return DerivedRadius(Uniform(0.0, 1 / self.sharpest_mm), "curvature", outer_radius_mm)

    def __str__(self) -> str:
        return f"curvature:{self.sharpest_mm:g}"


@dataclass(frozen=True, repr=False)
class IndenterDistribution(Summarised):
    """Any one-dimensional prior of the indenter's radius or curvature, such as `LogNormal`.

    Attributes
    ----------
    prior : Prior
        Its density; what lies outside edge and flat is cut off.
    quantity : {"r_c", "R", "curvature"}
        What it is a prior of: the indenter's radius or the composite radius in mm, or ``1/r_c`` in 1/mm.
    """

    prior: Prior
    quantity: Quantity = "r_c"

    def __post_init__(self) -> None:
        if self.quantity not in QUANTITIES:
            raise InputError(f"indenter: expected a prior of one of {', '.join(QUANTITIES)}, got {self.quantity!r}")
        if not all(hasattr(self.prior, name) for name in ("support", "log_density", "quantile")):
            raise InputError(f"indenter: expected a prior such as LogNormal(2.0, 0.5), got {self.prior!r}")

    def radius_prior(self, outer_radius_mm: float) -> Prior:
        """The density carried over to R."""
        return DerivedRadius(self.prior, self.quantity, outer_radius_mm)

    def __str__(self) -> str:
        return f"{self.prior} in {self.quantity}"


@dataclass(frozen=True, repr=False)
class KnownTips(Summarised):
    """The indenter is one of a set of known tips; which one is inferred for each touch.

    Attributes
    ----------
    radius_mm : tuple of float
        Their radii r_c: 0 a knife edge, inf a flat.
    weights : tuple of float
        Their prior probabilities, which add up to 1; equal by default.
    """

    radius_mm: Sequence[float]
    weights: Sequence[float] = field(default=())

    def __post_init__(self) -> None:
        radii = tuple(float(radius) for radius in self.radius_mm)
        weights = tuple(float(weight) for weight in self.weights) or (1 / max(len(radii), 1),) * len(radii)
        if not radii:
            raise InputError("indenter: expected the radius of at least one tip")
        for radius in radii:
            if not radius >= 0:
                raise InputError(f"indenter: expected radii of tips from 0 (edge) to inf (flat) mm, got {radius:g}")
        if len(set(radii)) < len(radii):
            twice = next(radius for radius in radii if radii.count(radius) > 1)
            raise InputError(f"indenter: the tip of {twice:g} mm is given twice")
        if len(weights) != len(radii):
            raise InputError(f"indenter: expected a weight for each of {len(radii)} tips, got {len(weights)}")
        if not all(0 < weight <= 1 for weight in weights):
            raise InputError(f"indenter: expected weights of tips above 0, got {', '.join(f'{w:g}' for w in weights)}")
        if abs(sum(weights) - 1) > 1e-6:
            raise InputError(f"indenter: expected weights of tips that add up to 1, got {sum(weights):g}")
        object.__setattr__(self, "radius_mm", radii)
        object.__setattr__(self, "weights", tuple(weight / sum(weights) for weight in weights))

    def radius_prior(self, outer_radius_mm: float) -> Prior:
        """Point masses at the tips' R."""
        return RadiusOfTips(tuple(self.radius_mm), tuple(self.weights), None, outer_radius_mm)

    def __str__(self) -> str:
        pairs = zip(self.radius_mm, self.weights, strict=True)
        return "tips:" + ",".join(f"{radius:g}={weight:g}" for radius, weight in pairs)


@dataclass(frozen=True, repr=False)
class EdgeOrRound(Summarised):
    """The indenter is a knife edge or something round; which of them is inferred for each touch.

    Attributes
    ----------
    edge_probability : float
        Prior probability of the edge.
    round : IndenterPrior
        Prior of a round indenter: uniform in R, in curvature or any other density.
    """

    edge_probability: float = 0.5
    round: IndenterPrior = UniformRadius()

    def __post_init__(self) -> None:
        if not 0 < self.edge_probability < 1:
            raise InputError(
                f"indenter: expected a probability of the edge inside 0 and 1, got {self.edge_probability:g}"
            )
        if not isinstance(self.round, IndenterPrior) or isinstance(self.round, KnownTips | EdgeOrRound):
            raise InputError(f"indenter: expected a density of round indenters, got {self.round!r}")

    def radius_prior(self, outer_radius_mm: float) -> Prior:
        """A point mass at R = 0 beside the density of round indenters."""
        density = self.round.radius_prior(outer_radius_mm)
        return RadiusOfTips((0.0,), (self.edge_probability,), density, outer_radius_mm)

    def __str__(self) -> str:
        end = "" if isinstance(self.round, UniformRadius) else f" with round {self.round}"
        return f"edge-or-round:{self.edge_probability:g}{end}"
