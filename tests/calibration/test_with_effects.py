"""Starting values of the fits of stated effects."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from bayestouch.calibration import with_effects
from bayestouch.effects import RandomEffect, effect_classes
from bayestouch.effects.listing import FINGER
from bayestouch.errors import InputError


@pytest.mark.parametrize("time", [0.0, -2.0])
def test_a_start_without_a_logarithm_is_refused(time: float) -> None:
    """The time of creep has a log-normal prior; its share may be zero."""
    creep = effect_classes()["creep"].suited(FINGER)
    assert creep is not None
    with pytest.raises(InputError, match=f"time of effect creep: expected a start above 0, got {time:g}"):
        with_effects.require_starts(creep, {"time": time, "share": 0.0})


def test_other_starts_reach_the_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    creep = effect_classes()["creep"].suited(FINGER)
    assert creep is not None
    begun = dict(zip((each.name for each in creep.parameters), creep.probes[0], strict=True))
    monkeypatch.setattr(with_effects, "score_in_form", lambda *_: SimpleNamespace(start=creep.probes[0]))
    new: Any = SimpleNamespace(noise="found", fitted="fitted")

    def fit_with(effect: Any, fitted: Any, start: Any) -> Any:
        assert dict(zip(begun, start(), strict=True)) == begun | {"share": 0.0, "time": 2.0}
        return new

    monkeypatch.setattr(with_effects, "fit_with", fit_with)
    assert with_effects._with_effect(None, creep, {"share": 0.0, "time": 2.0}) == ("fitted", "found")  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("stated", "kinds"), [({}, ((0.0,), (1.0,))), ({"own": 1.0}, ((1.0,),)), ({"own": 0.0}, ((0.0,),))]
)
def test_a_drift_is_of_the_stated_kind(stated: dict[str, float], kinds: tuple[tuple[float, ...], ...]) -> None:
    drift = effect_classes()["gain_drift"].suited(FINGER)
    assert drift is not None
    found = drift.as_stated(stated | {"time": 100.0})
    assert isinstance(found, RandomEffect)
    assert found.kinds == kinds
    assert found.parameters[:2] == drift.parameters[:2]
