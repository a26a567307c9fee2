"""A note where an effect adds the same to all touches, and nobody subtracted a reading at rest."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import bayestouch
from bayestouch.diagnosis import offsets
from bayestouch.diagnosis.offsets import like_an_offset
from bayestouch.simulation import FingerDesign, simulate

PEAK = np.array([1.0, 10.0])


class Model:
    """A model of two elements, whose effects add given readings."""

    def __init__(self, **added: np.ndarray) -> None:
        self.added, self.peak = added, PEAK
        self.effects = tuple(SimpleNamespace(name=name) for name in added)
        self.value_places = tuple(slice(k, k + 1) for k in range(len(added)))

    def with_effects(self, effects: tuple[Any, ...]) -> Model:
        return Model(**{each.name: self.added[each.name] for each in effects})

    def predict(self, vector: np.ndarray) -> SimpleNamespace:
        assert len(vector) == len(self.effects)
        return SimpleNamespace(touches=5 + sum(self.added.values()))


def notes(*, rest: bool = False, drifted: np.ndarray | None = None, **added: np.ndarray) -> list[str]:
    drifts = () if drifted is None else ((SimpleNamespace(name="drift"), ()),)
    fitted = SimpleNamespace(model=Model(**added), vector=np.zeros(len(added)), drifts=drifts, drifted=drifted)
    data = SimpleNamespace(table=SimpleNamespace(in_contact=np.array([True, True, not rest])))
    return list(like_an_offset(data, fitted))  # type: ignore[arg-type]


def varying(share: float) -> np.ndarray:
    """Four touches; the mean has this share of the mean square, over the peaks, of both elements together."""
    around = np.array([1.0, -1.0, 1.0, -1.0])[:, None] * np.sqrt((1 - share) / share)
    return np.asarray((1 + around) * PEAK)


@pytest.mark.parametrize(("share", "said"), [(1.0, True), (0.991, True), (0.989, False), (0.73, False)])
def test_an_effect_that_is_the_same_in_all_touches_is_named(share: float, said: bool) -> None:
    assert offsets.SAME == 0.99
    other = np.array([1.0, 0.0, -1.0, 0.0])[:, None] * PEAK
    found = notes(bell=varying(share), other=other)
    assert [each.startswith("what bell adds") for each in found] == [True] * said
    assert len(notes(other=other, drifted=varying(share))) == said


def test_nothing_is_said_after_a_reading_at_rest_or_without_effects() -> None:
    assert notes(bell=varying(1.0)) and not notes(rest=True, bell=varying(1.0))
    assert not notes() and not notes(bell=np.zeros((4, 2)))


@pytest.mark.slow
def test_a_finger_with_an_offset_that_nobody_subtracted() -> None:
    """An offset of a tenth of the peak, in all tables."""
    made = simulate(FingerDesign(n_elements=6, samples_per_touch=5), seed=4).dataset
    assert made.calibration is not None

    def noted(by: float) -> list[str]:
        tables = {name: getattr(made, name) for name in ("calibration", "touches")}
        moved = {name: table.with_(readings=table.readings + by) for name, table in tables.items()}
        numbers = bayestouch.diagnose(replace(made, **moved), draws=100, sample=False).to_dict()
        return [note for note in numbers["notes"] if "the same in all touches" in note]

    assert len(noted(100.0)) == 1 and not noted(0.0)
