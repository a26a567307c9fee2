"""Selection of effects by kind: effects of the chain, random functions of time, noise effects.

Fits and files treat the three kinds differently. A function that differs between the kinds is a
`functools.singledispatch` on the class of the effect, for example in `bayestouch.model.joining`.
"""

from __future__ import annotations

from collections.abc import Iterable

from bayestouch.effects.effect import Effect
from bayestouch.effects.noise import NoiseEffect
from bayestouch.effects.random import RandomEffect


def of_chain(effects: Iterable[Effect]) -> tuple[Effect, ...]:
    """Effects whose values are parameters of the chain: neither drifts nor noise effects."""
    return tuple(each for each in effects if not isinstance(each, RandomEffect | NoiseEffect))


def of_time(effects: Iterable[Effect]) -> tuple[RandomEffect, ...]:
    """Random functions of time."""
    return tuple(each for each in effects if isinstance(each, RandomEffect))


def of_noise(effects: Iterable[Effect]) -> tuple[NoiseEffect, ...]:
    """Noise effects."""
    return tuple(each for each in effects if isinstance(each, NoiseEffect))
