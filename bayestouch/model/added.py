"""Effects that were added to a model, with their posterior."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.effects import Effect, Values
from bayestouch.model.fitting import Fitted
from bayestouch.model.noise_posterior import FoundNoise


@dataclass(frozen=True, eq=False)
class AddedEffect:
    """An effect with its posterior.

    Attributes
    ----------
    effect : Effect
        The effect.
    values, sd : tuple of float
        Most probable values, and their standard deviations; NaN for a value that is fixed.
    """

    effect: Effect
    values: Values
    sd: Values

    def draws(self, which: int, normal: FloatArray) -> FloatArray:
        """Draws of the value with index `which`, from standard normal numbers of any shape; a NaN sd counts as 0."""
        return self.effect.drawn(which, self.values[which], float(np.nan_to_num(self.sd[which])), normal)

    def coordinate(self, which: int, *, logarithmic: bool) -> tuple[float, float]:
        """The value with index `which`, or its logarithm, and the standard deviation; a NaN sd counts as 0."""
        value, spread = self.values[which], float(np.nan_to_num(self.sd[which]))
        return (float(np.log(value)), spread / value) if logarithmic else (value, spread)


def added_effects(
    fitted: Fitted, noise: Sequence[FoundNoise] = (), of_drifts: Mapping[str, Values] = MappingProxyType({})
) -> list[AddedEffect]:
    """Effects of a fit with values and sd: effects of the chain, then drifts, then those of the noise.

    Parameters
    ----------
    fitted : Fitted
        The fit.
    noise : sequence of FoundNoise
        Effects of the noise.
    of_drifts : mapping
        Standard deviations of the values of drifts, by name; NaN without.
    """
    model, covariance = fitted.model, fitted.linear.covariance()
    sd_of_all, out = np.sqrt(np.diag(covariance)), []
    for effect, values, place in zip(model.effects, model.values(fitted.vector), model.value_places, strict=True):
        spread = sd_of_all[place]
        # The sd of a logarithm times the value is the sd of the value.
        sd = [s * v if p.logarithmic else s for s, v, p in zip(spread, values, effect.parameters, strict=True)]
        out.append(AddedEffect(effect, values, tuple(map(float, sd))))
    for drift, values in fitted.drifts:
        out.append(AddedEffect(drift, values, of_drifts.get(drift.name, (float("nan"),) * len(values))))
    return out + [AddedEffect(each.effect, each.values, each.sd) for each in noise]


def moved_to(fitted: Fitted, added: Sequence[AddedEffect]) -> tuple[AddedEffect, ...]:
    """The effects `added`, with the values of the chain's effects replaced by those of another fit, `fitted`."""
    found = {each.effect.name: each for each in added_effects(fitted) if each.effect in fitted.model.effects}
    return tuple(found.get(each.effect.name, each) for each in added)
