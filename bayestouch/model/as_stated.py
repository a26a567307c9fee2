"""Predictions at the references that the data set states, without the effects that change references."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from bayestouch.effects import Effect
from bayestouch.model.base import without_effects
from bayestouch.model.fitting import Fitted


def moves_reference(effect: Effect, stages: Sequence[str]) -> bool:
    """Whether an effect changes a reference (indenter radius, location or load) stated in the data set.

    `stages` are those of `bayestouch.model.base.SensorModel.reference_stages`.
    """
    return effect.changes_pose and effect.stage in stages


def at_stated_references(fitted: Fitted) -> Fitted:
    """The fitted model without the effects that change references; all other values are those of the fit.

    The model is not fitted again. It predicts touches whose stated references are right. If no effect changes a
    reference, the same object is returned.
    """
    model = fitted.model
    moving = {effect.name for effect in model.effects if moves_reference(effect, model.reference_stages)}
    if not moving:
        return fitted
    less, vector = without_effects(model, fitted.vector, moving)
    return replace(fitted, model=less, vector=vector)
