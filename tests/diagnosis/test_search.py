"""Decisions of the search at their limits, each with numbers that are worked out by hand."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from search_cases import DRIFT, effect, one_round, paired, tried

from bayestouch.diagnosis import search
from bayestouch.diagnosis.rounds import SearchRound, Tried


def test_settings() -> None:
    """What docs/diagnosis.md says of the search rests on these."""
    assert (search.TOGETHER, search.TOGETHER_RANDOM, search.ERRORS) == (0.75, 0.6, 3.0)
    assert (search.MOST_EFFECTS, search.OTHER_STARTS) == (4, 2)


@pytest.mark.parametrize(
    ("of_means", "stands"), [([74.9], False), ([75.0], True), ([40, 34.9], False), ([40, 35], True)]
)
def test_what_is_added_must_explain_three_quarters(of_means: list[float], stands: bool) -> None:
    """Of what could be explained in its own round, together with what came after."""
    rounds = tuple(one_round(tried(of_means=each), 100.0 if k == 0 else 1.0) for k, each in enumerate(of_means))
    assert search._is_retained(rounds) == stands


def test_what_is_probable_stands_whatever_it_explains() -> None:
    assert search._is_retained((one_round(tried(of_means=10), probable="one"),))
    assert not search._is_retained((one_round(tried(of_means=10), probable="another"),))


@pytest.mark.parametrize(("of_means", "stands"), [(59.9, False), (60.0, True)])
def test_less_is_asked_of_a_random_function(of_means: float, stands: bool) -> None:
    assert search._is_retained((one_round(tried(of_means=of_means, effect=DRIFT)),)) == stands


def test_what_shows_by_itself_stands_and_explains_nothing_for_others() -> None:
    alone = tried(of_means=0.0, by_itself=True)
    assert search._is_retained((one_round(alone),))
    assert not search._is_retained((one_round(tried(of_means=50)), one_round(replace_means(alone, 60.0))))


def replace_means(one: Tried, of_means: float) -> Tried:
    return Tried(**{**one.__dict__, "of_means": of_means})


@pytest.mark.parametrize(
    ("of_means", "kept"),
    # Each of a round in which 100 could be explained: what falls takes along what came after it.
    [([80, 80], 2), ([80, 10], 1), ([10, 80], 2), ([10, 10], 0), ([40, 10, 80], 3), ([80, 40, 10], 1)],
)
def test_rounds_that_are_retained(of_means: list[float], kept: int) -> None:
    rounds = (*(one_round(tried(of_means=each)) for each in of_means), one_round(None))
    assert search._count_retained(rounds) == kept


def test_the_rest_is_searched_again_without_what_fell(monkeypatch: pytest.MonkeyPatch) -> None:
    """Round two falls, and an effect of round three that shows by itself is tried in its place."""
    alone = tried("alone", by_itself=True, of_means=0.0)
    kept, fallen = (
        one_round(tried("kept", of_means=80)),
        one_round(tried("fallen", of_means=10), tried=(tried("x"), alone)),
    )
    rounds = (kept, fallen, one_round(alone), one_round(None))
    monkeypatch.setattr(search, "one_round", lambda fitted, effects, *rest: (fitted, effects))
    anew = (one_round(alone, tried=(alone,), real=(alone,)), one_round(None, possible=7.0))
    seen: list[Any] = []
    monkeypatch.setattr(
        search, "_greedy", lambda first, effects, *rest, earlier: seen.append((first, effects, earlier)) or anew
    )
    effects: Any = (effect("alone"), effect("kept"), effect("fallen"))
    found = search._retained(rounds, effects, None)
    assert seen == [((fallen.before, effects[:1]), effects[:1], 1)]
    assert len(found) == 3 and found[0] is kept and found[2] is anew[1]
    assert found[1].added is alone and found[1].real == ()
    assert [each.effect.name for each in found[1].tried] == ["alone", "x"]


def test_what_falls_without_an_heir_is_no_longer_added() -> None:
    kept, fallen = one_round(tried("kept", of_means=80)), one_round(tried("fallen", of_means=10), dropped=("y",))
    found = search._retained((kept, fallen, one_round(None)), (), None)
    assert len(found) == 2 and found[0] is kept
    assert found[1].added is None and found[1].dropped == () and found[1].before is fallen.before
    whole = (kept, one_round(None))
    assert search._retained(whole, (), None) is whole


@pytest.mark.parametrize(("excess", "within"), [(4.99, True), (5.0, False)])
def test_within_the_noise(excess: float, within: bool) -> None:
    """Half of 10 % of the readings."""
    last = one_round(None, before=SimpleNamespace(excess=excess, n_readings=100))
    assert search._within_noise((one_round(None, before=None), last)) == within


def test_parts_of_the_progress() -> None:
    """Half of the bar for the first round, a sixth for the second, a twelfth for the third."""
    said: list[float] = []
    for done in range(3):
        # a stage reports its beginning by itself
        search._part(said.append, done)(1.0)
    np.testing.assert_allclose(said, [0, 1 / 2, 1 / 2, 2 / 3, 2 / 3, 3 / 4])
    assert search._part(None, 0)(0.5) is None


def test_earlier_effects_that_are_needed_no_more(monkeypatch: pytest.MonkeyPatch) -> None:
    """An effect without which the density falls by less than three errors, or by little, is dropped."""
    shape = np.array([1.0, -1, 1, -1, 1, -1, 1, -1, 0])  # standard error 3 of its sum
    falls = {"needed": shape + 9.01 / 9, "unsure": shape + 8.99 / 9, "little": np.full(9, 4.9 / 9)}
    densities: dict[int, Any] = {}

    def fitted_with(total: Any) -> Any:
        made = SimpleNamespace(n_readings=1000)
        densities[id(made)] = total
        return made

    now = fitted_with(np.zeros((9, 3)))
    fits = {name: fitted_with(np.stack([-fall / 2, -fall / 2, fall * 7], axis=1)) for name, fall in falls.items()}
    monkeypatch.setattr(search, "density", lambda fitted: densities[id(fitted)])
    for name in falls:
        monkeypatch.setattr(search, "fit_without", lambda each, fitted: fits[each.name])
        before = SimpleNamespace(model=SimpleNamespace(effects=(effect(name),)), drifts=())
        found, dropped = search._needed(now, one_round(tried(), before=before))
        assert dropped == (() if name == "needed" else (name,)), name
        assert found is (now if name == "needed" else fits[name])
    drift: Any = SimpleNamespace(name="unsure")
    before = SimpleNamespace(model=SimpleNamespace(effects=(effect("little"),)), drifts=((drift, ()),))
    assert search._needed(now, one_round(tried(effect=DRIFT), before=before))[1] == ("unsure",)


def test_no_more_than_four_effects(monkeypatch: pytest.MonkeyPatch) -> None:
    """The round after the fourth adds nothing, and an effect that was dropped is tried no more."""
    monkeypatch.setattr(search, "_settled", lambda fitted: fitted)
    monkeypatch.setattr(search, "_needed", lambda fitted, last: (fitted, ("gone",)))
    offered: list[list[str]] = []

    def again(fitted: Any, effects: Any, *rest: Any) -> SearchRound:
        offered.append([each.name for each in effects])
        return one_round(tried(), real=(tried(),))

    monkeypatch.setattr(search, "one_round", again)
    rounds = search._greedy(one_round(tried("first")), (effect("gone"), effect("kept")), None, None)  # type: ignore[arg-type]
    assert [each.added is not None for each in rounds] == [True] * 4 + [False]
    assert offered == [["kept"]] * 4 and all(each.dropped == ("gone",) for each in rounds[:4])
    assert all(each.real == () for each in rounds[1:])
    # Effects of earlier rounds count, too.
    rounds = search._greedy(one_round(tried("first")), (), None, None, earlier=3)
    assert [each.added is not None for each in rounds] == [True, False]
    rounds = search._greedy(one_round(tried("first")), (), None, None, earlier=4)
    assert [each.added is not None for each in rounds] == [False]


@pytest.mark.parametrize(("change", "taken"), [(0.4, "own peaks"), (-0.1, "own peaks"), (-2.0, "as it was")])
def test_own_peaks_are_taken_unless_they_predict_clearly_worse(
    monkeypatch: pytest.MonkeyPatch, change: float, taken: str
) -> None:
    """The change of 100 densities scatters by one: its mean is known to a tenth."""
    scatter = np.tile([-1.0, 1.0], 50)
    densities = {"as it was": np.zeros(100), "own peaks": change + scatter}
    monkeypatch.setattr(search, "settled", lambda fitted: "own peaks")
    monkeypatch.setattr(search, "density_of_readings", lambda fitted: densities[fitted])
    found: Any = search._settled("as it was")  # type: ignore[arg-type]
    assert found == taken


def begun(monkeypatch: pytest.MonkeyPatch, ends: dict[str, float]) -> list[str]:
    """The first effects that are tried, where the search from each leads to this excess over 100 readings."""
    first = one_round(
        tried("best"), real=tuple(tried(name, **paired(*np.arange(3.0))) for name in ("best", "b", "c", "d"))
    )
    taken: list[str] = []

    def greedy(start: SearchRound, *rest: Any) -> tuple[SearchRound, ...]:
        assert start.added is not None
        name = start.added.effect.name
        taken.append(name)
        return start, one_round(None, before=SimpleNamespace(excess=ends[name], n_readings=100, drifts=()))

    monkeypatch.setattr(search, "one_round", lambda *rest: first)
    monkeypatch.setattr(search, "_greedy", greedy)
    monkeypatch.setattr(search, "_count_retained", lambda rounds: len(rounds) - 1)
    found = search.search(SimpleNamespace(model=SimpleNamespace(time_is_place=False)), ())  # type: ignore[arg-type]
    assert found[0].added is not None and found[0].real == ()
    return [*taken, found[0].added.effect.name]


def test_a_beginning_keeps_what_an_earlier_round_dropped_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rounds add A, then B, which makes A unnecessary; the search from the last round's drift does not try A again."""
    effects = tuple(effect(name) for name in "ABC")
    misfit: Any = SimpleNamespace(excess=90.0, n_readings=100, drifts=())
    rounds = (
        one_round(tried("A"), real=(tried("A"),)),
        one_round(tried("B"), dropped=("A",)),
        one_round(None, before=misfit),
    )
    seen: list[list[str]] = []

    def greedy(start: Any, effects: Any, *rest: Any) -> Any:
        seen.append([each.name for each in effects])
        return rounds if len(seen) == 1 else (start, rounds[-1])

    monkeypatch.setattr(search, "one_round", lambda *rest: rounds[0])
    monkeypatch.setattr(search, "_greedy", greedy)
    monkeypatch.setattr(search, "_count_retained", lambda rounds: len(rounds) - 1)
    monkeypatch.setattr(search, "with_undecided_drift", lambda last: [one_round(tried("drift"))])
    monkeypatch.setattr(search, "still_drift", lambda drift, fitted: True)
    monkeypatch.setattr(search, "_with_rivals", lambda one: one)
    search.search(SimpleNamespace(model=SimpleNamespace(time_is_place=False)), effects)  # type: ignore[arg-type]
    assert seen == [["A", "B", "C"], ["B", "C"]]


def test_rivals_of_another_beginning_have_their_fits() -> None:
    """A round keeps the fits of its own best effect and of rivals; advice for another one needs those of its rivals."""
    one, other = tried("one", **paired(0.0, 1.0, 2.0)), tried("other", **paired(0.5, 1.0, 1.5))
    without = replace(other, fitted=None)
    found = search._with_rivals(one_round(one, real=(one, other), tried=(one, without)))
    assert found.added is not None and found.added.indistinguishable == ("other",)
    assert [each.fitted for each in found.tried] == [one.fitted, other.fitted]


def test_other_beginnings(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two others are tried where the best first guess leaves more than the noise; the first that does not is taken."""
    assert begun(monkeypatch, {"best": 4.0}) == ["best", "best"]
    assert begun(monkeypatch, {"best": 6.0, "b": 4.0}) == ["best", "b", "b"]
    assert begun(monkeypatch, {"best": 6.0, "b": 6.0, "c": 4.0}) == ["best", "b", "c", "c"]
    assert begun(monkeypatch, {"best": 6.0, "b": 6.0, "c": 6.0, "d": 0.0}) == ["best", "b", "c", "best"]
