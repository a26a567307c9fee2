"""What a diagnosis of one body hands on to verdict, numbers, pictures and files."""

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
    """One model of the sensor with its calibration and its errors.

    Attributes
    ----------
    fitted : Fitted
        The model, fitted to the training touches.
    correction : Correction or None
        Correction without a cause that was fitted with it.
    calibration : Calibration
        The same as a posterior that `infer` uses.
    held_out, held_stated : HeldOut or None
        Residuals of the held-out touches, and those at the references that the data set states (see
        `bayestouch.model.as_stated`); None where none could be held out.
    read : TouchReading or None
        The held-out touches read as unknown; None where they were not.
    """

    fitted: Fitted
    correction: Correction | None
    calibration: Calibration
    held_out: HeldOut | None
    held_stated: HeldOut | None
    read: TouchReading | None


@dataclass(frozen=True, eq=False, repr=False)
class Traced(Summarised):
    """A traced residual.

    Attributes
    ----------
    data : SplitData
        Touches, parted.
    rounds : tuple of SearchRound
        Rounds of the search.
    steps : tuple of HeldOut
        Held-out residuals at the beginning of each round; empty where none could be held out.
    added : tuple of AddedEffect
        Effects with their values, in the order in which they were added.
    before, explained : EvaluatedModel
        Without effects, and with those that were found; the same object where none was.
    corrected : EvaluatedModel or None
        With a correction on top, where structure remains that has no cause.
    remaining : Remaining
        What the effects leave unexplained.
    advice : Advice or None
        What to measure, where two effects cannot be distinguished.
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
        """The best there is: with the correction where there is one."""
        return self.corrected or self.explained
