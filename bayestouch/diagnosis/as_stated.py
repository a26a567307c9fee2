"""A model as it predicts touches at their references as the data set states them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayestouch.effects import Effect
from bayestouch.model.fitting import Fitted
from bayestouch.pad.model import PadModel


def moves_reference(effect: Effect, *, pad: bool) -> bool:
    """Whether an effect says that a reference is not what the data set states: a tip, a location, or a load.

    On a finger every effect of the pose does. On a pad what lies between force sensor and elements (the threshold of
    `load_nonlinearity`) belongs to the response to a load as it is stated; only effects of the rig move references.
    """
    return type(effect).pose is not Effect.pose and (not pad or effect.stage == "rig")


def at_stated_references(fitted: Fitted) -> Fitted:
    """The fitted model without the effects that move references; all other values stay as they were fitted.

    It is not fitted anew: the question is what the model with the effects says of touches whose references are right.
    The same object where no effect moves a reference.
    """
    model = fitted.model
    pad = isinstance(model, PadModel)
    kept = [not moves_reference(effect, pad=pad) for effect in model.effects]
    if all(kept):
        return fitted
    counts = [model.n_base, *(len(effect.parameters) for effect in model.effects)]
    effects = tuple(effect for effect, keep in zip(model.effects, kept, strict=True) if keep)
    vector = fitted.vector[np.repeat([True, *kept], counts)]
    return replace(fitted, model=model.with_effects(effects), vector=vector)
