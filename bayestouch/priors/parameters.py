"""Parameters (name, symbol, unit, prior) and one-dimensional priors."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import gammaln, ndtr, ndtri, stdtr, stdtrit

from bayestouch.array_types import FloatArray
from bayestouch.errors import InputError, number_array

# A truncated prior with a smaller probability contradicts its bounds. In the upper tail a difference of two
# probabilities would have fewer than four digits, and quantiles would be infinite.
LEAST_PROBABILITY = 1e-12


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
        _require_numbers("uniform", self)
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
        _require_numbers("normal", self)
        if not (np.isfinite(self.mean) and 0 < self.sd < np.inf):
            raise InputError(f"normal prior: expected a finite mean and sd > 0, got {self.mean:g}, {self.sd:g}")
        if not self.low < self.high or self._mass < LEAST_PROBABILITY:
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
        return f"normal, {self.mean:g} ± {self.sd:g}{_within(self.low, self.high)}"


@dataclass(frozen=True)
class LogNormal:
    """Log-normal prior: the logarithm is normal with mean ``log(median)`` and standard deviation `spread`."""

    median: float
    spread: float

    def __post_init__(self) -> None:
        _require_numbers("log-normal", self)
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
class StudentT:
    """Student-t prior with `dof` degrees of freedom, truncated to `low` … `high`: normal with heavy tails."""

    centre: float
    scale: float
    dof: float
    low: float = -np.inf
    high: float = np.inf

    def __post_init__(self) -> None:
        _require_numbers("Student-t", self)
        if not (np.isfinite(self.centre) and 0 < self.scale < np.inf and 0 < self.dof < np.inf):
            raise InputError(
                "Student-t prior: expected a finite centre, scale > 0 and degrees of freedom > 0, got "
                f"{self.centre:g}, {self.scale:g}, {self.dof:g}"
            )
        if not self.low < self.high or self._mass < LEAST_PROBABILITY:
            raise InputError(f"Student-t prior: nothing of it lies between {self.low:g} and {self.high:g}")

    @property
    def support(self) -> tuple[float, float]:
        return self.low, self.high

    def _below(self, value: float) -> float:
        return float(stdtr(self.dof, (value - self.centre) / self.scale))

    @property
    def _mass(self) -> float:
        return self._below(self.high) - self._below(self.low)

    def log_density(self, value: ArrayLike) -> FloatArray:
        value = np.asarray(value, dtype=float)
        density = _log_student((value - self.centre) / self.scale, self.dof) - np.log(self.scale * self._mass)
        return np.where((value >= self.low) & (value <= self.high), density, -np.inf)

    def quantile(self, probability: ArrayLike) -> FloatArray:
        below = self._below(self.low) + np.asarray(probability, dtype=float) * self._mass
        return np.asarray(self.centre + self.scale * _student_quantile(self.dof, below))

    def __str__(self) -> str:
        ends = _within(self.low, self.high)
        return f"Student-t, {self.centre:g} ± {self.scale:g}, {self.dof:.3g} degrees of freedom{ends}"


@dataclass(frozen=True)
class LogStudentT:
    """Log-Student-t prior: the logarithm is Student-t with centre ``log(median)`` and scale `spread`."""

    median: float
    spread: float
    dof: float

    def __post_init__(self) -> None:
        _require_numbers("log-Student-t", self)
        if not (0 < self.median < np.inf and 0 < self.spread < np.inf and 0 < self.dof < np.inf):
            raise InputError(
                "log-Student-t prior: expected median, spread, degrees of freedom > 0, got "
                f"{self.median:g}, {self.spread:g}, {self.dof:g}"
            )

    @property
    def support(self) -> tuple[float, float]:
        return 0.0, np.inf

    def log_density(self, value: ArrayLike) -> FloatArray:
        value = np.asarray(value, dtype=float)
        safe = np.where(value > 0, value, 1.0)
        density = _log_student(np.log(safe / self.median) / self.spread, self.dof) - np.log(safe * self.spread)
        return np.where(value > 0, density, -np.inf)

    def quantile(self, probability: ArrayLike) -> FloatArray:
        t = _student_quantile(self.dof, np.asarray(probability, dtype=float))
        return np.asarray(self.median * np.exp(self.spread * t))

    def __str__(self) -> str:
        factor = np.exp(self.spread)
        return f"log-Student-t, median {self.median:g}, factor {factor:.3g}, {self.dof:.3g} degrees of freedom"


def _require_numbers(kind: str, prior: Uniform | Normal | LogNormal | StudentT | LogStudentT) -> None:
    """Raise `InputError` unless all values of a prior are numbers."""
    for each in fields(prior):
        number_array(f"{kind} prior: {each.name}", getattr(prior, each.name), 0)


def _within(low: float, high: float) -> str:
    """Text of the ends of a truncated prior; empty without ends."""
    if np.isinf(low) or np.isinf(high):
        return "" if np.isinf(low) and np.isinf(high) else f", above {low:g}" if np.isinf(high) else f", below {high:g}"
    return f", within {low:g} to {high:g}"


def _student_quantile(dof: float, probability: FloatArray) -> FloatArray:
    """Quantile of Student's t at probabilities (...); scipy says that the one at 0 is +inf."""
    return np.asarray(np.where(probability <= 0, -np.inf, stdtrit(dof, probability)))


def _log_student(t: FloatArray, dof: float) -> FloatArray:
    """Log density of Student's t, (...)."""
    constant = gammaln(0.5 * (dof + 1)) - gammaln(0.5 * dof) - 0.5 * np.log(dof * np.pi)
    return np.asarray(constant - 0.5 * (dof + 1) * np.log1p(t * t / dof))


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
        Short description. It says what the prior is of, if `relative`.
    relative : bool
        Whether the prior is of a difference from a nominal value, or in another unit than `unit`.
    """

    name: str
    symbol: str
    latex: str
    unit: str
    prior: Prior
    description: str = ""
    relative: bool = False

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
    if isinstance(prior, StudentT):
        whole = prior._mass
        if not inside[0] < inside[1] or (prior._below(inside[1]) - prior._below(inside[0])) / whole < LEAST_MASS:
            raise InputError(message)
        return StudentT(prior.centre, prior.scale, prior.dof, *inside)
    raise InputError(f"the prior ({prior}) reaches beyond {low:g} to {high:g}: give a normal, uniform or Student-t one")


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
