"""Effects joined to a model and removed from it: what is fitted, from where, by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayestouch.effects import NoiseEffect, places_of_values
from bayestouch.effects.random import BaselineDrift
from bayestouch.errors import InputError
from bayestouch.model import joining
from bayestouch.model.joining import fit_with, fit_without


def effect(name: str, count: int) -> Any:
    return SimpleNamespace(name=name, parameters=(None,) * count)


def test_an_effect_is_taken_out_with_its_values(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two base parameters, then effects with 1, 2 and 1 values."""
    effects = (effect("a", 1), effect("b", 2), effect("c", 1))
    places = places_of_values(effects, 2)
    assert places == (slice(2, 3), slice(3, 5), slice(5, 6))
    model = SimpleNamespace(effects=effects, value_places=places, with_effects=lambda kept: kept)
    drifts = ((BaselineDrift(()), (1.0,)), (SimpleNamespace(name="gain_drift"), (2.0,)))
    whole: Any = SimpleNamespace(model=model, vector=np.arange(6.0), drifts=drifts, noise="n", whitening="w")
    monkeypatch.setattr(joining, "fit_from_both", lambda *of, whitening: of)
    monkeypatch.setattr(joining, "fit", lambda *of, whitening: of)
    less, vector, _, left = fit_without(effects[1], whole)  # type: ignore[misc]
    assert less == (effects[0], effects[2]) and left == drifts
    np.testing.assert_array_equal(vector, [0, 1, 2, 5])
    np.testing.assert_array_equal(fit_without(effects[0], whole)[1], [0, 1, 3, 4, 5])  # type: ignore[index]
    same, vector, _, left = fit_without(drifts[0][0], whole)  # type: ignore[misc]
    assert same is model and left == drifts[1:]
    np.testing.assert_array_equal(vector, np.arange(6.0))


def test_each_kind_of_effect_is_joined_in_its_own_way(monkeypatch: pytest.MonkeyPatch) -> None:
    """An effect of the chain starts from values; those of a drift and of noise are searched for."""
    model = SimpleNamespace(effects=("a",), values=lambda vector: ((0.0,), (7.0,)), extended=lambda *of: of)
    model.with_effects = lambda effects: SimpleNamespace(**{**vars(model), "effects": effects})
    drift = (BaselineDrift(()), (1.0, 2.0))
    whole: Any = SimpleNamespace(model=model, vector="v", drifts=(drift,), noise="n", whitening="w")
    one = SimpleNamespace(vector="new")
    asked: dict[str, Any] = {}
    monkeypatch.setattr(joining, "fit_from_both", lambda *of, **how: asked.update(of=of, **how) or one)
    monkeypatch.setattr(joining, "fit", lambda *of, **how: asked.update(of=of, **how) or one)
    found = fit_with(effect("b", 1), whole, lambda: (3.0,), whitening="kept", enough=0.7)  # type: ignore[arg-type]
    assert found.fitted is one and found.values == (7.0,) and found.noise == ()
    fitted_model, start, *rest = asked["of"]
    assert [getattr(each, "name", each) for each in fitted_model.effects] == ["a", "b"] and start == ("v", (3.0,))
    assert (rest, asked["whitening"], asked["enough"]) == (["n", (drift,)], "kept", 0.7)

    monkeypatch.setattr(joining, "refine_drift", lambda fitted, effect: (0.5, 9.0))
    other = BaselineDrift(())
    found = fit_with(other, whole, pytest.fail, whitening="kept", enough=0.7)  # type: ignore[arg-type]
    assert found.values == (0.5, 9.0)
    assert asked["of"] == (model, "v", "n", (drift, (other, (0.5, 9.0)))) and asked["enough"] == 0.7

    class Hum(NoiseEffect):
        name = "hum"

    hiss = SimpleNamespace(effect=SimpleNamespace(name="hiss"), values=(9.0,))
    hum = SimpleNamespace(effect=Hum(), values=(4.0,))
    monkeypatch.setattr(joining, "score_noise", lambda fitted, effects: ["scored"])
    monkeypatch.setattr(joining, "join_noise", lambda fitted, scored: (("with", scored), (hiss, hum)))
    found = fit_with(Hum(), whole, pytest.fail)
    assert (found.fitted, found.values, found.noise) == (("with", "scored"), (4.0,), (hiss, hum))
    monkeypatch.setattr(joining, "score_noise", lambda fitted, effects: [])
    with pytest.raises(InputError, match="hum can be observed only in repeats"):
        fit_with(Hum(), whole, pytest.fail)
