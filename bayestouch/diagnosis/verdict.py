"""Whether the model is within the noise on held-out touches, and the verdict."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bayestouch.affected.fitting import Fitted
from bayestouch.diagnosis.held_out import HeldOut
from bayestouch.diagnosis.significance import lack_of_fit_tail

FloatArray = NDArray[np.float64]
Verdict = Literal["adequate", "explained", "partly explained", "unattributed"]

# A lack of fit is one where chance makes one as large less often than this ...
CHANCE = 0.01
# ... and where the mean square is beyond that of the noise by more than this share: thousands of readings show less
# than that, and less than that does no harm.
MATERIAL = 0.1


@dataclass(frozen=True)
class LackOfFit:
    """Test of the residuals of one model.

    Attributes
    ----------
    ratio : float
        Residual mean square over that of the noise, the model's own uncertainty allowed for.
    freedom, pure_freedom : float
        Readings behind the two mean squares. If nothing is missing, `ratio` is distributed as F with these.
    p_value : float
        Chance of a ratio as large if nothing is missing.
    held_out : bool
        Whether the touches were held out; else they are those of the fit.
    """

    ratio: float
    freedom: float
    pure_freedom: float
    p_value: float
    held_out: bool

    @property
    def excess(self) -> float:
        """What is beyond the noise, in units of it; zero where there is less."""
        return max(self.ratio - 1, 0.0)

    @property
    def there(self) -> bool:
        """Whether structure is left that matters."""
        return self.p_value < CHANCE and self.excess > MATERIAL


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
    if held is not None:
        ratio, freedom = held.predictive_lack_of_fit, float(held.present.sum())
    else:
        freedom = max(float(fitted.n_readings - fitted.model.n_base), 1.0)
        ratio = fitted.chi_square() / freedom
    return LackOfFit(ratio, freedom, pure, lack_of_fit_tail(ratio, freedom, pure), held is not None)


def _pure_freedom(fitted: Fitted) -> float:
    """Readings behind the noise: repeats, or without these the rows far from contact, about half of the readings."""
    freedom = float(np.nansum(fitted.model.known.means.pure_error_dof))
    return freedom if freedom > 0 else 0.5 * fitted.n_readings


def verdict(n_effects: int, remaining: Remaining) -> Verdict:
    """One of the four verdicts."""
    if remaining.after.there:
        return "partly explained" if n_effects else "unattributed"
    return "explained" if n_effects else "adequate"
