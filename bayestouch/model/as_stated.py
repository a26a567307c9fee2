"""A model as it predicts touches at their references as the data set states them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bayestouch.effects import Effect
from bayestouch.model.fitting import Fitted


def moves_reference(effect: Effect, stages: Sequence[str]) -> bool:
    """Whether an effect says that a reference is not what the data set states: a tip, a location, or a load.

    `stages` are those of `bayestouch.model.base.SensorModel.reference_stages`.
    """
    return effect.changes_pose and effect.stage in stages


def at_stated_references(fitted: Fitted) -> Fitted:
    """The fitted model without the effects that move references; all other values stay as they were fitted.

    It is not fitted anew: the question is what the model with the effects says of touches whose references are right.
    The same object where no effect moves a reference.
    """
    model = fitted.model
    kept = [not moves_reference(effect, model.reference_stages) for effect in model.effects]
    if all(kept):
        return fitted
    counts = [model.n_base, *(len(effect.parameters) for effect in model.effects)]
    effects = tuple(effect for effect, keep in zip(model.effects, kept, strict=True) if keep)
    vector = fitted.vector[np.repeat([True, *kept], counts)]
    return replace(fitted, model=model.with_effects(effects), vector=vector)
