"""What a calibration holds under names that later steps read again: in words, not in keys."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import posterior_cases
import pytest

from bayestouch.effects import effect_classes
from bayestouch.effects.listing import FINGER, typical
from bayestouch.model.effect_list import EffectList
from bayestouch.model.noise import AddedNoise
from bayestouch.results.keys import effect_names


def test_rest_reading_is_held_changed_and_left_out() -> None:
    made = posterior_cases.calibration()
    np.testing.assert_array_equal(made.rest_reading, [1.0, np.nan, 3.0])
    other = made.with_rest_reading(np.ones(3))
    np.testing.assert_array_equal(other.rest_reading, np.ones(3))
    counted = made.with_rest_reading(np.ones(3), np.full(3, 7.0))
    np.testing.assert_array_equal(counted.rest_reads, np.full(3, 7.0))
    assert counted.with_rest_reading(np.ones(3)).rest_reads is None
    bare = made.with_rest_reading(None)
    assert bare.rest_reading is None and type(bare) is type(made)
    assert set(other.extra) == set(made.extra) == {*bare.extra, "rest_reading"}


def test_effects_are_written_and_read_again() -> None:
    plain = posterior_cases.calibration()
    assert not plain.has_effects and EffectList.of(plain) is None and effect_names(plain.settings) == []
    names = ("memory", "baseline_drift")
    effects = tuple(typical(effect_classes()[name]) for name in names)
    listed = EffectList(FINGER, effects, AddedNoise(common=0.1))  # type: ignore[arg-type]
    made = replace(plain, settings={**plain.settings, **listed.settings})
    found = EffectList.of(made)
    assert made.has_effects and found is not None
    assert found.to_text() == listed.to_text() and effect_names(made.settings) == list(names)


@pytest.mark.parametrize("text", ["", "[]", "{}", "3", '{"parameters": 3}'])
def test_summaries_name_no_effects_of_a_damaged_text(text: str) -> None:
    assert effect_names({"effects": text}) == []


@pytest.mark.parametrize(
    ("settings", "identified"), [({}, False), ({"e_map": "model"}, False), ({"e_map": "empirical"}, True)]
)
def test_identified_map(settings: dict[str, str], identified: bool) -> None:
    assert replace(posterior_cases.calibration(), settings=settings).has_identified_map is identified
