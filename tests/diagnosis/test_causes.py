"""Probabilities of causes: weights against closed forms, sums of a search by hand, and simulated fingers."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from independent.dataset import EFFECTS, simulate, write
from independent.finger import SMALL
from scipy.special import expit

import bayestouch
from bayestouch.diagnosis import causes as module
from bayestouch.diagnosis.causes import DRAWS, IN_TIME, IN_TOUCHES, NOTHING, causes, compared_models, weights
from bayestouch.diagnosis.place_or_time import IN_PLACE
from bayestouch.diagnosis.rounds import SearchRound, Tried
from bayestouch.diagnosis.search import search
from bayestouch.model.body import body_of
from bayestouch.model.split_data import SplitData

# Standard errors of a mean over the draws that a difference may have; the sd of a weight is at most a half.
MOST = 4 * 0.5 / np.sqrt(DRAWS)


def test_blocks_that_agree_leave_no_doubt_of_the_sum() -> None:
    """Every block is 0.3 ahead: whatever their shares, the sum is 1.5, and the weights have its odds."""
    found = weights([np.array([[0.3] * 5, [0.0] * 5])], np.zeros(2))
    np.testing.assert_allclose(found, [expit(1.5), expit(-1.5)], rtol=1e-12)


@pytest.mark.parametrize(("one", "two"), [(3.0, -1.0), (6.0, -9.0), (0.5, 0.1)])
def test_two_blocks_in_closed_form(one: float, two: float) -> None:
    """The share u of the first is uniform: the mean of 1 / (1 + exp -2(u one + (1 - u) two)) is an integral of it."""
    expected = (np.logaddexp(0, 2 * one) - np.logaddexp(0, 2 * two)) / (2 * (one - two))
    found = weights([np.array([[one, two], [0.0, 0.0]])], np.zeros(2))
    assert found[0] == pytest.approx(expected, abs=MOST) and found.sum() == pytest.approx(1)


def test_two_ways_to_hold_out_by_brute_force() -> None:
    """Three models, four blocks of times and three of places: exponential variates over their sum, mean of both."""
    rng = np.random.default_rng(8)
    ways = [2 * rng.standard_normal((3, 4)), 2 * rng.standard_normal((3, 3))]
    prior = np.log([0.5, 0.3, 0.2])
    drawn = 200_000
    score = np.zeros((drawn, 3))
    for each in ways:
        share = rng.exponential(size=(drawn, each.shape[1]))
        score += 0.5 * each.shape[1] * (share / share.sum(axis=1, keepdims=True)) @ each.T
    brute = np.exp(score + prior)
    brute /= brute.sum(axis=1, keepdims=True)
    np.testing.assert_allclose(weights(ways, prior), brute.mean(axis=0), atol=MOST)


def test_equal_models_share_equally_and_one_far_ahead_takes_all() -> None:
    rng = np.random.default_rng(1)
    blocks = rng.standard_normal(20)
    found = weights([np.array([blocks, blocks, blocks - 5])], np.zeros(3))
    assert found[0] == found[1] == pytest.approx(0.5, abs=1e-9) and found[2] < 1e-9
    np.testing.assert_allclose(weights([np.array([blocks, blocks])], np.log([0.8, 0.2])), [0.8, 0.2])


def held(times: float, places: float | None = None) -> dict[str, np.ndarray]:
    return {
        "times": np.full(4, times),
        **({} if places is None else {"places": np.full(4, places)}),
    }


def tried(name: str, *, random: bool = False, **changes: Any) -> Tried:
    effect: Any = SimpleNamespace(name=name, random=random)
    return Tried(effect, 0.0, 1.0, (), **changes)


def one_round(names: tuple[str, ...], *candidates: Tried, added: int | None = None, **changes: Any) -> SearchRound:
    before: Any = SimpleNamespace(names=names, model=SimpleNamespace(known=SimpleNamespace(n_touches=4)))
    chosen = None if added is None else candidates[added]
    values: dict[str, Any] = {"held_out": held(-10.0, -20.0)} | changes
    return SearchRound(before, candidates, 1.0, None, 0.0, 0.0, chosen, **values)


def searched() -> tuple[SearchRound, ...]:
    """A round that adds "a", and one after it that adds nothing, with a whitening of its own."""
    scatter = tried("hum", difference=np.full(4, 0.5))
    first = (tried("a", held_out=held(-7, -16)), tried("b", held_out=held(-9, -20)), tried("small", scored_gain=-2.0))
    drift = tried("drift", random=True, held_out=held(-10, -24))
    second = tried("b", held_out=held(-99, -197)), tried("drift", random=True, scored_gain=1.0)
    return (
        one_round((), *first, drift, scatter, added=0, held_out_in_place=held(-8, -19)),
        one_round(("a",), *second, held_out=held(-100, -200), held_out_in_place=held(-100, -199)),
    )


def test_models_of_a_search() -> None:
    """Gains over the model without a cause: those of the second round begin with what "a" gains, 3 and 4 a touch."""
    found = {each.names: each for each in compared_models(searched())}
    gains = {names: (each.gain["times"][0], each.gain["places"][0], each.scored) for names, each in found.items()}
    assert gains == {
        (): (0, 0, 0),
        ("a",): (3, 4, 0),
        ("b",): (1, 0, 0),
        ("small",): (0, 0, -2),
        ("drift",): (0, -4, 0),
        ("hum",): (0.5, 0.5, 0),
        (IN_PLACE,): (2, 1, 0),
        ("a", "b"): (4, 7, 0),
        # One value more, the size of the drift, of four touches.
        ("a", "drift"): (3, 4, 1 - 0.5 * np.log(4)),
        ("a", IN_PLACE): (3, 5, 0),
    }


def test_a_set_with_an_effect_within_touches_and_one_of_the_noise() -> None:
    """Creep gains 5, and 6 more with the noise that it leaves; a noise that grows with the signal 10, beside it 3."""
    hum = tried("hum", difference=np.full(4, 10.0))
    creep = tried("creep", held_out=held(-5), noise_again=np.full(4, 6.0))
    later = tried("hum", difference=np.full(4, 3.0))
    rounds = (
        one_round((), hum, creep, added=1, held_out=held(-10)),
        one_round(("creep",), later, added=0, held_out=held(-100)),
        one_round(("creep", "hum"), held_out=held(-100)),
    )
    gains = {each.names: float(each.gain["times"][0]) for each in compared_models(rounds)}
    assert gains == {(): 0, ("hum",): 10, ("creep",): 11, ("creep", "hum"): 14}


def test_a_line_of_barometers_creeps_and_has_noise_that_grows(shared_folder: Path) -> None:
    """What the search found is not less probable than a part of it, to which the search preferred it."""
    data = bayestouch.load_dataset(shared_folder / "measured" / "baro-line")
    body = body_of(data.sensor)
    begun = body.begin(SplitData.of(data), draws=8, seed=0, **body.own({"kernel": None}))
    rounds = search(begun.fitted, begun.effects)
    assert set(rounds[-1].before.names) == {"creep_by_element", "signal_dependent_noise"}
    found = {frozenset(each.names): each.probability for each in causes(rounds)}
    both = found[frozenset(rounds[-1].before.names)]
    assert both > max(found.get(frozenset({each}), 0.0) for each in rounds[-1].before.names)


def test_a_fit_that_went_astray_is_left_out() -> None:
    first, _ = searched()
    lost = one_round((), *first.tried, tried("lost", held_out=held(np.nan, -16)))
    assert [each.names for each in compared_models((lost,))] == [(), ("a",), ("b",), ("small",), ("drift",), ("hum",)]


def test_a_way_that_is_missing_in_a_round_is_left_out() -> None:
    first, last = searched()
    found = compared_models((first, one_round(("a",), held_out=held(-100))))
    assert all(set(each.gain) == {"times"} for each in found) and last.held_out is not None


def test_probabilities_of_a_search(monkeypatch: pytest.MonkeyPatch) -> None:
    """Sums over four touches of the means of both ways, with prior odds of 1/6 for each cause: five were tried."""
    blocks = {"times": np.array([0, 0, 1, 1]), "places": np.arange(4)}
    monkeypatch.setattr(module, "blocks_of", lambda fitted: blocks)
    found = {each.names: each.probability for each in causes(searched())}
    assert sum(found.values()) == pytest.approx(1) and list(found.values()) == sorted(found.values(), reverse=True)
    odds = {
        (NOTHING,): 1,
        ("a",): np.exp(14) / 6,
        ("b",): np.exp(2) / 6,
        ("small",): np.exp(-2) / 6,
        # Not added: it is called by what all drifts are.
        (IN_TIME,): np.exp(-8) / 6,
        ("hum",): np.exp(2) / 6,
        (IN_PLACE,): np.exp(6) / 6,
        ("a", "b"): np.exp(22) / 36,
        ("a", IN_TIME): np.exp(15) / 36 / 2,
        ("a", IN_PLACE): np.exp(16) / 36,
    }
    total = sum(odds.values())
    assert found == {names: pytest.approx(each / total, rel=1e-9) for names, each in odds.items()}


def test_drifts_that_were_not_added_share_a_name(monkeypatch: pytest.MonkeyPatch) -> None:
    """And one that was added has its own."""
    monkeypatch.setattr(module, "blocks_of", lambda fitted: {"times": np.arange(4)})
    one, two = (tried(name, random=True, held_out=held(-9)) for name in ("zero", "gain"))
    last = one_round(("zero",), tried("gain", random=True, held_out=held(-50)), held_out=held(-50))
    found = {each.names: each.probability for each in causes((one_round((), one, two, held_out=held(-10)),))}
    assert found[(IN_TIME,)] == pytest.approx(2 / 3 * np.exp(4) / (1 + 2 / 3 * np.exp(4)))
    added = {
        each.names: each.probability for each in causes((one_round((), one, two, added=0, held_out=held(-10)), last))
    }
    assert set(added) == {(NOTHING,), ("zero",), (IN_TIME,), ("zero", IN_TIME)}
    assert added[("zero",)] == added[(IN_TIME,)] == pytest.approx(3 * added[("zero", IN_TIME)])
    dropped = one_round((), held_out=held(-10))
    rounds = (one_round((), one, two, added=0, held_out=held(-10)), last, dropped)
    assert {each.names for each in causes(rounds)} == {(NOTHING,), (IN_TIME,)}


def test_a_drift_that_predicts_no_touch_is_something_in_single_touches(monkeypatch: pytest.MonkeyPatch) -> None:
    """One that was added has its own name, and so has an effect that is no drift."""
    monkeypatch.setattr(module, "blocks_of", lambda fitted: {"times": np.arange(4)})
    wide = [
        tried("zero", random=True, predicts=False, held_out=held(-9)),
        tried("a", predicts=False, held_out=held(-9)),
    ]
    right = tried("gain", random=True, held_out=held(-9))
    found = {each.names: each.probability for each in causes((one_round((), *wide, right, held_out=held(-10)),))}
    odds = np.exp(4) / 4
    assert set(found) == {(NOTHING,), (IN_TOUCHES,), (IN_TIME,), ("a",)}
    assert found[IN_TOUCHES,] == found[IN_TIME,] == pytest.approx(odds / (1 + 3 * odds))
    last = one_round(("a",), wide[0], held_out=held(-10))
    beside = [each.names for each in causes((one_round((), *wide, added=1, held_out=held(-10)), last))]
    assert set(beside) == {(NOTHING,), (IN_TOUCHES,), ("a",), ("a", IN_TOUCHES)}
    last = one_round(("zero",), held_out=held(-10))
    added = [each.names for each in causes((one_round((), *wide, added=0, held_out=held(-10)), last))]
    assert set(added) == {(NOTHING,), ("zero",), ("a",)}


def test_places_that_are_wrong_at_random_are_nothing_in_time() -> None:
    """On a line of four elements, touched in random order; each place is wrong by 0.2 mm, as a positioning stage is."""
    design = bayestouch.PadDesign((0.0, 6.0, 12.0, 18.0), None, calibration_step_mm=0.2, n_touches=20)
    data = bayestouch.simulate(design, seed=2).dataset
    known, rng = data.calibration, np.random.default_rng(2)
    assert known is not None and known.x_mm is not None
    n = known.touch[-1] + 1
    order = rng.permutation(n)
    rows = np.argsort(order[known.touch], kind="stable")
    wrong = known.x_mm + 0.2 * rng.standard_normal(n)[known.touch]
    mixed = known.with_(x_mm=wrong).select(rows).with_(touch=order[known.touch][rows])
    data = replace(data, calibration=mixed)
    body = body_of(data.sensor)
    begun = body.begin(SplitData.of(data), draws=8, seed=0, **body.own({"kernel": None}))
    found = {each.names: each.probability for each in causes(search(begun.fitted, begun.effects))}
    assert found.get((IN_TOUCHES,), 0.0) > 0.9 and found.get((IN_TIME,), 0.0) < 0.01


@pytest.mark.slow
@pytest.mark.parametrize(
    ("wanted", "seed", "first"),
    [
        ([], 3, (NOTHING,)),
        ([("crosstalk: unequal, second neighbours", 2.0)], 1, ("crosstalk",)),
        ([("far_lobe: ", 2.0)], 1, (IN_PLACE,)),
    ],
)
def test_fingers_of_another_simulator(
    wanted: list[tuple[str, float]], seed: int, first: tuple[str, ...], tmp_path: Path
) -> None:
    """Nothing, an effect, and a cause that no catalogue has.

    Beside an effect whose form is not that of the catalogue there may be something in place.
    """
    simulated = simulate(SMALL, [(EFFECTS[key], size) for key, size in wanted], seed)
    data = bayestouch.load_dataset(write(simulated, tmp_path / "finger"))
    body = body_of(data.sensor)
    begun = body.begin(SplitData.of(data), draws=8, seed=0, **body.own({"contact": None, "kernel": None}))
    found = causes(search(begun.fitted, begun.effects))
    assert sum(each.probability for each in found) == pytest.approx(1)
    assert sum(each.probability for each in found if each.names in (first, (*first, IN_PLACE))) > 0.8
