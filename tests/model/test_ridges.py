"""Which values of effects a ridge is followed along: also of effects that the package does not know."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayestouch.array_types import FloatArray
from bayestouch.effects.effect import EffectParameter, own_parameters
from bayestouch.model.ridges import ridges_of
from bayestouch.priors.parameters import LogNormal, Normal, Prior, Uniform

SHARE = EffectParameter("share", "", "", Normal(0.0, 0.2), (0.1,), 0.0)
TIME = EffectParameter("time", "s", "", LogNormal(1.0, 1.0), (1.0,))
WIDTH = EffectParameter("width", "mm", "", LogNormal(1.0, 0.5), (1.0,))
LEAN = EffectParameter("lean", "", "", Uniform(0, 1), (0.5,))


def effect(*parameters: EffectParameter) -> Any:
    amplitudes = tuple(i for i, each in enumerate(parameters) if each.null is not None)
    return SimpleNamespace(parameters=parameters, amplitudes=amplitudes)


def amplitude(prior: Prior) -> EffectParameter:
    return EffectParameter("share", "", "", prior, (0.1,), 0.0)


def found(effects: list[Any], sd: list[float], with_bounds: bool = True) -> list[tuple[int, list[int]]]:
    """Free and scaled entries of the ridges of a normal posterior; two entries come before those of the effects."""
    d, priors = 2 + len(sd), [each.normal_prior for one in effects for each in one.parameters]
    low, high = (np.array([edge, edge, *(p[i] for p in priors)]) for i, edge in ((2, -np.inf), (3, np.inf)))
    covariance = np.diag(np.array([0.1, 0.1, *sd]) ** 2)
    precision = np.linalg.inv(covariance)

    def linearise(vector: FloatArray) -> tuple[FloatArray, FloatArray]:
        return -precision @ vector, precision

    bounds = low, high
    ridges = ridges_of(effects, 2, np.arange(2), linearise, np.zeros(d), covariance, bounds, with_bounds=with_bounds)
    return [(each.free, each.standard.tolist()) for each in ridges.each]


@pytest.mark.parametrize(
    ("effects", "sd", "expected"),
    [
        # Only one amplitude, and no shape; an amplitude with bounds; a shape value whose prior is not log-normal.
        ([effect(SHARE)], [0.1], []),
        ([effect(amplitude(Normal(0.0, 1.0, 0.0)), TIME)], [0.1, 0.5], []),
        ([effect(SHARE, EffectParameter("tails", "", "", Normal(0.0, 0.5), (0.0,)))], [0.1, 0.3], []),
        ([effect(SHARE, TIME)], [0.1, 0.5], [(3, [2])]),
        # Of two shape values, the one that the data determine least is free; one with bounds never is.
        ([effect(SHARE, TIME, WIDTH)], [0.1, 0.5, 0.4], [(4, [2, 3])]),
        ([effect(SHARE, TIME, LEAN)], [0.1, 0.5, 0.2], [(3, [2, 4])]),
        # One ridge for each effect.
        ([effect(SHARE), effect(SHARE, TIME), effect(WIDTH, SHARE)], [0.1] * 5, [(4, [3]), (5, [6])]),
    ],
)
def test_free_and_scaled_entries(effects: list[Any], sd: list[float], expected: list[tuple[int, list[int]]]) -> None:
    assert found(effects, sd) == expected


def test_values_with_bounds_do_not_follow_where_bounds_must_be_constant() -> None:
    assert found([effect(SHARE, TIME, LEAN)], [0.1, 0.5, 0.2], with_bounds=False) == [(3, [2])]


def products(vector: list[float], own_sd: float, given: float, *, null: float = 0.0) -> list[tuple[int, list[int]]]:
    """Ridges of a share, a time and two excesses; `given` is the sd of the share where the excesses are known."""
    share = EffectParameter("share", "", "", Normal(0.0, 0.1), (0.1,), null)
    one = effect(share, TIME, *own_parameters(2, "excess", 0.5))
    # the share is higher where the excesses are lower
    slope = np.array([-0.1, 0.0, 1.0, 1.0])
    covariance = own_sd**2 * np.outer(slope, slope) + np.diag([given**2, 0.01, 1e-8, 1e-8])
    precision, free = np.linalg.inv(covariance), np.full(4, np.inf)

    def linearise(at: FloatArray) -> tuple[FloatArray, FloatArray]:
        return -precision @ (at - vector), precision

    none = np.zeros(0, dtype=np.intp)
    options = {"with_bounds": True, "with_products": True}
    ridges = ridges_of([one], 0, none, linearise, np.array(vector), covariance, (-free, free), **options)
    return [(each.free, each.others.tolist()) for each in ridges.each]


def test_the_share_of_all_elements_against_the_excesses() -> None:
    along_share, along_time = [(0, [2, 3])], [(1, [0, 2, 3])]
    assert products([0.1, 0.0, 0.0, 0.0], 0.2, 0.001) == along_share
    assert products([-0.1, 0.0, 0.0, 0.0], 0.2, 0.001) == along_share
    # Known by itself; not distinct from zero; an amplitude that is no factor.
    assert products([0.1, 0.0, 0.0, 0.0], 0.2, 0.02) == along_time
    assert products([0.05, 0.0, 0.0, 0.0], 0.2, 0.001) == along_time
    assert products([0.1, 0.0, 0.0, 0.0], 0.2, 0.001, null=np.inf) == along_time
