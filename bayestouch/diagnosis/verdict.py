"""Test whether the model is within the noise on held-out touches, and the verdict."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.model.fitting import Fitted
from bayestouch.model.held_out import HeldOut
from bayestouch.model.significance import lack_of_fit_limits, lack_of_fit_tail

Verdict = Literal["adequate", "explained", "partly explained", "unattributed"]

# Share of ratios outside the limits if nothing is missing from the model.
CHANCE = 0.01
# Most that the uncertainty of drifts between touches may add to the expected ratio. It belongs there: held-out touches
# are made at other times than those of the fit, and even the right drift is not known there. A drift that adds more
# explains the touches of the fit and hardly predicts the held-out ones, so that it would excuse any misfit.
MOST_OF_DRIFTS = 0.1


@dataclass(frozen=True)
class LackOfFit:
    """Test of the residuals of a model.

    Attributes
    ----------
    ratio : float
        Residual mean square divided by that of the noise: the lack of fit that is printed. NaN if no load was measured
        and the readings leave no information on it.
    expected : float
        Mean of the ratio if nothing is missing: one plus the effect of the fit's uncertainty.
    freedom, pure_freedom : float
        Degrees of freedom. If nothing is missing, ratio divided by `expected` approximately follows an F distribution
        with these.
    p_value : float
        Probability of a ratio at least this large if nothing is missing.
    low, high : float
        Limits of 99 % of the ratios if nothing is missing.
    held_out : bool
        True if the touches were held out; False if they are those of the fit.
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
        """Test of a ratio, with its limits and tail probability."""
        tail, low, high = float("nan"), float("nan"), float("nan")
        if np.isfinite(ratio):
            tail = lack_of_fit_tail(ratio / expected, freedom, pure_freedom)
            low, high = lack_of_fit_limits(CHANCE, freedom, pure_freedom)
            low, high = low * expected, high * expected
        return cls(ratio, expected, freedom, pure_freedom, tail, low, high, held_out)

    @property
    def excess(self) -> float:
        """Excess of the ratio over its expectation, in units of the noise; zero if it is negative."""
        return max(self.ratio - self.expected, 0.0) if np.isfinite(self.ratio) else 0.0

    @property
    def there(self) -> bool:
        """True if structure remains in the residuals."""
        return self.ratio > self.high


@dataclass(frozen=True)
class Remaining:
    """Misfit before effects are added, and misfit that remains after.

    Attributes
    ----------
    before, after : LackOfFit
        Tests of the models without and with effects, both without a correction.
    """

    before: LackOfFit
    after: LackOfFit

    @property
    def fraction(self) -> float:
        """Share of the excess over the noise that no effect explains; zero if there was no excess."""
        if not self.before.there and not self.after.there:
            return 0.0
        return min(self.after.excess / max(self.before.excess, 1e-12), 1.0)


def lack_of_fit(fitted: Fitted, held: HeldOut | None) -> LackOfFit:
    """Test of a model on held-out touches.

    It is made on the touches of the fit if none are held out. So it is if the unmeasured loads of those held out leave
    no information and some loads of the fit were measured: a model that was not tested must not count as right.
    """
    pure = _pure_freedom(fitted)
    if held is None or (np.isnan(held.mean_square) and np.isfinite(fitted.model.known.load).any()):
        freedom = max(float(fitted.n_readings - fitted.model.n_base), 1.0)
        return LackOfFit.of(fitted.chi_square() / freedom, 1.0, freedom, pure, held_out=False)
    freedom, design = max(held.freedom, 1.0), held.design
    if fitted.drifts:
        added = float((design**2).sum()) / freedom
        design = design * np.sqrt(min(1.0, MOST_OF_DRIFTS / max(added, 1e-300)))
    expected, freedom = null_moments(design, freedom)
    return LackOfFit.of(held.mean_square, expected, freedom, pure, held_out=True)


def null_moments(design: FloatArray, freedom: float) -> tuple[float, float]:
    """Mean of a mean square of residuals with covariance ``1 + A Aᵀ``, and degrees of freedom of the χ² that fits it.

    The sum of squares has mean ``n + |A|²`` and variance ``2 tr (1 + A Aᵀ)²``: a scaled χ² has both (Satterthwaite).

    Parameters
    ----------
    design : (n, q) array
        A: uncertainty that the fit leaves in the predictions.
    freedom : float
        Number of readings in the mean square.
    """
    inner = design.T @ design
    first = freedom + float(np.trace(inner))
    second = freedom + 2 * float(np.trace(inner)) + float((inner**2).sum())
    return first / freedom, first**2 / second


def _pure_freedom(fitted: Fitted) -> float:
    """Number of readings that give the noise: repeats, or else rows far from contact, about half of the readings."""
    freedom = float(np.nansum(fitted.model.known.means.pure_error_dof))
    return freedom if freedom > 0 else 0.5 * fitted.n_readings


def structure_left(verdict: str) -> bool:
    """Whether a verdict says that structure is left which no effect explains."""
    return verdict in ("partly explained", "unattributed")


def verdict(n_effects: int, remaining: Remaining, returned: LackOfFit) -> Verdict:
    """Verdict from the number of effects, the remaining misfit, and the test of the model that is returned."""
    if remaining.after.there or returned.there:
        return "partly explained" if n_effects else "unattributed"
    return "explained" if n_effects else "adequate"
