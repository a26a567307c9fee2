"""One round of the search, with made-up scores and refits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.special import ndtri
from search_cases import DRIFT, effect, priced

import bayestouch
from bayestouch.diagnosis import comparison, one_round, search
from bayestouch.diagnosis.place_or_time import PlaceOrTime
from bayestouch.diagnosis.rounds import SearchRound
from bayestouch.effects.noise import NoiseEffect
from bayestouch.output.progress import Bar


class Hum(NoiseEffect):
    """An effect of the noise."""

    name, stage, summary, parameters = "hum", "noise", "", ()


def candidate(name: str, z: float = 9.0, gain: float = 70.0, **changes: Any) -> Any:
    values = {"seen": 0.5, "start": (1.0,), "trials": 3, "effect": effect(name)} | changes
    return SimpleNamespace(z=z, gain=gain, **values)


def scored_round(
    monkeypatch: pytest.MonkeyPatch,
    scored: list[Any],
    refitted: dict[str, Any],
    noise: list[Any],
    correction: Any = None,
    progress: Any = None,
    in_looser_form: Any = None,
    given: Any = None,
) -> tuple[SearchRound, dict[str, Any]]:
    """One round with these scores, and what each name becomes when it is refitted; 1000 readings, excess 40."""
    said: dict[str, Any] = {"progress": []}
    model = SimpleNamespace(n_elements=8)
    fitted = SimpleNamespace(names=("hum",), n_readings=1000, excess=40.0, linear=None, model=model)

    def refit(fitted: Any, leading: Any, before: Any, least: float, scheduler: Any, done: Any = None) -> Any:
        if done is None:
            return [in_looser_form(each) for each in leading]
        said.update(leading=[each.effect.name for each in leading], before=before, least=least)
        for number in range(1, len(leading) + 1):
            done(number)
        return [refitted[each.effect.name] for each in leading if each.effect.name in refitted]

    monkeypatch.setattr(one_round, "score_effects", lambda fitted, effects: scored)
    monkeypatch.setattr(one_round, "score_noise", lambda fitted, effects: said.update(noise=effects) or noise)
    monkeypatch.setattr(one_round, "density", lambda fitted: np.zeros((3, 3)))
    monkeypatch.setattr(comparison, "folds", lambda fitted: None)
    for each in (one_round, comparison):
        monkeypatch.setattr(each, "held_out_each_way", lambda fitted, linear, density: {"times": density})
    monkeypatch.setattr(one_round, "refit_all", refit)
    monkeypatch.setattr(one_round, "fit_correction", lambda fitted: correction)
    monkeypatch.setattr(one_round, "rejoined", lambda correction, fitted: correction)
    after = np.outer([30.0, 31, 32], [0.5, 0.5, 9])
    monkeypatch.setattr(comparison, "held_out_density", lambda linear, folds: after)
    monkeypatch.setattr(one_round, "join_noise", lambda fitted, noise: (("with", noise), ("found",)))
    given = given or {each.effect.name: refitted.get(each.effect.name, each).effect for each in scored}
    effects = (Hum(), Other(), *given.values())
    found = one_round.one_round(fitted, effects, progress or said["progress"].append)  # type: ignore[arg-type]
    return found, said


class Other(Hum):
    name = "other"


def test_a_round_without_anything_real(monkeypatch: pytest.MonkeyPatch) -> None:
    """None is refitted whose score is chance or whose gain is none; the best score comes first."""
    scored = [candidate("low", z=-2.0), candidate("high", z=3.0), candidate("none", z=9.0, gain=0.0)]
    found, said = scored_round(monkeypatch, scored, {}, [])
    assert said["leading"] == [] and said["progress"] == [0.0, 0.25, 0.85, 1.0] and found.added is None
    assert [each.name for each in said["noise"]] == ["other"]
    assert [(each.effect.name, each.z) for each in found.tried] == [("none", 9.0), ("high", 3.0), ("low", -2.0)]
    # No correction: what can be explained is the excess.
    assert (found.possible, found.correction_gain, found.correction_se) == (40.0, 0.0, 0.0)
    np.testing.assert_allclose([each.share for each in found.tried], [0.0, 1.0, 1.0])
    assert all(each.start == (1.0,) for each in found.tried)
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
    assert said["leading"] == names[:5] and said["least"] == pytest.approx(5.0)
    assert found.held_out_in_place is not None and all(np.isnan(each.scored_gain) for each in found.tried)
    np.testing.assert_array_equal(found.held_out_in_place["times"], [30.0, 31.0, 32.0])
    np.testing.assert_allclose(said["progress"], [0.0, 0.25, 0.36, 0.47, 0.58, 0.69, 0.8, 0.85, 1.0])
    # 30 + 31 + 32 with the spread of three numbers one apart; more than the excess.
    assert found.possible == found.correction_gain == 93.0 and found.correction_se == pytest.approx(np.sqrt(3))
    # As good as the best, and cheaper.
    assert found.added is not None and found.added.effect.name == "b" and found.added.indistinguishable == ("a",)
    assert [each.effect.name for each in found.tried] == ["a", "b", "d", "e", "c", "f"]
    assert [each.fitted is not None for each in found.tried] == [True, True, False, False, True, False]
    assert [each.effect.name for each in found.real] == ["a", "b", "d"]
    np.testing.assert_allclose([each.share for each in found.tried[:4]], [80 / 93, 70 / 93, 60 / 93, 5 / 93])


@dataclass
class Placed:
    """Functions of place that leave a file where they are used."""

    made: Path

    @property
    def linear(self) -> None:
        self.made.touch()


def test_functions_of_place_are_fitted_beside_the_candidates(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """What they gain may be there before a candidate is refitted: nothing but `both` decides the order."""
    made, there = tmp_path / "made", list[bool]()

    def progress(done: float) -> None:
        if done == pytest.approx(0.8):
            there.append(made.exists())

    def other_first(here: Callable[[], Any], other: Callable[[Any], Any]) -> tuple[Any, Any]:
        beside = other(None)
        return here(), beside

    monkeypatch.setattr(one_round, "both", other_first)
    refitted = {"a": priced("a", 9.0, gain=90.0, of_means=80.0)}
    found, _ = scored_round(monkeypatch, [candidate("a")], refitted, [], Placed(made), progress)
    assert there == [True] and found.correction_gain == 93.0


@pytest.mark.parametrize("probable", ["b", None])
def test_a_round_that_adds_what_is_probable(monkeypatch: pytest.MonkeyPatch, probable: str | None) -> None:
    """Though it explains a twentieth and few touches have its gain, which is no chance."""
    refitted = {name: priced(name, 9.0, gain=90.0, of_means=2.0, clear=False) for name in ("a", "b")}
    monkeypatch.setattr(one_round, "most_probable_alone", lambda one: probable if len(one.tried) == 2 else "a")
    found, _ = scored_round(monkeypatch, [candidate(name) for name in refitted], refitted, [])
    assert found.probable == probable and (found.added and found.added.effect.name) == probable


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

    def refit(candidate: Any) -> Any:
        names.append(candidate.effect.name)
        assert candidate.start == (7.0, 0.0, 0.0)
        return priced("a", 2.0, gain=95.0, of_means=38.0, difference=shape + better + shape * 0.1)

    for each in refitted.values():
        object.__setattr__(each, "signature", "shape")
    scored = [candidate(name) for name in refitted]
    found, _ = scored_round(monkeypatch, scored, refitted, [], in_looser_form=refit)
    assert names == ["a"]
    first = next(each for each in found.tried if each.effect.name == "a")
    assert (first.gain, first.share) == ((95.0, 38 / 40) if taken else (90.0, 30 / 40))


@pytest.mark.parametrize(("better", "left", "taken"), [(1.0, 49.9, True), (0.0, 90.0, True), (1.0, 50.0, False)])
def test_what_begins_in_its_looser_form_stays_as_given_where_that_is_enough(
    monkeypatch: pytest.MonkeyPatch, better: float, left: float, taken: bool
) -> None:
    """As given it is taken if it leaves no relevant misfit, or if the looser form is not clearly better."""
    shape = np.array([1.0, -1, 1, -1, 1, -1, 1, -1, 0])
    refitted = {"a": priced("a", 2.0, count=3, gain=95.0, of_means=38.0, difference=shape + better + shape * 0.1)}
    as_given = priced("a", 9.0, gain=90.0, of_means=30.0, difference=shape)
    as_given.fitted.excess = left  # type: ignore[union-attr]
    begun: list[Any] = []
    monkeypatch.setattr(one_round, "score_in_form", lambda fitted, effect: begun.append(effect) or candidate("a"))
    found, _ = scored_round(
        monkeypatch,
        [candidate("a")],
        refitted,
        [],
        in_looser_form=lambda candidate: as_given,
        given={"a": as_given.effect},
    )
    assert begun == [as_given.effect]
    assert [(each.gain, each.share) for each in found.tried] == [(90.0, 30 / 40) if taken else (95.0, 38 / 40)]


def test_a_round_that_adds_an_effect_of_the_noise(monkeypatch: pytest.MonkeyPatch) -> None:
    """Unless an effect within touches is real too."""
    hum: Any = SimpleNamespace(effect=Hum(), z=9.0, gain=7.0, values=(2.0,), difference=np.array([30.0, 31, 32]))
    real = {"a": priced("a", 1.0, gain=90.0, of_means=80.0, difference=np.arange(3.0))}
    found, said = scored_round(monkeypatch, [candidate("a")], real, [hum])
    added = found.added
    assert added is not None and added.noise is hum and added.fitted == ("with", hum)
    assert added.found_noise == ("found",)
    assert (added.gain, added.seen, added.share, added.of_means, added.by_itself) == (93.0, 1.0, 1.0, 0.0, True)
    assert added.gain_se == pytest.approx(np.sqrt(3)) and added.start == (2.0,) and said["progress"][-3] == 0.8
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
    monkeypatch.setattr(one_round, "place_or_time", lambda fitted, drifts, in_place: (found,) if drifts else ())
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
        if not drifts:  # effects of earlier touches, of which there is none
            return ()
        assert drifts == {"baseline_drift": {"times": "drifting"}}
        np.testing.assert_array_equal(in_place["times"], [30.0, 31.0, 32.0])
        return (found,)

    monkeypatch.setattr(one_round, "place_or_time", faced)
    made, _ = scored_round(
        monkeypatch, [candidate("baseline_drift", effect=DRIFT)], {"baseline_drift": drift}, [], places
    )
    assert made.place_or_time == (found,)
    assert (None if made.added is None else made.added.effect.name) == added


@pytest.mark.parametrize(
    ("z", "beside", "added"),
    [
        ((-2.1, 1.9), False, None),
        ((-2.1, 1.9), True, "memory"),
        ((-1.9, -1.9), False, "memory"),
        ((-9.0, 2.1), False, "memory"),
    ],
)
def test_an_effect_of_earlier_touches_faces_functions_of_place(
    monkeypatch: pytest.MonkeyPatch, z: tuple[float, float], beside: bool, added: str | None
) -> None:
    """It is left out only if these predict better in its place, and it predicts nothing beside them."""
    memory = effect("memory")
    memory.remembers = True
    refitted = priced("memory", 9.0, gain=90.0, of_means=80.0, effect=memory, held_out={"times": "remembering"})
    found = PlaceOrTime("memory", {"times": (z[0], 1.0), "places": (z[1], 1.0)})
    asked: list[Any] = []

    def faced(fitted: Any, held_out: Any, in_place: Any) -> tuple[PlaceOrTime, ...]:
        assert held_out in ({}, {"memory": {"times": "remembering"}})
        return (found,) if held_out else ()

    monkeypatch.setattr(one_round, "place_or_time", faced)
    monkeypatch.setattr(one_round, "is_better_beside", lambda fitted, places: asked.append(fitted) or beside)
    made, _ = scored_round(
        monkeypatch, [candidate("memory", effect=memory)], {"memory": refitted}, [], SimpleNamespace(linear="placed")
    )
    assert asked == ([refitted.fitted] if z == (-2.1, 1.9) else [])
    assert made.place_or_time == ((found,) if added is None else ())
    assert (None if made.added is None else made.added.effect.name) == added


@pytest.mark.parametrize(("gain", "added"), [(91.0, "b"), (89.0, "a")])
def test_an_effect_that_changes_with_time_predicts_better_than_a_drift(
    monkeypatch: pytest.MonkeyPatch, gain: float, added: str
) -> None:
    """The drift gains 90 but explains nothing of the means, so that it is not real; a third effect gains 60."""
    following = effect("b")
    following.follows_time = True
    refitted = {
        "a": priced("a", 9.0, gain=60.0, of_means=30.0),
        "b": priced("b", 9.0, gain=gain, of_means=35.0, effect=following, difference=np.full(9, 9.0)),
        "baseline_drift": priced("c", 9.0, gain=90.0, of_means=-5.0, effect=DRIFT, held_out={}),
    }
    scored = [candidate("a"), candidate("b", effect=following), candidate("baseline_drift", effect=DRIFT)]
    found, _ = scored_round(monkeypatch, scored, refitted, [])
    assert found.added is not None and found.added.effect.name == added


def test_the_progress_says_what_is_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    """Scores, each refit by its name, functions of place, looser forms; the second round of a third start."""
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
    assert texts == [
        head,
        *(f"{head}, {each}" for each in ("scores", "refit a", "refit b", "functions of place", "looser forms")),
    ]
    shares = [share for _, share in told]
    assert shares == sorted(shares) and shares[-1] == pytest.approx(6 / 7)


def test_a_correction_has_the_arrays_of_the_model_before_it() -> None:
    """Its derivatives, which another process sends back, would be in memory once more for each round."""
    design = bayestouch.PadDesign(
        element_x_mm=(0.0, 5.0, 10.0), element_y_mm=(0.0, 0.0, 0.0), calibration_step_mm=1.0, n_touches=60
    )
    dataset = bayestouch.simulate(design, effects={"crosstalk": 0.2}, seed=1).dataset
    first = bayestouch.diagnose(dataset, sample=False, draws=8, seed=0).traced.rounds[0]
    assert first.correction is not None and first.correction.linear.functions is not None
    assert first.correction.linear.jacobian is first.before.linear.jacobian
