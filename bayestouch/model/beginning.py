"""Start of a search for effects, or of a fit with stated effects: the same for every body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from bayestouch.effects import Effect, Setting
from bayestouch.model.added import AddedEffect
from bayestouch.model.correction import Correction
from bayestouch.model.fitting import Fitted
from bayestouch.model.held_out import HeldOut
from bayestouch.model.log_density import LogDensity
from bayestouch.model.touch_errors import Infer, TouchReading
from bayestouch.results.objects import Calibration


class Evaluation(Protocol):
    """Results that a body computes from a fit to its training touches."""

    def calibration(self, fitted: Fitted, added: tuple[AddedEffect, ...], correction: Correction | None) -> Calibration:
        """Posterior of the fit, for `bayestouch.infer`."""
        ...

    def uses_correction(self, calibration: Calibration) -> bool:
        """Whether a calibration of a fit with a correction reads touches with it."""
        ...

    def held_out(self, fitted: Fitted, correction: Correction | None, *, stated: bool = False) -> HeldOut | None:
        """Residuals of the held-out touches (at stated references if `stated`); None if no touch is held out."""
        ...

    def read(self, infer: Infer, calibration: Calibration, held: HeldOut) -> TouchReading:
        """Posteriors of the held-out touches, read by `infer` as unknown touches, and their errors."""
        ...

    def log_density(self, fitted: Fitted, added: tuple[AddedEffect, ...], correction: Correction | None) -> LogDensity:
        """Posterior density of the fit as a function."""
        ...


@dataclass(frozen=True, eq=False)
class Beginning:
    """A sensor fitted without effects, and the effects that may be added.

    Attributes
    ----------
    fitted : Fitted
        The model without effects.
    setting : Setting
        Properties of the sensor and of its touches, from which effects choose their priors and probes.
    effects : tuple of Effect
        Effects of the catalogue that can occur and that are not part of the model already.
    evaluation : Evaluation
        Computes the calibration of a fit, and its errors on the held-out touches.
    no_correction : str
        Why no correction can be added, in words that complete "no correction is added:"; empty if one can.
    """

    fitted: Fitted
    setting: Setting
    effects: tuple[Effect, ...]
    evaluation: Evaluation
    no_correction: str = ""
