"""Decisions of the search at their limits, each with numbers that are worked out by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.special import ndtri

from bayestouch.diagnosis import choice, comparison, search
from bayestouch.diagnosis.place_or_time import PlaceOrTime
from bayestouch.diagnosis.rounds import SearchRound, Tried
from bayestouch.effects.noise import NoiseEffect
from bayestouch.effects.random import BaselineDrift
from bayestouch.output.progress import Bar

DRIFT = BaselineDrift(())


def effect(name: str) -> Any:
    return SimpleNamespace(name=name, parameters=(), needs_samples=False, random=False, looser=lambda m: None)


def tried(name: str = "one", **changes: Any) -> Tried:
    """A candidate that is real: it gains 60 ± 10, explains half and is far from chance."""
    values = {"z": 9.0, "seen": 0.5, "start": (), "gain": 60.0, "clear": True, "of_means": 50.0, "share": 0.5}
    values |= {"effect": effect(name), "fitted": SimpleNamespace()}
    return Tried(**{**values, **changes})


def one_round(added: Tried | None, best_share: float = 100.0, **changes: Any) -> SearchRound:
    values = {"before": SimpleNamespace(excess=0.0, n_readings=100), "tried": (), "correction": None}
    values |= {"correction_gain": 0.0, "correction_se": 0.0}
    return SearchRound(added=added, best_share=best_share, **{**values, **changes})


def test_settings() -> None:
    """What docs/diagnose.md says of the search rests on these."""
    assert (search.CHANCE, search.ERRORS, search.MATERIAL, search.SHARE) == (0.01, 3.0, 0.1, 0.3)
    assert (search.TOGETHER, search.TOGETHER_RANDOM, choice.INDISTINGUISHABLE, choice.NEARLY) == (0.75, 0.6, 2.0, 0.9)
    assert (search.LEADING, search.MOST_EFFECTS, search.OTHER_STARTS, search.VISIBLE) == (5, 4, 2, 0.2)
    assert (search.LOOSER, comparison.MOST_OF_A_TOUCH) == (3, 10.0)


@pytest.mark.parametrize(
    ("of_means", "stands"), [([74.9], False), ([75.0], True), ([40, 34.9], False), ([40, 35], True)]
)
def test_what_is_added_must_explain_three_quarters(of_means: list[float], stands: bool) -> None:
    """Of what could be explained in its own round, together with what came after."""
    rounds = tuple(one_round(tried(of_means=each), 100.0 if k == 0 else 1.0) for k, each in enumerate(of_means))
    assert search._is_retained(rounds) == stands


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
    anew = (one_round(alone, tried=(alone,), real=(alone,)), one_round(None, best_share=7.0))
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


def test_the_progress_says_what_is_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    """Scores, each refit by its name, functions of place; the second round of a third start after four other rounds."""
    told: list[tuple[str, float]] = []

    class Told:
        """What a bar of tqdm is told."""

        n, text = 0.0, ""

        def set_description_str(self, text: str, refresh: bool) -> None:
            self.text = text

        def update(self, more: float) -> None:
            self.n += more
            told.append((self.text, self.n))

    round_of_start = search._part(Bar("diagnose", Told()), 1, 4, "start 3")
    real = {name: priced(name, 9.0, gain=90.0, of_means=80.0) for name in ("a", "b")}
    scored_round(monkeypatch, [candidate("a"), candidate("b")], real, [], progress=round_of_start)
    texts = list(dict.fromkeys(text for text, _ in told))
    head = "diagnose: start 3, round 2"
    assert texts == [head, *(f"{head}, {each}" for each in ("scores", "refit a", "refit b", "functions of place"))]
    shares = [share for _, share in told]
    assert shares == sorted(shares) and shares[-1] == pytest.approx(6 / 7)


@pytest.mark.parametrize(("readings", "least"), [(1000, 5.0), (10_000, 50.0), (20_000, 50.0)])
def test_least_gain(readings: int, least: float) -> None:
    """Half the squares of a tenth of the noise: n/200, and no more than 50."""
    assert search._smallest_gain(SimpleNamespace(n_readings=readings)) == pytest.approx(least)  # type: ignore[arg-type]


@pytest.mark.parametrize("trials", [1, 40])
def test_chance_of_the_best_of_many_trials(trials: int) -> None:
    """1 - (1 - p)^n = 0.01, on both sides of zero."""
    limit = -float(ndtri(0.5 * (1 - 0.99 ** (1 / trials))))
    for sign in (1, -1):
        assert search._passes(sign * limit * (1 + 1e-6), trials)
        assert not search._passes(sign * limit * (1 - 1e-6), trials)


@pytest.mark.parametrize(
    ("changes", "real"),
    [
        ({}, True),
        ({"gain": float("nan")}, False),
        ({"z": 2.0}, False),
        ({"clear": False}, False),
        ({"gain": 20.0}, True),
        ({"gain": 19.9}, False),
        ({"share": 0.3}, True),
        ({"share": 0.29}, False),
        ({"share": 0.29, "by_itself": True}, True),
        ({"effect": DRIFT}, True),
        ({"effect": DRIFT, "seen": 0.2}, False),
        ({"effect": DRIFT, "seen": 0.21}, True),
    ],
)
def test_what_is_real(changes: dict[str, Any], real: bool) -> None:
    """At the limits, with a least gain of 20."""
    assert search._is_real(tried(**changes), 10, 20.0) == real


@pytest.mark.parametrize(
    ("gain", "share", "near"),
    [(0.0, 0.3, False), (0.5, 0.3, True), (29, 0.29, False)],
)
def test_what_is_near(gain: float, share: float, near: bool) -> None:
    """It gains something, though not clearly, and explains enough."""
    assert search.is_near(tried(gain=gain, share=share, clear=False)) == near
    assert not search.is_near(tried(gain=gain, share=share))


def test_share_of_what_can_be_explained() -> None:
    """By the means where it was refitted, by all where it shows by itself, else by the score; between 0 and 1."""
    scored: Any = SimpleNamespace(gain=10.0)
    assert search._share(tried(of_means=50), scored, 200.0) == 0.25
    assert search._share(tried(of_means=50, by_itself=True), scored, 200.0) == 0.3
    assert search._share(tried(gain=float("nan")), scored, 200.0) == 0.05
    assert search._share(tried(of_means=300), scored, 200.0) == 1.0
    assert search._share(tried(of_means=-300), scored, 200.0) == 0.0


def paired(*differences: float) -> dict[str, Any]:
    return {"difference": np.array(differences)}


def test_as_good_is_within_two_standard_errors() -> None:
    """Differences of 1 ± 1 over 9 touches: a sum of 9 with a standard error of 3 sqrt(9/8) = 3.18, 2.8 of them."""
    best = tried(**paired(*np.zeros(9)))
    shape = np.array([1.0, -1, 1, -1, 1, -1, 1, -1, 0])  # sum 0, sample variance 1: standard error 3
    assert choice.as_good(tried(**paired(*(shape - 5.99 / 9))), best)
    assert not choice.as_good(tried(**paired(*(shape - 6.01 / 9))), best)
    assert choice.as_good(tried(**paired(*(shape + 50))), best)
    assert not choice.as_good(tried(), best) and not choice.as_good(best, tried())


def test_names_of_what_cannot_be_told_apart() -> None:
    shape = np.array([1.0, -1, 1, -1, 1, -1, 1, -1, 0])
    added = tried("added", **paired(*np.zeros(9)))
    others = [tried("like", **paired(*shape)), tried("worse", **paired(*(shape - 1))), added]
    noise = tried("noise", noise=SimpleNamespace(), **paired(*shape))
    assert choice.indistinguishable_from(added, [*others, noise]) == ("like",)
    assert choice.indistinguishable_from(noise, others) == ()


def priced(name: str, cost: float, count: int = 1, **changes: Any) -> Tried:
    fitted = SimpleNamespace(
        linear=SimpleNamespace(cost=lambda: cost),
        model=SimpleNamespace(known=SimpleNamespace(n_touches=100)),
        excess=10.0,
        n_readings=1000,
    )
    kind = effect(name)
    kind.parameters = (None,) * count
    shape = np.array([1.0, -1, 1, -1, 1, -1, 1, -1, 0])
    return tried(**{"effect": kind, "fitted": fitted, "difference": shape * changes.pop("sign", 1.0), **changes})


def test_price_is_schwarz_criterion() -> None:
    assert choice.schwarz_criterion(priced("a", 12.0, 3)) == pytest.approx(12 + 1.5 * np.log(100))


def test_the_plainest_of_those_as_good() -> None:
    """Two parameters more cost log 100 = 4.6."""
    best, plain = priced("best", 10.0, 3), priced("plain", 14.5, 1, sign=-1.0)
    assert choice.most_probable([best, plain]) is plain
    dear = priced("dear", 14.7, 1, sign=-1.0)
    assert choice.most_probable([best, dear]) is best
    far = priced("far", 1.0, difference=np.zeros(9) - np.array([9.0, 8, 9, 8, 9, 8, 9, 8, 9]))
    assert choice.most_probable([best, far]) is best
    noise = tried("noise", noise=SimpleNamespace())
    assert choice.most_probable([noise, plain]) is noise
    assert choice.most_probable([best, noise]) is best


@pytest.mark.parametrize(("of_means", "cause"), [(45.0, False), (45.1, True)])
def test_a_cause_goes_before_a_random_function(of_means: float, cause: bool) -> None:
    """Where it does more than nine tenths of what that does, though it gains less density."""
    drift = tried(effect=DRIFT, **paired(*np.full(9, 9.0)))
    far = tried("far", of_means=of_means, **paired(*np.arange(9.0) / 10))
    less = tried("less", of_means=20.0, **paired(*np.arange(9.0) / 10))
    assert choice.most_probable([drift, less, far]) is (far if cause else drift)
    assert choice.most_probable([drift]) is drift


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


def test_other_beginnings(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two others are tried where the best first guess leaves more than the noise; the first that does not is taken."""
    assert begun(monkeypatch, {"best": 4.0}) == ["best", "best"]
    assert begun(monkeypatch, {"best": 6.0, "b": 4.0}) == ["best", "b", "b"]
    assert begun(monkeypatch, {"best": 6.0, "b": 6.0, "c": 4.0}) == ["best", "b", "c", "c"]
    assert begun(monkeypatch, {"best": 6.0, "b": 6.0, "c": 6.0, "d": 0.0}) == ["best", "b", "c", "best"]


class Hum(NoiseEffect):
    """An effect of the noise."""

    name, stage, summary, parameters = "hum", "noise", "", ()


def candidate(name: str, z: float = 9.0, gain: float = 70.0, **changes: Any) -> Any:
    values = {"seen": 0.5, "start": (1.0,), "trials": 3, "signature": name, "effect": effect(name)} | changes
    return SimpleNamespace(z=z, gain=gain, **values)


def scored_round(
    monkeypatch: pytest.MonkeyPatch,
    scored: list[Any],
    refitted: dict[str, Any],
    noise: list[Any],
    correction: Any = None,
    progress: Any = None,
    in_looser_form: Any = None,
) -> tuple[SearchRound, dict[str, Any]]:
    """One round with these scores, and what each name becomes when it is refitted; 1000 readings, excess 40."""
    said: dict[str, Any] = {"progress": []}
    model = SimpleNamespace(n_elements=8)
    fitted = SimpleNamespace(names=("hum",), n_readings=1000, excess=40.0, linear=None, model=model)

    def refit(
        fitted: Any, leading: Any, before: Any, errors: float, least: float, scheduler: Any, done: Any = None
    ) -> Any:
        if done is None:
            return [in_looser_form(each, errors) for each in leading]
        said.update(leading=[each.effect.name for each in leading], before=before, errors=errors, least=least)
        for number in range(1, len(leading) + 1):
            done(number)
        return [refitted[each.effect.name] for each in leading if each.effect.name in refitted]

    monkeypatch.setattr(search, "score_effects", lambda fitted, effects: scored)
    monkeypatch.setattr(search, "score_noise", lambda fitted, effects: said.update(noise=effects) or noise)
    monkeypatch.setattr(search, "density", lambda fitted: np.zeros((3, 3)))
    monkeypatch.setattr(comparison, "folds", lambda fitted: None)
    monkeypatch.setattr(search, "held_out_each_way", lambda fitted, linear, density: {"times": density[:, 0]})
    monkeypatch.setattr(comparison, "held_out_each_way", lambda fitted, linear, density: {"times": density[:, 1]})
    monkeypatch.setattr(search, "refit_all", refit)
    monkeypatch.setattr(search, "fit_correction", lambda fitted: correction)
    after = np.outer([30.0, 31, 32], [0.5, 0.5, 9])
    monkeypatch.setattr(comparison, "held_out_density", lambda linear, folds: after)
    monkeypatch.setattr(search, "settled_noise", lambda fitted, noise: ("settled", noise))
    monkeypatch.setattr(search, "with_noise", lambda fitted, found: ("with", found))
    known = Hum()
    found = search.one_round(fitted, (known, Other(), effect("x")), progress or said["progress"].append)  # type: ignore[arg-type]
    return found, said


class Other(Hum):
    name = "other"


def test_a_round_without_anything_real(monkeypatch: pytest.MonkeyPatch) -> None:
    """None is refitted whose score is chance or whose gain is none; the best score comes first."""
    scored = [candidate("low", z=-2.0), candidate("high", z=3.0), candidate("none", z=9.0, gain=0.0)]
    found, said = scored_round(monkeypatch, scored, {}, [])
    assert said["leading"] == [] and said["progress"] == [0.0, 0.25, 1.0] and found.added is None
    assert [each.name for each in said["noise"]] == ["other"]
    assert [(each.effect.name, each.z) for each in found.tried] == [("none", 9.0), ("high", 3.0), ("low", -2.0)]
    # No correction: what can be explained is the excess.
    assert (found.best_share, found.correction_gain, found.correction_se) == (40.0, 0.0, 0.0)
    np.testing.assert_allclose([each.share for each in found.tried], [0.0, 1.0, 1.0])
    assert all(each.signature == each.effect.name and each.start == (1.0,) for each in found.tried)
    # The best of three signatures; the score of "none" is no chance, and it was not fitted.
    scored = [each.scored_gain for each in found.tried]
    np.testing.assert_allclose(scored, [np.nan, 70 - np.log(3), 70 - np.log(3)])
    assert found.held_out is not None and found.held_out_in_place is None
    np.testing.assert_array_equal(found.held_out["times"], np.zeros(3))


def test_a_round_that_adds_an_effect(monkeypatch: pytest.MonkeyPatch) -> None:
    """The five best are refitted; fits are kept of the best, of what is like it and of what is near."""
    names = ["a", "b", "c", "d", "e", "f"]
    shape = np.array([1.0, -1, 1, -1, 1, -1, 1, -1, 0])
    unsure = {"gain": 25.0, "clear": False, "of_means": 60.0}
    refitted = {
        "a": priced("a", 9.0, gain=90.0, of_means=80.0),
        "b": priced("b", 5.0, gain=80.0, of_means=70.0, difference=shape * -1),
        "c": priced("c", 1.0, difference=shape - 9, **unsure),
        "d": priced("d", 1.0, gain=50.0, of_means=60.0, difference=shape - 9),
        "e": priced("e", 1.0, gain=50.0, of_means=5.0, difference=shape - 9),
    }
    linear = SimpleNamespace(linear=None)
    found, said = scored_round(monkeypatch, [candidate(name) for name in names], refitted, [], linear)
    assert said["leading"] == names[:5] and said["errors"] == 3.0 and said["least"] == pytest.approx(5.0)
    assert found.held_out_in_place is not None and all(np.isnan(each.scored_gain) for each in found.tried)
    np.testing.assert_array_equal(found.held_out_in_place["times"], [15.0, 15.5, 16.0])
    np.testing.assert_allclose(said["progress"], [0.0, 0.25, 0.36, 0.47, 0.58, 0.69, 0.8, 1.0])
    # 30 + 31 + 32 with the spread of three numbers one apart; more than the excess.
    assert found.best_share == found.correction_gain == 93.0 and found.correction_se == pytest.approx(np.sqrt(3))
    # As good as the best, and cheaper.
    assert found.added is not None and found.added.effect.name == "b" and found.added.indistinguishable == ("a",)
    assert [each.effect.name for each in found.tried] == ["a", "b", "d", "e", "c", "f"]
    assert [each.fitted is not None for each in found.tried] == [True, True, False, False, True, False]
    assert [each.effect.name for each in found.real] == ["a", "b", "d"]
    np.testing.assert_allclose([each.share for each in found.tried[:4]], [80 / 93, 70 / 93, 60 / 93, 5 / 93])


def test_drifts_do_not_take_the_place_of_others(monkeypatch: pytest.MonkeyPatch) -> None:
    """Five others are refitted, and the drifts that are better than the last of them."""
    scored = [candidate(name) for name in "abcdefg"]
    for each in (scored[0], scored[2], scored[6]):
        each.effect.random = True
    _, said = scored_round(monkeypatch, scored, {}, [])
    assert said["leading"] == list("abcdefg")
    scored.append(candidate("h"))
    _, said = scored_round(monkeypatch, scored, {}, [])
    assert said["leading"] == list("abcdefgh")
    _, said = scored_round(monkeypatch, [*scored, candidate("i")], {}, [])
    assert said["leading"] == list("abcdefgh")


@pytest.mark.parametrize(("better", "taken"), [(1.0, True), (0.0, False)])
def test_the_looser_form_is_taken_where_it_is_clearly_better(
    monkeypatch: pytest.MonkeyPatch, better: float, taken: bool
) -> None:
    """Only candidates that leave a misfit are tried, from the values of the plain form and zeros."""
    shape = np.array([1.0, -1, 1, -1, 1, -1, 1, -1, 0])
    refitted = {name: priced(name, 9.0, gain=90.0, of_means=30.0, start=(7.0,)) for name in ("a", "b", "small")}
    # Relevant is more than a tenth of a half of the 1000 readings.
    refitted["a"].fitted.excess, refitted["small"].fitted.excess = 50.0, 49.9
    refitted["little"] = priced("little", 9.0, gain=4.9, of_means=30.0)
    refitted["little"].fitted.excess = 50.0
    names: list[str] = []
    looser = effect("a")
    looser.parameters = (None,) * 3
    for name in ("a", "small", "little"):
        refitted[name].effect.looser = lambda m: looser if m == 8 else None

    def refit(candidate: Any, errors: float) -> Any:
        names.append(candidate.effect.name)
        assert candidate.start == (7.0, 0.0, 0.0) and errors == 3.0
        return priced("a", 2.0, gain=95.0, of_means=38.0, difference=shape + better + shape * 0.1)

    for each in refitted.values():
        object.__setattr__(each, "signature", "shape")
    scored = [candidate(name) for name in refitted]
    found, _ = scored_round(monkeypatch, scored, refitted, [], in_looser_form=refit)
    assert names == ["a"]
    first = next(each for each in found.tried if each.effect.name == "a")
    assert (first.gain, first.share) == ((95.0, 38 / 40) if taken else (90.0, 30 / 40))


def test_a_round_that_adds_an_effect_of_the_noise(monkeypatch: pytest.MonkeyPatch) -> None:
    """Unless an effect within touches is real too."""
    hum: Any = SimpleNamespace(effect=Hum(), z=9.0, gain=7.0, values=(2.0,), difference=np.array([30.0, 31, 32]))
    real = {"a": priced("a", 1.0, gain=90.0, of_means=80.0, difference=np.arange(3.0))}
    found, said = scored_round(monkeypatch, [candidate("a")], real, [hum])
    added = found.added
    assert added is not None and added.noise is hum and added.fitted == ("with", ("settled", hum))
    assert (added.gain, added.seen, added.share, added.of_means, added.by_itself) == (93.0, 1.0, 1.0, 0.0, True)
    assert added.gain_se == pytest.approx(np.sqrt(3)) and added.start == (2.0,) and said["progress"][-2] == 0.8
    assert np.isnan(added.scored_gain)
    real["a"].effect.needs_samples = True
    found, _ = scored_round(monkeypatch, [candidate("a")], real, [hum])
    assert found.added is not None and found.added.effect.name == "a"


@pytest.mark.parametrize(("chance", "leads"), [(0.0099, True), (0.0101, False)])
def test_trials_are_all_signatures_and_effects_of_the_noise(
    monkeypatch: pytest.MonkeyPatch, chance: float, leads: bool
) -> None:
    """Two effects of three signatures each, and one of the noise: seven trials."""
    z = -float(ndtri(0.5 * (1 - (1 - chance) ** (1 / 7))))
    hum: Any = SimpleNamespace(effect=Hum(), z=0.0, gain=7.0, values=(), difference=np.zeros(3))
    found, said = scored_round(monkeypatch, [candidate("a", z=z), candidate("b", z=0.0)], {}, [hum])
    assert said["leading"] == (["a"] if leads else [])
    assert [each.scored_gain for each in found.tried if each.noise is hum] == [7.0]


def test_a_drift_that_is_undecided_keeps_its_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    """The advice on what to measure, and another beginning of the search, need it after another effect was added."""
    shape = np.array([1.0, -1, 1, -1, 1, -1, 1, -1, 0])
    drift = priced("a", 9.0, gain=60.0, of_means=60.0, effect=DRIFT, held_out={}, difference=shape - 9)
    best = priced("a", 2.0, gain=95.0, of_means=80.0, difference=shape + 9)
    far = priced("b", 9.0, gain=60.0, of_means=60.0, difference=shape - 9)
    found = PlaceOrTime("baseline_drift", {"times": (1.0, 1.0)})
    monkeypatch.setattr(search, "place_or_time", lambda fitted, drifts, in_place: (found,))
    scored = [candidate("a"), candidate("b"), candidate("baseline_drift", effect=DRIFT)]
    made, _ = scored_round(monkeypatch, scored, {"a": best, "b": far, "baseline_drift": drift}, [])
    assert made.added is not None and made.added.effect.name == "a"
    kept = {each.effect.name for each in made.tried if each.fitted is not None}
    assert kept == {"a", "baseline_drift"}


@pytest.mark.parametrize(("z", "added"), [(2.1, "baseline_drift"), (1.9, None), (-2.1, None)])
def test_a_drift_faces_functions_of_place(monkeypatch: pytest.MonkeyPatch, z: float, added: str | None) -> None:
    """It is added only if it predicts better; either way the round says how it fared."""
    drift = priced("a", 9.0, gain=90.0, of_means=80.0, effect=DRIFT, held_out={"times": "drifting"})
    found = PlaceOrTime("baseline_drift", {"times": (z, 1.0)})
    places = SimpleNamespace(linear="placed")

    def faced(fitted: Any, drifts: Any, in_place: Any) -> tuple[PlaceOrTime, ...]:
        assert drifts == {"baseline_drift": {"times": "drifting"}}
        np.testing.assert_array_equal(in_place["times"], [15.0, 15.5, 16.0])
        return (found,)

    monkeypatch.setattr(search, "place_or_time", faced)
    made, _ = scored_round(
        monkeypatch, [candidate("baseline_drift", effect=DRIFT)], {"baseline_drift": drift}, [], places
    )
    assert made.place_or_time == (found,)
    assert (None if made.added is None else made.added.effect.name) == added
