"""The catalogue of effects: each effect is a class for one property of real sensors that the base model leaves out."""

from __future__ import annotations

from bayestouch.effects.catalogue import catalogue, effect_classes
from bayestouch.effects.effect import Effect, EffectParameter, Setting, Stage, Values, own_parameters, places_of_values
from bayestouch.effects.noise import NoiseEffect
from bayestouch.effects.random import RandomEffect
from bayestouch.effects.stated import StatedModel, read_model

__all__ = [
    "Effect",
    "EffectParameter",
    "NoiseEffect",
    "RandomEffect",
    "Setting",
    "Stage",
    "StatedModel",
    "Values",
    "catalogue",
    "effect_classes",
    "own_parameters",
    "places_of_values",
    "read_model",
]
