"""Priors over the indenters that touch a finger, for the user to choose from.

Every class here is an `IndenterPrior`, from which the prior of the composite radius R on a finger follows. None of
them includes concave indenters (R is at most ``r_b``).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol, runtime_checkable

import numpy as np

from bayestouch.errors import InputError, number_array, shown
from bayestouch.output.summary import Summarised
from bayestouch.priors.parameters import Prior, Uniform
from bayestouch.priors.radius import QUANTITIES, DerivedRadius, Quantity, RadiusOfTips


@runtime_checkable
class IndenterPrior(Protocol):
    """Protocol of a prior over indenters."""

    def radius_prior(self, outer_radius_mm: float) -> Prior:
        """Return the prior of R in mm on a finger of outer radius ``r_b``."""
        ...


def is_indenter_prior(value: object) -> bool:
    """Return whether this is a prior over indenters, and not the class of one."""
    return isinstance(value, IndenterPrior) and not isinstance(value, type)


@dataclass(frozen=True, repr=False)
class UniformRadius(Summarised):
    """Prior uniform in the composite radius R from a knife edge to a flat; the default.

    Examples
    --------
    >>> import bayestouch
    >>> bayestouch.UniformRadius() == bayestouch.UniformRadius()
    True
    """

    def radius_prior(self, outer_radius_mm: float) -> Prior:
        """Return the uniform prior of R from 0 to ``r_b``."""
        return Uniform(0.0, outer_radius_mm)

    def __str__(self) -> str:
        return "uniform"


@dataclass(frozen=True, repr=False)
class UniformCurvature(Summarised):
    """Prior uniform in the curvature ``1/r_c``, from a flat to the sharpest indenter.

    Attributes
    ----------
    sharpest_mm : float
        Radius r_c of the sharpest indenter in mm, above 0 (the curvature of a knife edge would be infinite).

    Raises
    ------
    InputError
        The radius is not a finite number above zero.

    Examples
    --------
    >>> import bayestouch
    >>> bayestouch.UniformCurvature(sharpest_mm=0.5).sharpest_mm
    0.5
    """

    sharpest_mm: float

    def __post_init__(self) -> None:
        if not 0 < number_array("sharpest_mm", self.sharpest_mm, 0) < np.inf:
            raise InputError(
                f"indenter: a prior uniform in curvature needs the radius of the sharpest indenter in mm, "
                f"above 0, got {self.sharpest_mm:g}"
            )

    def radius_prior(self, outer_radius_mm: float) -> Prior:
        """Return the prior of R with density ``∝ 1/R²`` from the sharpest indenter's R to ``r_b``."""
        return DerivedRadius(Uniform(0.0, 1 / self.sharpest_mm), "curvature", outer_radius_mm)

    def __str__(self) -> str:
        return f"curvature:{self.sharpest_mm:g}"


@dataclass(frozen=True, repr=False)
class IndenterDistribution(Summarised):
    """Prior given by any one-dimensional density of the indenter's radius or curvature, such as `LogNormal`.

    Attributes
    ----------
    prior : Prior
        The density; values beyond knife edge and flat are excluded.
    quantity : {"r_c", "R", "curvature"}
        Quantity that has this density: the indenter's radius or the composite radius in mm, or ``1/r_c`` in 1/mm.

    Raises
    ------
    InputError
        The quantity is unknown, or `prior` is not a prior.

    Examples
    --------
    >>> import bayestouch
    >>> from bayestouch.priors.parameters import LogNormal
    >>> prior = bayestouch.IndenterDistribution(LogNormal(2.0, 0.5), quantity="r_c")  # median 2 mm
    >>> round(float(prior.radius_prior(outer_radius_mm=12.7).quantile(0.5)), 2)  # the median of R, mm
    1.73
    """

    prior: Prior
    quantity: Quantity = "r_c"

    def __post_init__(self) -> None:
        if self.quantity not in QUANTITIES:
            raise InputError(f"indenter: expected a prior of one of {', '.join(QUANTITIES)}, got {self.quantity!r}")
        methods = ("support", "log_density", "quantile")
        if isinstance(self.prior, type) or not all(hasattr(self.prior, name) for name in methods):
            raise InputError(f"indenter: expected a prior such as LogNormal(2.0, 0.5), got {shown(self.prior)}")

    def radius_prior(self, outer_radius_mm: float) -> Prior:
        """Return the density transformed to R."""
        return DerivedRadius(self.prior, self.quantity, outer_radius_mm)

    def __str__(self) -> str:
        return f"{self.prior} in {self.quantity}"


@dataclass(frozen=True, repr=False)
class KnownTips(Summarised):
    """Prior for an indenter that is one of a set of known tips; inference decides which one for each touch.

    Attributes
    ----------
    radius_mm : tuple of float
        Radii r_c of the tips: 0 a knife edge, inf a flat.
    weights : tuple of float
        Prior probabilities of the tips, which add up to 1; equal by default.

    Raises
    ------
    InputError
        A radius is not a number, is negative or is given twice, or the weights are not one for each tip, above 0 and
        with the sum 1.

    Examples
    --------
    >>> import bayestouch
    >>> bayestouch.KnownTips((0.0, 2.0, float("inf"))).radius_mm
    (0.0, 2.0, inf)
    """

    radius_mm: Sequence[float]
    weights: Sequence[float] = field(default=())

    def __post_init__(self) -> None:
        radii = tuple(number_array("radius_mm", self.radius_mm, 1).tolist())
        weights = tuple(number_array("weights", self.weights, 1).tolist()) or (1 / max(len(radii), 1),) * len(radii)
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
        """Return the prior with a point mass at the R of each tip."""
        return RadiusOfTips(tuple(self.radius_mm), tuple(self.weights), None, outer_radius_mm)

    def __str__(self) -> str:
        pairs = zip(self.radius_mm, self.weights, strict=True)
        return "tips:" + ",".join(f"{radius:g}={weight:g}" for radius, weight in pairs)


@dataclass(frozen=True, repr=False)
class EdgeOrRound(Summarised):
    """Prior for an indenter that is a knife edge or round; inference decides which for each touch.

    Attributes
    ----------
    edge_probability : float
        Prior probability of the edge.
    round : IndenterPrior
        Prior of a round indenter: uniform in R, in curvature or any other density.

    Raises
    ------
    InputError
        The probability is not between 0 and 1, or `round` is not a density of round indenters.

    Examples
    --------
    >>> import bayestouch
    >>> bayestouch.EdgeOrRound(edge_probability=0.2).edge_probability
    0.2
    """

    edge_probability: float = 0.5
    round: IndenterPrior = UniformRadius()

    def __post_init__(self) -> None:
        if not 0 < number_array("edge_probability", self.edge_probability, 0) < 1:
            raise InputError(
                f"indenter: expected a probability of the edge inside 0 and 1, got {self.edge_probability:g}"
            )
        if not is_indenter_prior(self.round) or isinstance(self.round, KnownTips | EdgeOrRound):
            raise InputError(f"indenter: expected a density of round indenters, got {shown(self.round)}")

    def radius_prior(self, outer_radius_mm: float) -> Prior:
        """Return the prior with a point mass at R = 0 and the density of round indenters."""
        density = self.round.radius_prior(outer_radius_mm)
        return RadiusOfTips((0.0,), (self.edge_probability,), density, outer_radius_mm)

    def __str__(self) -> str:
        end = "" if isinstance(self.round, UniformRadius) else f" with round {self.round}"
        return f"edge-or-round:{self.edge_probability:g}{end}"
