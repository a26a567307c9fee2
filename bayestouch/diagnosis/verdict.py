"""Whether the model is within the noise on held-out touches, and the verdict."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.model.fitting import Fitted
from bayestouch.model.held_out import HeldOut
from bayestouch.model.significance import lack_of_fit_limits, lack_of_fit_tail

Verdict = Literal["adequate", "explained", "partly explained", "unattributed"]

# A lack of fit outside the limits that hold all but this share of those of a model that misses nothing is one ...
CHANCE = 0.01
# ... but the limits are no narrower than this: thousands of readings show less, and less than that does no harm. It is
# also the most that is allowed for drifts that are uncertain between touches: beyond that they predict nothing.
MATERIAL = 0.1


@dataclass(frozen=True)
class LackOfFit:
    """Test of the residuals of one model.

    Attributes
    ----------
    ratio : float
        Residual mean square over that of the noise: the lack of fit that is printed. NaN where loads that were not
        measured leave nothing to tell it by.
    expected : float
        Its mean if nothing is missing: one, and what the fit leaves open.
    freedom, pure_freedom : float
        If nothing is missing, ratio over `expected` is distributed as F with these, in good approximation.
    p_value : float
        Chance of a ratio as large if nothing is missing.
    low, high : float
        Limits that hold 99 % of the ratios if nothing is missing, no narrower than 0.9 to 1.1.
    held_out : bool
        Whether the touches were held out; else they are those of the fit.
    """

    ratio: float
    expected: float
    freedom: float
    pure_freedom: float
    p_value: float
    low: float
    high: float
    held_out: bool

    @classmethod
    def of(cls, ratio: float, expected: float, freedom: float, pure_freedom: float, *, held_out: bool) -> LackOfFit:
        """Limits and tail probability of a ratio."""
        tail, low, high = float("nan"), float("nan"), float("nan")
        if np.isfinite(ratio):
            tail = lack_of_fit_tail(ratio / expected, freedom, pure_freedom)
            low, high = lack_of_fit_limits(CHANCE, freedom, pure_freedom)
            low, high = min(low * expected, 1 - MATERIAL), max(high * expected, 1 + MATERIAL)
        return cls(ratio, expected, freedom, pure_freedom, tail, low, high, held_out)

    @property
    def excess(self) -> float:
        """What is beyond the noise, in units of it; zero where there is less."""
        return max(self.ratio - self.expected, 0.0) if np.isfinite(self.ratio) else 0.0

    @property
    def there(self) -> bool:
        """Whether structure is left that matters."""
        return self.ratio > self.high


@dataclass(frozen=True)
class Remaining:
    """What is left when effects have explained what they can.

    Attributes
    ----------
    before, after : LackOfFit
        Without effects and with them; a correction without a cause counts as neither.
    """

    before: LackOfFit
    after: LackOfFit

    @property
    def fraction(self) -> float:
        """Share of the excess over the noise that no effect explains; zero where there was none to begin with."""
        if not self.before.there and not self.after.there:
            return 0.0
        return min(self.after.excess / max(self.before.excess, 1e-12), 1.0)


def lack_of_fit(fitted: Fitted, held: HeldOut | None) -> LackOfFit:
    """Test a model on held-out touches, or on its own where none are held out."""
    pure = _pure_freedom(fitted)
    if held is None:
        freedom = max(float(fitted.n_readings - fitted.model.n_base), 1.0)
        return LackOfFit.of(fitted.chi_square() / freedom, 1.0, freedom, pure, held_out=False)
    expected, freedom = null_moments(held.design, max(held.freedom, 1.0))
    if fitted.drifts:
        expected = min(expected, 1 + MATERIAL)
    return LackOfFit.of(held.mean_square, expected, freedom, pure, held_out=True)


def null_moments(design: FloatArray, freedom: float) -> tuple[float, float]:
    """Mean of a mean square of residuals with covariance ``1 + A Aᵀ``, and freedom of the χ² with its variance.

    The sum of squares has mean ``n + |A|²`` and variance ``2 tr (1 + A Aᵀ)²``: a scaled χ² has both (Satterthwaite).

    Parameters
    ----------
    design : (n, q) array
        A, what the fit leaves open.
    freedom : float
        Readings behind the mean square.
    """
    inner = design.T @ design
    first = freedom + float(np.trace(inner))
    second = freedom + 2 * float(np.trace(inner)) + float((inner**2).sum())
    return first / freedom, first**2 / second


def _pure_freedom(fitted: Fitted) -> float:
    """Readings behind the noise: repeats, or without these the rows far from contact, about half of the readings."""
    freedom = float(np.nansum(fitted.model.known.means.pure_error_dof))
    return freedom if freedom > 0 else 0.5 * fitted.n_readings


def verdict(n_effects: int, remaining: Remaining) -> Verdict:
    """One of the four verdicts."""
    if remaining.after.there:
        return "partly explained" if n_effects else "unattributed"
    return "explained" if n_effects else "adequate"
