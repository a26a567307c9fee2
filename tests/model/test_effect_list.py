"""Effects of a chain as text: what was written is read again, and what another version wrote is refused."""

from __future__ import annotations

import json

import pytest

from bayestouch.effects import effect_classes
from bayestouch.effects.listing import FINGER, typical
from bayestouch.errors import InputError
from bayestouch.model.effect_list import EffectList, named_effects
from bayestouch.model.noise import AddedNoise


def listed(*names: str) -> EffectList:
    effects = tuple(typical(effect_classes()[name]) for name in names)
    return EffectList(FINGER, effects, AddedNoise(common=0.1))  # type: ignore[arg-type]


def test_text_holds_all() -> None:
    before = listed("memory", "common_mode_noise", "baseline_drift")
    after = EffectList.from_text(before.to_text())
    assert [each.name for each in after.effects] == [each.name for each in before.effects]
    assert after.noise == before.noise and after.to_text() == before.to_text()


def test_effects_with_other_parameters_are_refused() -> None:
    content = json.loads(listed("memory").to_text())
    content["parameters"]["memory"] = ["share", "time"]
    with pytest.raises(InputError, match="effect memory has the parameters share, time, breadth here and had"):
        EffectList.from_text(json.dumps(content))


def test_the_looser_form_is_read_again() -> None:
    looser = typical(effect_classes()["channel_lag"]).looser(FINGER.n_elements)  # type: ignore[union-attr]
    assert looser is not None
    before = EffectList(FINGER, (looser,), AddedNoise())
    (after,) = EffectList.from_text(before.to_text()).effects
    assert after == looser
    # One parameter of this form is enough to state it.
    assert named_effects(["channel_lag"], FINGER, {"channel_lag": ["share", "own_03"]}) == (looser,)
    assert named_effects(["channel_lag"], FINGER, {"channel_lag": ["share"]}) != (looser,)


TEXT = listed("memory").to_text()
NO_NUMBER = TEXT.replace('"common": 0.1', '"common": "much"')
NO_NAMES = TEXT.replace('"share"', '["share"]')
NO_TIME = listed("creep").to_text().replace('"hold_s": 1.0', '"hold_s": "long"')
NO_PLACE = listed("soft_spot").to_text().replace("[[-90.0, 90.0]]", "[]")


@pytest.mark.parametrize(
    "text", ["", "[]", "{}", '{"parameters": 3, "noise": {}, "setting": {}}', NO_NUMBER, NO_NAMES, NO_TIME, NO_PLACE]
)
def test_damage_is_told(text: str) -> None:
    with pytest.raises(InputError, match="expected the effects of a chain as JSON"):
        EffectList.from_text(text)
