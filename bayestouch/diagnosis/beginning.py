"""Where a search for effects begins, or a fit with effects that are stated: the same for every body."""

from __future__ import annotations

from dataclasses import dataclass

from bayestouch.diagnosis.data import DiagnosisData
from bayestouch.diagnosis.follow import Evaluate
from bayestouch.effects import Effect, Setting
from bayestouch.model.fitting import Fitted


@dataclass(frozen=True, eq=False)
class Beginning:
    """A sensor fitted without effects, and what may be added to it.

    Attributes
    ----------
    data : DiagnosisData
        Touches that fits see, and those that are held out.
    fitted : Fitted
        The model without effects.
    setting : Setting
        How the sensor was touched: effects suit themselves to it.
    effects : tuple of Effect
        Effects of the catalogue that can occur, and that the model does not have already.
    evaluate : Evaluate
        Makes a calibration of a fit, and its errors on the held-out touches.
    """

    data: DiagnosisData
    fitted: Fitted
    setting: Setting
    effects: tuple[Effect, ...]
    evaluate: Evaluate
