"""Parameters (name, symbol, unit, prior) and one-dimensional priors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr, ndtri

from bayestouch.array_types import FloatArray
from bayestouch.errors import InputError


class Prior(Protocol):
    """Protocol of a one-dimensional prior density."""

    @property
    def support(self) -> tuple[float, float]:
        """Smallest and largest allowed value."""
        ...

    def log_density(self, value: ArrayLike) -> FloatArray:
        """Logarithm of the normalised density, ``-inf`` outside the support. Shape of `value`."""
        ...

    def quantile(self, probability: ArrayLike) -> FloatArray:
        """Quantile at `probability`; with uniform random numbers, draws from the prior."""
        ...


@dataclass(frozen=True)
class Uniform:
    """Uniform prior between `low` and `high`."""

    low: float
    high: float

    def __post_init__(self) -> None:
        if not (np.isfinite(self.low) and np.isfinite(self.high) and self.low < self.high):
            raise InputError(f"uniform prior: expected low < high, got {self.low:g} and {self.high:g}")

    @property
    def support(self) -> tuple[float, float]:
        return self.low, self.high

    def log_density(self, value: ArrayLike) -> FloatArray:
        inside = (np.asarray(value) >= self.low) & (np.asarray(value) <= self.high)
        return np.where(inside, -np.log(self.high - self.low), -np.inf)

    def quantile(self, probability: ArrayLike) -> FloatArray:
        return self.low + (self.high - self.low) * np.asarray(probability, dtype=float)

    def __str__(self) -> str:
        return f"uniform from {self.low:g} to {self.high:g}"


@dataclass(frozen=True)
class Normal:
    """Normal prior with mean and standard deviation, truncated to `low` … `high`."""

    mean: float
    sd: float
    low: float = -np.inf
    high: float = np.inf

    def __post_init__(self) -> None:
        if not (np.isfinite(self.mean) and 0 < self.sd < np.inf):
            raise InputError(f"normal prior: expected a finite mean and sd > 0, got {self.mean:g}, {self.sd:g}")
        if not self.low < self.high or self._mass <= 0:
            raise InputError(f"normal prior: nothing of it lies between {self.low:g} and {self.high:g}")

    @property
    def support(self) -> tuple[float, float]:
        return self.low, self.high

    @property
    def _mass(self) -> float:
        return float(ndtr((self.high - self.mean) / self.sd) - ndtr((self.low - self.mean) / self.sd))

    def log_density(self, value: ArrayLike) -> FloatArray:
        value = np.asarray(value, dtype=float)
        z = (value - self.mean) / self.sd
        density = -0.5 * z * z - np.log(self.sd * np.sqrt(2 * np.pi) * self._mass)
        return np.where((value >= self.low) & (value <= self.high), density, -np.inf)

    def quantile(self, probability: ArrayLike) -> FloatArray:
        below = ndtr((self.low - self.mean) / self.sd)
        return np.asarray(self.mean + self.sd * ndtri(below + np.asarray(probability) * self._mass))

    def __str__(self) -> str:
        ends = "" if np.isinf(self.low) and np.isinf(self.high) else f", within {self.low:g} to {self.high:g}"
        return f"normal, {self.mean:g} ± {self.sd:g}{ends}"


@dataclass(frozen=True)
class LogNormal:
    """Log-normal prior: the logarithm is normal with mean ``log(median)`` and standard deviation `spread`."""

    median: float
    spread: float

    def __post_init__(self) -> None:
        if not (0 < self.median < np.inf and 0 < self.spread < np.inf):
            raise InputError(f"log-normal prior: expected median, spread > 0, got {self.median:g}, {self.spread:g}")

    @property
    def support(self) -> tuple[float, float]:
        return 0.0, np.inf

    def log_density(self, value: ArrayLike) -> FloatArray:
        value = np.asarray(value, dtype=float)
        safe = np.where(value > 0, value, 1.0)
        z = np.log(safe / self.median) / self.spread
        density = -0.5 * z * z - np.log(safe * self.spread * np.sqrt(2 * np.pi))
        return np.where(value > 0, density, -np.inf)

    def quantile(self, probability: ArrayLike) -> FloatArray:
        return np.asarray(self.median * np.exp(self.spread * ndtri(np.asarray(probability, dtype=float))))

    def __str__(self) -> str:
        return f"log-normal, median {self.median:g}, factor {np.exp(self.spread):.3g}"


@dataclass(frozen=True)
class Parameter:
    """An unknown of the measuring chain.

    Attributes
    ----------
    name : str
        Name in files (`FORMAT`): ``r_s``, ``theta_c`` …
    symbol : str
        Symbol of the paper, in Unicode, for tables.
    latex : str
        The symbol in LaTeX for figures, without dollar signs.
    unit : str
        Unit, ``""`` for a number.
    prior : Prior
        Prior of the parameter.
    description : str
        Short description.
    """

    name: str
    symbol: str
    latex: str
    unit: str
    prior: Prior
    description: str = ""

    @property
    def label(self) -> str:
        """LaTeX label with unit, for an axis."""
        return f"${self.latex}$" + (f" ({self.unit})" if self.unit else "")


# A prior with a probability less than this inside the bounds contradicts the bounds.
LEAST_MASS = 1e-3


def truncated(prior: Prior, low: float, high: float) -> Prior:
    """Return the prior truncated to `low` … `high`.

    Raises
    ------
    InputError
        Its probability between the bounds is almost zero, or this kind of prior cannot be truncated.
    """
    ends = prior.support
    if ends[0] >= low and ends[1] <= high:
        return prior
    inside = max(ends[0], low), min(ends[1], high)
    message = f"nothing of the prior ({prior}) lies between {low:g} and {high:g}"
    if isinstance(prior, Uniform):
        if inside[1] - inside[0] < LEAST_MASS * (prior.high - prior.low):
            raise InputError(message)
        return Uniform(*inside)
    if isinstance(prior, Normal):
        share = np.diff(ndtr((np.array([*inside]) - prior.mean) / prior.sd))[0] / prior._mass
        if not inside[0] < inside[1] or share < LEAST_MASS:
            raise InputError(message)
        return Normal(prior.mean, prior.sd, *inside)
    raise InputError(f"the prior ({prior}) reaches beyond {low:g} to {high:g}: give a normal or uniform one")


def moved(prior: Prior, factor: float, shift: float) -> Prior:
    """Return the prior of ``factor x + shift``, where x has the given prior and the factor is positive.

    Raises
    ------
    InputError
        The prior is neither normal nor uniform.
    """
    if isinstance(prior, Uniform):
        return Uniform(factor * prior.low + shift, factor * prior.high + shift)
    if isinstance(prior, Normal):
        mean, low, high = (factor * value + shift for value in (prior.mean, prior.low, prior.high))
        return Normal(mean, factor * prior.sd, low, high)
    raise InputError(f"expected a normal or uniform prior, got {prior}")
