"""A fitted model with its calibration and its errors on the held-out touches."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from bayestouch.diagnosis.traced import EvaluatedModel
from bayestouch.inference import infer_with
from bayestouch.model.added import AddedEffect
from bayestouch.model.as_stated import at_stated_references
from bayestouch.model.beginning import Evaluation
from bayestouch.model.correction import Correction
from bayestouch.model.fitting import Fitted
from bayestouch.model.held_out import HeldOut
from bayestouch.model.touch_errors import TouchReading
from bayestouch.output.progress import Progress
from bayestouch.parallel.beside import both
from bayestouch.results.objects import Calibration

#: Calibration of a model, and the held-out touches that were read with it.
Posteriors = tuple[Calibration, TouchReading | None]


@dataclass(frozen=True, eq=False)
class ToEvaluate:
    """A fitted model whose errors are asked for.

    Attributes
    ----------
    evaluation : Evaluation
        Computes calibrations and errors.
    sample : bool
        Whether the held-out touches are read as unknown touches.
    fitted : Fitted
        The model.
    added : tuple of AddedEffect
        Its effects.
    correction : Correction or None
        Its correction.
    """

    evaluation: Evaluation
    sample: bool
    fitted: Fitted
    added: tuple[AddedEffect, ...] = ()
    correction: Correction | None = None

    @cached_property
    def held_out(self) -> HeldOut | None:
        """Residuals of the held-out touches; None if no touch is held out."""
        return self.evaluation.held_out(self.fitted, self.correction)

    def posteriors(self, progress: Progress | None = None) -> Posteriors:
        """What takes nearly all the time; it shows no progress."""
        calibration = self.evaluation.calibration(self.fitted, self.added, self.correction)
        held = self.held_out if self.sample else None
        return calibration, None if held is None else self.evaluation.read(infer_with, calibration, held)

    def with_posteriors(self, found: Posteriors) -> EvaluatedModel:
        """The evaluated model, from its `posteriors`."""
        held = self.held_out
        # If no effect changes a reference, the stated references give the same result.
        unmoved = at_stated_references(self.fitted) is self.fitted
        stated = held if unmoved else self.evaluation.held_out(self.fitted, self.correction, stated=True)
        return EvaluatedModel(self.fitted, self.correction, found[0], held, stated, found[1])

    def evaluated(self) -> EvaluatedModel:
        """The model with its calibration and its errors."""
        return self.with_posteriors(self.posteriors())


def both_evaluated(
    one: ToEvaluate | None, two: ToEvaluate | None
) -> tuple[EvaluatedModel | None, EvaluatedModel | None]:
    """Two models with their calibrations and their errors, at the same time; None for a model that is None."""
    if one is None or two is None:
        return one if one is None else one.evaluated(), two if two is None else two.evaluated()
    first, second = both(one.posteriors, two.posteriors)
    return one.with_posteriors(first), two.with_posteriors(second)
