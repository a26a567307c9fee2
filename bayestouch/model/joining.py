"""Fits with one more effect or one effect less, by kind of effect."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import singledispatch

from bayestouch.effects import Effect, NoiseEffect, RandomEffect, Values
from bayestouch.errors import InputError
from bayestouch.model.base import without_effects
from bayestouch.model.candidates import refine_drift
from bayestouch.model.fitting import SETTLED, Fitted, fit, fit_from_both
from bayestouch.model.noise_posterior import FoundNoise
from bayestouch.model.noise_search import score_noise
from bayestouch.model.noise_together import join_noise
from bayestouch.model.whitening import Whitening


@dataclass(frozen=True, eq=False)
class Joined:
    """A model with one more effect.

    Attributes
    ----------
    fitted : Fitted
        The model.
    values : tuple of float
        Values of the effect.
    noise : tuple of FoundNoise
        Posteriors of all noise effects of the model, if one was added: they change together. Empty for other effects.
    """

    fitted: Fitted
    values: Values
    noise: tuple[FoundNoise, ...] = ()


@singledispatch
def fit_with(
    effect: Effect,
    fitted: Fitted,
    start: Callable[[], Values],
    *,
    whitening: Whitening | None = None,
    enough: float = SETTLED,
) -> Joined:
    """The model fitted again with one more effect.

    Parameters
    ----------
    effect : Effect
        The effect to add; its class determines the method.
    fitted : Fitted
        The model without it.
    start : callable
        Returns the starting values of an effect of the chain. For drifts and noise effects they are searched.
    whitening, enough
        As in `bayestouch.model.fitting.fit`, for effects of the chain and drifts.

    Raises
    ------
    InputError
        A noise effect cannot be observed, because no touch was read twice, or never with another reading.
    """
    model = fitted.model.with_effects((*fitted.model.effects, effect))
    vector = model.extended(fitted.vector, start())
    new = fit_from_both(model, vector, fitted.noise, fitted.drifts, whitening=whitening, enough=enough)
    return Joined(new, model.values(new.vector)[-1])


@fit_with.register
def _(
    effect: RandomEffect,
    fitted: Fitted,
    start: Callable[[], Values],
    *,
    whitening: Whitening | None = None,
    enough: float = SETTLED,
) -> Joined:
    values = refine_drift(fitted, effect)
    drifts = (*fitted.drifts, (effect, values))
    return Joined(fit(fitted.model, fitted.vector, fitted.noise, drifts, whitening=whitening, enough=enough), values)


@fit_with.register
def _(
    effect: NoiseEffect,
    fitted: Fitted,
    start: Callable[[], Values],
    *,
    whitening: Whitening | None = None,
    enough: float = SETTLED,
) -> Joined:
    scored = score_noise(fitted, (effect,))
    if not scored:
        raise InputError(f"{effect.name} can be observed only in repeats that differ, and there are none")
    new, found = join_noise(fitted, scored[0])
    (values,) = (each.values for each in found if each.effect.name == effect.name)
    return Joined(new, values, found)


@singledispatch
def fit_without(effect: Effect, fitted: Fitted) -> Fitted:
    """The model fitted again without one effect of its chain or one drift, with the same whitening."""
    less, vector = without_effects(fitted.model, fitted.vector, {effect.name})
    return fit_from_both(less, vector, fitted.noise, fitted.drifts, whitening=fitted.whitening)


@fit_without.register
def _(effect: RandomEffect, fitted: Fitted) -> Fitted:
    drifts = tuple(pair for pair in fitted.drifts if pair[0].name != effect.name)
    return fit(fitted.model, fitted.vector, fitted.noise, drifts, whitening=fitted.whitening)
