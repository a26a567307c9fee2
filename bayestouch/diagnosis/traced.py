"""Results of the search of a diagnosis, from which verdict, numbers, figures and files are made."""

from __future__ import annotations

from dataclasses import dataclass

from bayestouch.diagnosis.measure import Advice
from bayestouch.diagnosis.rounds import SearchRound
from bayestouch.diagnosis.verdict import Remaining
from bayestouch.model.added import AddedEffect
from bayestouch.model.correction import Correction
from bayestouch.model.fitting import Fitted
from bayestouch.model.held_out import HeldOut
from bayestouch.model.split_data import SplitData
from bayestouch.model.touch_errors import TouchReading
from bayestouch.output.summary import Summarised
from bayestouch.results.objects import Calibration


@dataclass(frozen=True, eq=False, repr=False)
class EvaluatedModel(Summarised):
    """A model of the sensor with its calibration and its errors.

    Attributes
    ----------
    fitted : Fitted
        The model, fitted to the training touches.
    correction : Correction or None
        Correction without a cause that was fitted with the model.
    calibration : Calibration
        The model as a calibration that `infer` can use.
    held_out, held_stated : HeldOut or None
        Residuals of the held-out touches, at the references that the model corrects and at those that the data set
        states (see `bayestouch.model.as_stated`); None if no touches could be held out.
    read : TouchReading or None
        Estimates of the held-out touches inferred as unknown; None if they were not inferred.
    """

    fitted: Fitted
    correction: Correction | None
    calibration: Calibration
    held_out: HeldOut | None
    held_stated: HeldOut | None
    read: TouchReading | None


@dataclass(frozen=True, eq=False, repr=False)
class Traced(Summarised):
    """Result of a search for the causes of a residual.

    Attributes
    ----------
    data : SplitData
        Touches, split into training and held-out touches.
    rounds : tuple of SearchRound
        Rounds of the search.
    steps : tuple of HeldOut
        Held-out residuals at the beginning of each round; empty if no touches could be held out.
    added : tuple of AddedEffect
        Effects with their values, in the order in which they were added.
    before, explained : EvaluatedModel
        Models without effects, and with those that were found; the same object if none was found.
    corrected : EvaluatedModel or None
        Model with a correction in addition, if structure without a known cause remains.
    remaining : Remaining
        Misfit that the effects do not explain.
    advice : Advice or None
        Advice on what to measure if two effects are indistinguishable.
    """

    data: SplitData
    rounds: tuple[SearchRound, ...]
    steps: tuple[HeldOut, ...]
    added: tuple[AddedEffect, ...]
    before: EvaluatedModel
    explained: EvaluatedModel
    corrected: EvaluatedModel | None
    remaining: Remaining
    advice: Advice | None = None

    @property
    def after(self) -> EvaluatedModel:
        """Best model: with the correction if there is one."""
        return self.corrected or self.explained
