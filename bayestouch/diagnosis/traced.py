"""Results of the search of a diagnosis, from which verdict, numbers, figures and files are made."""

from __future__ import annotations

from dataclasses import dataclass

from bayestouch.diagnosis.measure import Advice
from bayestouch.diagnosis.rounds import SearchRound
from bayestouch.diagnosis.verdict import LackOfFit, Remaining, lack_of_fit
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


@dataclass(frozen=True)
class Worse:
    """A quantity that a model reads worse than one with fewer effects does.

    Attributes
    ----------
    key : str
        Key of the error in ``diagnosis.json``, or ``log_density``: log predictive density of readings.
    before, after : float
        Root mean square without and with what was found, or mean log density of a touch.
    touches : str
        Of which touches: "with other tips" than edges; empty for all.
    """

    key: str
    before: float
    after: float
    touches: str = ""


@dataclass(frozen=True, eq=False)
class Refused:
    """A model that is not returned.

    Attributes
    ----------
    model : EvaluatedModel
        The model.
    worse : tuple of Worse
        The quantities that it reads worse than the model without effects, or than the one that is returned; not empty.
    believed : bool
        Whether errors are against references as the model corrects them; else as the data set states them.
    """

    model: EvaluatedModel
    worse: tuple[Worse, ...]
    believed: bool


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
    uncorrected, corrected : EvaluatedModel
        A model without and with a correction, if structure without a known cause remains; `corrected` is None if there
        is no correction. They are those of the model that is returned if it has one, else those with all effects.
    remaining : Remaining
        Misfit that the effects do not explain.
    after : EvaluatedModel
        Best model that reads no quantity worse than the model without effects; see `bayestouch.diagnosis.stages`.
    refused : tuple of Refused
        Models with more effects that are not returned, because they read a quantity worse.
    advice : Advice or None
        Advice on what to measure if two effects are indistinguishable.
    """

    data: SplitData
    rounds: tuple[SearchRound, ...]
    steps: tuple[HeldOut, ...]
    added: tuple[AddedEffect, ...]
    before: EvaluatedModel
    explained: EvaluatedModel
    uncorrected: EvaluatedModel
    corrected: EvaluatedModel | None
    remaining: Remaining
    after: EvaluatedModel
    refused: tuple[Refused, ...] = ()
    advice: Advice | None = None

    @property
    def tested(self) -> EvaluatedModel:
        """The model that is returned, without its correction."""
        return self.uncorrected if self.after is self.corrected else self.after

    @property
    def returned(self) -> LackOfFit:
        """Test of the model that is returned, without its correction."""
        return lack_of_fit(self.tested.fitted, self.tested.held_out)
