"""Models that differ by one effect: folds, sums over touches and what is taken out, by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayestouch.diagnosis import comparison, place_or_time
from bayestouch.diagnosis.comparison import folds, gained_by_noise, is_clear, paired, refit, tried_noise
from bayestouch.model import joining


def timed(time: np.ndarray, scanned: bool = False) -> Any:
    known = SimpleNamespace(n_touches=len(time), touch_time_s=time)
    return SimpleNamespace(model=SimpleNamespace(known=known, time_is_place=scanned))


@pytest.mark.parametrize(("n", "size"), [(15, 1), (32, 2), (64, 4), (128, 8), (400, 8)])
def test_folds_are_blocks_in_time(n: int, size: int) -> None:
    """Eight folds, dealt out in turn in blocks of at most eight touches, of which each fold gets two or more."""
    order = np.random.default_rng(0).permutation(n)
    found = folds(timed(order.astype(float)))
    np.testing.assert_array_equal(found[np.argsort(order)], [k // size % 8 for k in range(n)])


@pytest.mark.parametrize(("n", "size"), [(40, 2), (90, 3)])
def test_folds_of_a_scan(n: int, size: int) -> None:
    """Thirty blocks, of two touches at the least."""
    np.testing.assert_array_equal(folds(timed(np.arange(float(n)), scanned=True)), [k // size % 8 for k in range(n)])


def test_sums_over_touches() -> None:
    total, error = paired(np.array([1.0, 2.0, 6.0]))
    # mean 3, squares 4 + 1 + 9 over 2: variance 7 of each, 21 of the sum
    assert total == 9.0 and error == pytest.approx(np.sqrt(21))
    assert paired(np.array([4.0]))[0] == 4.0 and np.isnan(paired(np.array([4.0]))[1])
    assert paired(np.array([4.0, 4.0])) == (8.0, 0.0)


@pytest.mark.parametrize(
    ("touches", "clear"),
    [
        # k touches of 100 gain g: the sum is k g, its variance k g² 100/99 (1 - k/100).
        ({50.0: 4}, False),  # 2.0 standard errors
        ({50.0: 9}, True),  # 3.1
        ({500.0: 5, 10.0: 15}, True),  # 2.5 of all, 5.0 if no touch counts more than 10
        ({500.0: 5}, False),  # too few, whatever they gain
        ({500.0: 5, -10.0: 15}, False),
        ({-50.0: 20}, False),
        ({0.0: 1}, False),
        ({6e-16: 100}, False),  # all alike, so without a standard error, but of rounding
        ({4e-4: 100}, False),  # 0.04 in all, below the 0.05 at which fits end
        ({6e-4: 100}, True),
    ],
)
def test_a_clear_gain_is_not_that_of_a_few_touches(touches: dict[float, int], clear: bool) -> None:
    gains = np.concatenate([np.full(count, gain) for gain, count in touches.items()])
    assert is_clear(np.append(gains, np.zeros(100 - len(gains)))) == clear


def test_densities_each_way(monkeypatch: pytest.MonkeyPatch) -> None:
    """By times it is known: means and deviations count, not the squares; by places it is computed."""
    blocks = {"times": np.arange(3), "places": np.array([0, 8, 17])}
    monkeypatch.setattr(comparison, "blocks_of", lambda fitted: blocks)
    made = np.array([[1.0, 2, 9], [3, 4, 9], [5, 6, 9]])
    monkeypatch.setattr(place_or_time, "held_out_density", lambda model, fold: made * (1 + fold[:, None]))
    model: Any = None
    found = comparison.held_out_each_way(model, model, made)
    np.testing.assert_array_equal(found["times"], made)
    np.testing.assert_array_equal(found["places"], made * [[1], [1], [2]])
    assert list(found) == ["times", "places"]


@pytest.mark.parametrize(("squares", "counts"), [(-4.0, True), (-6.0, False)])
def test_functions_of_place_that_predict_worse_gain_nothing(
    monkeypatch: pytest.MonkeyPatch, squares: float, counts: bool
) -> None:
    """By their variance alone they gain 30 of log density; half the squared error of three touches is 15 without them.

    With them it is 12, or 18.
    """
    before = np.array([[-9.0, -1.0, -5.0]] * 3)
    after = before + np.array([10.0, 0.0, squares + 5.0])
    monkeypatch.setattr(comparison, "folds", lambda fitted: np.arange(3))
    monkeypatch.setattr(comparison, "held_out_density", lambda linear, fold: {"placed": after}[linear])
    monkeypatch.setattr(comparison, "held_out_each_way", lambda fitted, linear, by_time: {"times": by_time})
    fitted: Any = None
    correction: Any = SimpleNamespace(linear="placed")
    gain, error, held_out = comparison.gained_in_place(fitted, correction, before)
    assert (gain, error) == ((30.0, 0.0) if counts else (0.0, 0.0)) and (held_out is not None) == counts
    assert comparison.gained_in_place(fitted, None, before) == (0.0, 0.0, None)


def test_noise_estimated_again() -> None:
    """Where the scatter is s, all touches together gain what the likelihood gains from sd 1 to its maximum."""
    rng = np.random.default_rng(4)
    touch = np.repeat([0, 1, 3], [4, 2, 1])
    sd = np.ones((7, 3))
    sd[1, 0] = np.inf  # missing
    drawn = rng.standard_normal((7, 3)) * np.array([0.2, 3.0, 1.0])
    for each in np.unique(touch):
        drawn[touch == each] -= drawn[touch == each].mean(axis=0)
    drawn[1, 0] = 0.0
    linear = SimpleNamespace(residual=np.zeros((4, 3)), touch=touch, deviation=drawn)
    fitted: Any = SimpleNamespace(linear=linear, whitening=SimpleNamespace(sample_sd=sd))
    found = gained_by_noise(fitted)
    # Free deviations: three samples and two of the first element, four and two of the others.
    free = [3, 4, 4]
    best = 0.0
    for e in range(3):
        square = float((drawn[:, e] ** 2).sum())
        scales = np.exp(np.linspace(-4, 4, 40_001))
        best += float(np.max(-0.5 * square / scales**2 - free[e] * np.log(scales))) + 0.5 * square
    assert found.sum() == pytest.approx(best, abs=1e-5) and best > 1
    assert found[2] == found[3] == 0.0
    # The second touch by hand: its two samples have one free deviation of each element.
    variance = (drawn**2).sum(axis=0) / free
    by_hand = (0.5 * (1 - 1 / variance) * (drawn[4:6] ** 2).sum(axis=0) - 0.5 * np.log(variance)).sum()
    assert found[1] == pytest.approx(by_hand)
    linear.deviation = np.zeros((7, 3))
    np.testing.assert_array_equal(gained_by_noise(fitted), 0.0)


def test_a_candidate_of_the_noise() -> None:
    """By its halves; chance explains its score or does not."""
    noise: Any = SimpleNamespace(effect="hum", z=2.0, values=(1.0,), gain=-1.5, difference=np.array([1.0, 2, 6]))
    found, real = (tried_noise(noise, by_chance=each) for each in (True, False))
    assert (found.gain, found.scored_gain, found.noise) == (9.0, -1.5, noise) and np.isnan(real.scored_gain)
    assert found.gain_se == pytest.approx(np.sqrt(21)) and found.by_itself and found.of_means == 0
    # 9 ± 4.6 is not clear: then nothing is said of what it explains.
    assert not found.clear and np.isnan(found.share)
    # Rounding that is above zero by six standard errors explains nothing either.
    noise.difference = np.array([2e-14, 2e-14, 2.01e-14])
    assert not (rounded := tried_noise(noise, by_chance=False)).clear and np.isnan(rounded.share)
    noise.difference = np.array([3.0, 3.1, 3.2])
    assert (clear := tried_noise(noise, by_chance=False)).clear and clear.share == 1


def effect(name: str, count: int) -> Any:
    return SimpleNamespace(name=name, parameters=(None,) * count)


@pytest.mark.parametrize(("least", "alone"), [(8.99, True), (9.01, False)])
def test_what_a_refit_gains(monkeypatch: pytest.MonkeyPatch, least: float, alone: bool) -> None:
    """Means gain 1, 2, 3; deviations 2, 3, 4: a sum of 9 with a standard error of sqrt(3), three of them clear."""
    model = SimpleNamespace(effects=(), values=lambda vector: ((0.0,), (7.0,)), extended=lambda vector, start: vector)
    model.with_effects = lambda effects: model
    fitted: Any = SimpleNamespace(
        model=model, vector=0, noise=0, drifts=(), whitening=0, excess=1000.0, names=(), linear=None
    )
    used: dict[str, float] = {}
    new = SimpleNamespace(vector=0, linear="new")
    monkeypatch.setattr(joining, "fit_from_both", lambda *of, whitening, enough: used.update(enough=enough) or new)
    after = np.array([[1.0, 2.0, 5.0], [2.0, 3.0, 6.0], [3.0, 4.0, 7.0]])
    monkeypatch.setattr(comparison, "density", lambda fitted: after + 10)
    asked: list[Any] = []

    def each_way(fitted: Any, linear: Any, density: Any) -> Any:
        asked.append((fitted, linear))
        return {"times": density}

    monkeypatch.setattr(comparison, "held_out_each_way", each_way)
    again = {id(new): np.array([4.0, 5.0, 6.0]), id(fitted): np.array([1.0, 1.0, 1.0])}
    monkeypatch.setattr(comparison, "gained_by_noise", lambda fitted: again[id(fitted)])
    candidate: Any = SimpleNamespace(effect=effect("e", 1), z=3.0, seen=0.4, start=(1.0,))
    before = {"times": np.full((3, 3), 10.0)}
    found = refit(fitted, candidate, before, least)
    assert (found.gain, found.of_means, found.start) == (15.0, 18.0, (7.0,))
    assert found.gain_se == pytest.approx(np.sqrt(3 * 4)) and found.by_itself == alone
    np.testing.assert_array_equal(found.difference, [3.0, 5.0, 7.0])
    assert found.held_out is not None and asked == [(fitted, "new")]
    np.testing.assert_array_equal(found.held_out["times"], [23.0, 25.0, 27.0])
    np.testing.assert_array_equal(found.noise_again, [3.0, 4.0, 5.0])
    monkeypatch.setattr(comparison, "ERRORS", 5.2)  # 5.2 sqrt(3) = 9.007
    assert not refit(fitted, candidate, before, 0.0).by_itself
    assert used["enough"] == pytest.approx(0.3)
    fitted.excess = 100.0
    refit(fitted, candidate, before, least)
    assert used["enough"] == 0.05


@pytest.mark.parametrize(
    ("times", "places", "predicts"), [(-1.0, -1.0, False), (-1.0, 1.0, True), (1.0, -1.0, True), (0.0, 0.0, False)]
)
def test_what_predicts_lowers_errors_in_some_way(
    monkeypatch: pytest.MonkeyPatch, times: float, places: float, predicts: bool
) -> None:
    """However much it gains by its uncertainty: 100 of each touch."""
    new = SimpleNamespace(fitted=SimpleNamespace(linear=None), values=())
    monkeypatch.setattr(comparison, "fit_with", lambda *of, **options: new)
    monkeypatch.setattr(comparison, "density", lambda fitted: None)
    monkeypatch.setattr(comparison, "gained_by_noise", lambda fitted: np.zeros(3))
    after = {way: np.array([[100.0, 0.0, -7.0 + gain]] * 3) for way, gain in (("times", times), ("places", places))}
    monkeypatch.setattr(comparison, "held_out_each_way", lambda fitted, linear, density: after)
    fitted: Any = SimpleNamespace(excess=1.0, whitening=None)
    candidate: Any = SimpleNamespace(effect=effect("e", 1), z=3.0, seen=0.4, start=())
    before = {way: np.array([[0.0, 0.0, -7.0]] * 3) for way in after}
    found = refit(fitted, candidate, before, 1.0)
    assert (found.predicts, found.gain) == (predicts, 300.0)
