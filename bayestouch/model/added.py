"""Effects that were added to a model, with their posterior."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.effects import Effect, NoiseEffect, Values
from bayestouch.model.fitting import Fitted


@dataclass(frozen=True, eq=False)
class AddedEffect:
    """An effect with its posterior.

    Attributes
    ----------
    effect : Effect
        The effect.
    values, sd : tuple of float
        Most probable values, and standard deviations; NaN where a value is held.
    """

    effect: Effect
    values: Values
    sd: Values

    def draws(self, which: int, normal: FloatArray) -> FloatArray:
        """Draws of one of its values, from standard normal numbers of any shape; a NaN sd counts as zero."""
        return self.effect.drawn(which, self.values[which], float(np.nan_to_num(self.sd[which])), normal)


def added_effects(fitted: Fitted, noise_effects: tuple[tuple[NoiseEffect, Values, Values], ...]) -> list[AddedEffect]:
    """Effects of a fit: those of the chain, the drifts, those of the noise (effect, values, sd)."""
    model, covariance = fitted.model, fitted.linear.covariance()
    out, place = [], model.n_base
    for effect, values in zip(model.effects, model.values(fitted.vector), strict=True):
        rows = np.arange(place, place + len(values))
        spread = np.sqrt(np.diag(covariance)[rows])
        # The sd of a logarithm is a share of the value.
        sd = [s * v if p.logarithmic else s for s, v, p in zip(spread, values, effect.parameters, strict=True)]
        out.append(AddedEffect(effect, values, tuple(map(float, sd))))
        place += len(values)
    for drift, values in fitted.drifts:
        out.append(AddedEffect(drift, values, tuple(float("nan") for _ in values)))
    return out + [AddedEffect(*each) for each in noise_effects]


def moved_to(fitted: Fitted, added: Sequence[AddedEffect]) -> tuple[AddedEffect, ...]:
    """The same effects with the values that another fit gives those of the chain: a correction takes part of them."""
    found = {each.effect.name: each for each in added_effects(fitted, ()) if each.effect in fitted.model.effects}
    return tuple(found.get(each.effect.name, each) for each in added)
