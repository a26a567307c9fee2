"""A drift against functions of place: differences of held-out density, and who is named."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from search_cases import effect

from bayestouch.diagnosis import place_or_time as module
from bayestouch.diagnosis.place_or_time import PlaceOrTime, sums_of_blocks


def facing(*z: float) -> PlaceOrTime:
    return PlaceOrTime(
        "baseline_drift", dict(zip(("times", "places"), ((3.0 * each, 3.0) for each in z), strict=False))
    )


@pytest.mark.parametrize(
    ("z", "who"),
    [
        ((2.1, 2.1), "drift"),
        ((2.1, -1.9), "drift"),
        ((-1.9, 2.1), "drift"),
        ((2.1, -2.1), None),
        ((1.9, 1.9), None),
        ((-2.1, 1.9), "place"),
        ((-2.1, -2.1), "place"),
        ((2.1,), "drift"),
        ((-1.9,), None),
        ((-2.1,), "place"),
    ],
)
def test_who_is_named(z: tuple[float, ...], who: str | None) -> None:
    """Who predicts better by two standard errors in one way, and is not worse by as many in the other."""
    found = facing(*z)
    assert (found.is_drift, found.is_place, found.undecided) == (who == "drift", who == "place", who is None)


def test_probability_of_the_drift() -> None:
    found = facing(1.0, -2.0).probability_of_drift
    assert found == pytest.approx({"times": 0.841345, "places": 0.022750}, rel=1e-4)


def test_difference_over_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nine touches in three blocks, whose sums are 3, 6 and 12: 21, and sqrt(3) sd of the three."""
    block = np.array([0, 0, 0, 1, 1, 1, 9, 9, 9])
    density = {"one": np.array([1.0] * 3 + [2.0] * 3 + [4.0] * 3), "other": np.zeros(9)}
    folds: list[Any] = []

    def held_out(which: Any, fold: Any) -> Any:
        folds.append(fold)
        # Half of it by means and half within touches; the third column does not count.
        return np.stack([density[which] / 2, density[which] / 2, np.full(9, 99.0)], axis=1)

    monkeypatch.setattr(module, "held_out_density", held_out)
    one: Any = "one"
    other: Any = "other"
    blocks = {"times": block}
    ((gain, error),) = module.differences(
        module.densities_of_held_out(one, blocks), module.densities_of_held_out(other, blocks), blocks
    ).values()
    assert gain == pytest.approx(21.0) and error == pytest.approx(np.sqrt(3) * np.std([3, 6, 12], ddof=1))
    np.testing.assert_array_equal(folds[0], block % 8)


@pytest.mark.parametrize(("gains", "there"), [((5.0, 1.0), True), ((1.0, 1.0), False), ((5.0, -5.0), False)])
def test_something_in_place(monkeypatch: pytest.MonkeyPatch, gains: tuple[float, float], there: bool) -> None:
    """It gains in one way by two standard errors, and loses as much in none."""
    monkeypatch.setattr(module, "time_blocks", lambda fitted: np.arange(3))
    monkeypatch.setattr(module, "place_blocks", lambda fitted: np.arange(3))
    fitted: Any = None
    before = {"times": np.zeros(3), "places": np.ones(3)}
    # Three touches about their mean by ±2/sqrt(3): a standard error of 2 of the sum.
    about = np.array([-2, 0, 2]) / np.sqrt(3)
    after = {name: before[name] + gain / 3 + about for name, gain in zip(before, gains, strict=True)}
    found = module.in_place(fitted, before, after)
    assert (found is not None) == there
    if found is not None:
        assert list(found) == ["times", "places"]
        np.testing.assert_allclose(list(found.values()), [(5.0, 2.0), (1.0, 2.0)])
    assert module.in_place(fitted, before, None) is None


@pytest.mark.parametrize(("gains", "better"), [((5.0, 1.0), True), ((1.0, 1.0), False), ((5.0, -5.0), False)])
def test_better_beside_functions_of_place(
    monkeypatch: pytest.MonkeyPatch, gains: tuple[float, float], better: bool
) -> None:
    """An effect with functions of place against these alone, by `BETTER` standard errors of 2; without them it is."""
    fitted: Any = "with the effect"
    about = np.array([-2, 0, 2]) / np.sqrt(3)
    places = {"times": np.zeros(3), "places": np.ones(3)}
    beside = {name: places[name] + gain / 3 + about for name, gain in zip(places, gains, strict=True)}

    class Placed:
        linear = "placed"

    monkeypatch.setattr(module, "blocks_of", lambda fitted: dict.fromkeys(places, np.arange(3)))
    monkeypatch.setattr(module, "fit_correction", lambda fitted: Placed())
    monkeypatch.setattr(module, "densities_of_held_out", lambda linear, blocks: {"placed": beside}[linear])
    assert module.is_better_beside(fitted, places) == better
    monkeypatch.setattr(module, "fit_correction", lambda fitted: None)
    assert module.is_better_beside(fitted, places)


@pytest.mark.parametrize(("squares", "drift", "still"), [(-6.0, 1.0, True), (-4.0, 1.0, False), (-4.0, 9.0, True)])
def test_a_drift_of_a_model_faces_functions_of_place(
    monkeypatch: pytest.MonkeyPatch, squares: float, drift: float, still: bool
) -> None:
    """Functions of place count if they lower half the squared error, 5; they gain 5 a touch. None is held out twice."""
    of: dict[str, tuple[float, float]] = {"less": (0.0, -5.0), "placed": (5.0, squares), "drift": (drift, -9.0)}
    about, calls = np.array([-0.2, 0.0, 0.2]), []

    def held_out(linear: Any, fold: Any) -> Any:
        calls.append((linear, *fold))
        gain, square = of[linear]
        return np.stack([gain + about * (linear == "drift"), np.zeros(3), np.full(3, square)], axis=1)

    less: Any = SimpleNamespace(linear="less")
    fitted: Any = SimpleNamespace(linear="drift", drifts=((effect("wander"), ()),))
    monkeypatch.setattr(module, "held_out_density", held_out)
    monkeypatch.setattr(module, "fit_without", lambda effect, fitted: less)
    monkeypatch.setattr(module, "fit_correction", lambda fitted: SimpleNamespace(linear="placed"))
    blocks = {"times": np.arange(3), "places": np.array([1, 2, 0])}
    monkeypatch.setattr(module, "blocks_of", lambda fitted: blocks)
    assert module.still_drift(effect("wander"), fitted) == still
    assert len(set(calls)) == len(calls)
    assert module.still_drift(effect("another"), fitted)


def test_sums_of_blocks() -> None:
    """Touches 0 and 2 are of one block, whatever its number."""
    np.testing.assert_array_equal(sums_of_blocks([np.array([1.0, 2, 4])], np.array([7, 3, 7])), [[2.0, 5.0]])
