"""Effects that were added, with the standard deviations that the covariance of a fit gives them."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from bayestouch.effects.effect import EffectParameter
from bayestouch.model.added import AddedEffect, added_effects, moved_to
from bayestouch.model.noise_posterior import FoundNoise
from bayestouch.priors.parameters import LogNormal, Normal


def effect(name: str, *logarithmic: bool) -> Any:
    priors = [LogNormal(1.0, 1.0) if each else Normal(0.0, 1.0) for each in logarithmic]
    return SimpleNamespace(name=name, parameters=[EffectParameter("", "", "", each, (1.0,)) for each in priors])


FIRST, SECOND, DRIFT = effect("first", False), effect("second", True, False), effect("drift", False)
NOISE = FoundNoise(effect("noise", False), (5.0,), (0.5,), np.ones(1))


def fitted(*values: tuple[float, ...]) -> Any:
    """Two base parameters, then the effects; variances 1, 4, 9, 16, 25."""
    places = (slice(2, 3), slice(3, 5))
    model = SimpleNamespace(effects=(FIRST, SECOND), value_places=places, values=lambda vector: values)
    linear = SimpleNamespace(covariance=lambda: np.diag([1.0, 4.0, 9.0, 16.0, 25.0]))
    return SimpleNamespace(model=model, vector=None, linear=linear, drifts=((DRIFT, (0.1,)),))


def test_values_and_standard_deviations() -> None:
    """That of a logarithm is a share of the value; a drift's values are held."""
    first, second, drift, noise = added_effects(fitted((0.3,), (2.0, 7.0)), (NOISE,))
    assert (first.effect, first.values, first.sd) == (FIRST, (0.3,), (3.0,))
    assert (second.effect, second.values, second.sd) == (SECOND, (2.0, 7.0), (8.0, 5.0))
    assert drift.values == (0.1,) and np.isnan(drift.sd).all() and len(drift.sd) == 1
    assert added_effects(fitted((0.3,), (2.0, 7.0)), (), {"drift": (0.02,)})[2].sd == (0.02,)
    assert (noise.effect, noise.values, noise.sd) == (NOISE.effect, (5.0,), (0.5,))


def test_another_fit_moves_those_of_the_chain_alone() -> None:
    before = added_effects(fitted((0.3,), (2.0, 7.0)), (NOISE,))
    found = moved_to(fitted((0.4,), (1.0, 6.0)), before)
    assert [each.values for each in found] == [(0.4,), (1.0, 6.0), (0.1,), (5.0,)]
    assert found[1].sd == (4.0, 5.0) and found[2] is before[2] and found[3] is before[3]
    assert isinstance(found[0], AddedEffect)


def test_coordinate_of_a_value() -> None:
    """A logarithm has the relative sd; a value that is fixed has none."""
    each = AddedEffect(FIRST, (2.0, 3.0), (0.5, float("nan")))
    assert each.coordinate(0, logarithmic=False) == (2.0, 0.5)
    assert each.coordinate(0, logarithmic=True) == (np.log(2.0), 0.25)
    assert each.coordinate(1, logarithmic=True) == (np.log(3.0), 0.0)
