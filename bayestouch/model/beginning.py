"""Where a search for effects begins, or a fit with effects that are stated: the same for every body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from bayestouch.effects import Effect, Setting
from bayestouch.model.added import AddedEffect
from bayestouch.model.correction import Correction
from bayestouch.model.fitting import Fitted
from bayestouch.model.held_out import HeldOut
from bayestouch.model.touch_errors import Infer, TouchReading
from bayestouch.results.objects import Calibration


class Evaluation(Protocol):
    """What a body makes of a fit to its training touches."""

    def calibration(self, fitted: Fitted, added: tuple[AddedEffect, ...], correction: Correction | None) -> Calibration:
        """The fit as a posterior that `bayestouch.infer` uses."""
        ...

    def held_out(self, fitted: Fitted, correction: Correction | None, *, stated: bool = False) -> HeldOut | None:
        """Residuals of the held-out touches, or those at stated references; None where none could be held out."""
        ...

    def read(self, infer: Infer, calibration: Calibration, held: HeldOut) -> TouchReading:
        """The held-out touches read as unknown, by `infer`, and their errors."""
        ...


@dataclass(frozen=True, eq=False)
class Beginning:
    """A sensor fitted without effects, and what may be added to it.

    Attributes
    ----------
    fitted : Fitted
        The model without effects.
    setting : Setting
        How the sensor was touched: effects suit themselves to it.
    effects : tuple of Effect
        Effects of the catalogue that can occur, and that the model does not have already.
    evaluation : Evaluation
        Makes a calibration of a fit, and its errors on the held-out touches.
    corrects : bool
        Whether a correction can be added; not where the calibration's own map holds what goes with element and place.
    """

    fitted: Fitted
    setting: Setting
    effects: tuple[Effect, ...]
    evaluation: Evaluation
    corrects: bool = True
