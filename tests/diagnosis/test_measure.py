"""What to measure next: texts, numbers of touches and series, against sums written out by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayestouch.diagnosis import measure
from bayestouch.diagnosis.measure import ENOUGH, NUMBERS, UNDECIDED, Advice, advice
from bayestouch.diagnosis.place_or_time import PlaceOrTime
from bayestouch.effects.random import BaselineDrift
from bayestouch.model.base import PossibleTouches


def tried(name: str, *, gain: float = 5.0, se: float = 3.0, share: float = 0.5, effect: Any = None, **more: Any) -> Any:
    values = {"fitted": SimpleNamespace(), "noise": None, "indistinguishable": (), **more}
    return SimpleNamespace(
        effect=effect or SimpleNamespace(name=name, random=False), gain=gain, clear=gain > 3 * se, share=share, **values
    )


def one_round(*candidates: Any, added: Any = None) -> Any:
    before = SimpleNamespace(model=SimpleNamespace(known=None, possible_touches=lambda: "possible"))
    return SimpleNamespace(before=before, tried=candidates, added=added, place_or_time=())


def test_what_decides_is_twice_the_errors_squared() -> None:
    """A difference D favours the right model by D²/2 with sd D: D²/2 = 3 D at D = 6."""
    assert ENOUGH == 36.0
    assert NUMBERS == (3, 5, 10, 20, 30, 50, 75, 100, 150, 200, 300, 500)
    assert "500 touches" in UNDECIDED


def test_advice_in_words() -> None:
    assert str(Advice(("a", "b"), 20, "with a flat")) == "To decide between a and b: about 20 more touches with a flat."
    assert str(Advice(("a", "b"), None, UNDECIDED)) == f"To decide between a and b: {UNDECIDED}."


def test_squares_without_anything_left_open() -> None:
    """n touches spread over two that differ by 1 and 2: D² = n/2 (1 + 4)."""
    squares = measure._decides(np.array([[1.0], [2.0]]), np.zeros((1, 2, 1)))
    np.testing.assert_allclose(squares, [number / 2 * 5 for number in NUMBERS])


def test_squares_with_a_direction_that_is_left_open() -> None:
    """One standard deviation of a parameter does a = (1, 1) to d = (1, 2).

    D² = n' dᵀ (1 + n' a aᵀ)⁻¹ d with n' = n/2 = n' (5 - 9 n'/(1 + 2 n')) by Sherman and Morrison.
    """
    squares = measure._decides(np.array([[1.0], [2.0]]), np.ones((1, 2, 1)))
    n = np.array(NUMBERS) / 2
    np.testing.assert_allclose(squares, n * (5 - 9 * n / (1 + 2 * n)))


# Six touches: an edge and a flat under one load each, and both in turn.
SERIES = (("with an edge", np.array([0, 1, 2])), ("with a flat", np.array([3])), ("in turn", np.arange(6)))


def decide(monkeypatch: pytest.MonkeyPatch, apart: list[float]) -> Advice:
    """Advice where the predictions of the six touches differ by these."""
    found = (np.array(apart)[:, None], np.zeros((1, 6, 1)))
    monkeypatch.setattr(measure, "separation", lambda one, two, known: found)
    possible = PossibleTouches(SimpleNamespace(), SERIES)  # type: ignore[arg-type]
    return measure._advice(SimpleNamespace(model=SimpleNamespace(known=None)), possible, tried("one"), tried("two"))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("differs", "number"), [(np.sqrt(36 / 20), 20), (np.sqrt(36 / 20.1), 30), (4.0, 3), (np.sqrt(36 / 501), None)]
)
def test_least_number_that_decides(monkeypatch: pytest.MonkeyPatch, differs: float, number: int | None) -> None:
    """The flat shows it: n touches whiten to n times the square."""
    found = decide(monkeypatch, [0, 0, 0, differs * (1 + 1e-12), 0, 0])
    assert found.between == ("one", "two") and found.number == number
    assert found.touches == (UNDECIDED if number is None else "with a flat")


@pytest.mark.parametrize(("square", "number"), [(36 / 7.5, 8), (36 / 500, 500), (36 / 501, None)])
def test_numbers_of_touches_in_time(monkeypatch: pytest.MonkeyPatch, square: float, number: int | None) -> None:
    """Two elements share the difference: D² of a touch is the sum over elements, on the mean over touches."""
    each = np.sqrt(np.outer([0.5, 1.5], [0.25, 0.75]) * square)
    monkeypatch.setattr(measure, "separation", lambda one, two, known: (each * (1 + 1e-12), None))
    drift = tried("baseline_drift", effect=BaselineDrift(()))
    before: Any = SimpleNamespace(model=SimpleNamespace(known=None))
    found = measure._advice(before, PossibleTouches(before, ()), drift, tried("two"))
    assert found.number == number
    kind = "of one kind (tip, location, load), spread evenly over the whole time"
    assert found.touches == (UNDECIDED if number is None else kind)


def test_which_pair_is_undecided() -> None:
    near, second, sure = tried("near"), tried("second"), tried("sure", gain=50.0)
    assert measure._indistinguishable_pair(one_round(sure, near, second)) == (near, second)
    assert measure._indistinguishable_pair(one_round(sure, near)) is None
    assert (
        measure._indistinguishable_pair(one_round(near, tried("noise", noise=1), tried("unfitted", fitted=None)))
        is None
    )
    added = tried("added", gain=50.0, indistinguishable=("second", "third"))
    assert measure._indistinguishable_pair(one_round(added, near, second, added=added)) == (added, second)
    assert measure._indistinguishable_pair(one_round(added, near, added=added)) is None
    unfitted = tried("added", fitted=None, indistinguishable=("second",))
    assert measure._indistinguishable_pair(one_round(second, added=unfitted)) is None


def test_advice_of_the_first_round_that_is_undecided(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(measure, "_advice", lambda before, possible, one, two: (one.effect.name, two.effect.name))
    rounds = (one_round(tried("a")), one_round(tried("b"), tried("c")), one_round(tried("d"), tried("e")))
    assert advice(rounds) == ("b", "c")
    assert advice(rounds[:1]) is None


class Line:
    """A model whose touches read vector · place."""

    def __init__(self, known: Any) -> None:
        self.known = known

    def observing(self, known: Any) -> Line:
        return Line(known)

    def predict(self, vector: np.ndarray) -> Any:
        return SimpleNamespace(touches=vector[0] * self.known.place[:, None])

    def derivatives(self, vector: np.ndarray) -> tuple[np.ndarray, None]:
        return self.known.place[None, :, None], None

    def by_load(self, vector: np.ndarray) -> np.ndarray:
        return np.zeros((len(self.known.place), 1))


def test_separation_of_two_models(monkeypatch: pytest.MonkeyPatch) -> None:
    """Differences over the noise, and what one standard deviation of either slope does to them."""
    known = SimpleNamespace(place=np.array([1.0, 3.0]), n_touches=2)
    seen: list[np.ndarray] = []

    def whitening(observed: Any, noise: Any, first: np.ndarray, by_load: np.ndarray) -> Any:
        seen.append(noise.load_sd)
        return SimpleNamespace(touches=lambda rows: rows / 0.5)

    monkeypatch.setattr(measure, "Whitening", SimpleNamespace(of=whitening))

    def fitted(slope: float, variance: float, drifted: float) -> Any:
        noise = SimpleNamespace(
            load_sd=np.array([1.0, 2.0, 9.0]), with_=lambda load_sd: SimpleNamespace(load_sd=load_sd)
        )
        linear = SimpleNamespace(covariance=lambda: np.array([[variance]]))
        return SimpleNamespace(model=Line(known), vector=np.array([slope]), noise=noise, linear=linear, drifted=drifted)

    one, two = fitted(2.0, 0.04, 10.0), fitted(5.0, 0.09, 4.0)
    apart, spread = measure.separation(one, two, known)  # type: ignore[arg-type]
    np.testing.assert_allclose(apart[:, 0], [(2 - 5 + 6) / 0.5, (6 - 15 + 6) / 0.5])
    np.testing.assert_allclose(spread[:, :, 0], [[0.2 / 0.5, 0.6 / 0.5], [0.3 / 0.5, 0.9 / 0.5]])
    np.testing.assert_array_equal(seen[0], [2.0, 2.0])
    # Other touches are not in the drifts' time.
    other = SimpleNamespace(place=np.array([1.0, 3.0, 4.0]), n_touches=3)
    apart, _ = measure.separation(one, two, other)  # type: ignore[arg-type]
    np.testing.assert_allclose(apart[:, 0], [-6.0, -18.0, -24.0])
    # Two parameters: rows of the root, one direction each.
    root = np.array([[2.0, 0.0], [1.0, 3.0]])
    pair = (SimpleNamespace(derivatives=lambda vector: (np.array([[[1.0]], [[10.0]]]), None)), None)
    left = SimpleNamespace(linear=SimpleNamespace(covariance=lambda: root @ root.T))
    white = SimpleNamespace(touches=lambda rows: rows)
    np.testing.assert_allclose(measure._uncertainty(white, left, pair).ravel(), [2 + 10, 30.0])  # type: ignore[arg-type]


@pytest.mark.parametrize(("error", "number"), [(3.0, 20), (0.5, 100), (0.01, None)])
def test_touches_that_decide_between_a_drift_and_a_place(error: float, number: int | None) -> None:
    """Two elements: 2 · 9 / 10 a touch for errors of three times the noise, 2 · 0.25 / 1.25 of half; 36 are needed."""
    drifted = np.full((4, 2), error)
    # An earlier drift is no part of the question.
    fitted = SimpleNamespace(
        drifted=9 * drifted, last_drifted=drifted, whitening=SimpleNamespace(touches=lambda rows: rows)
    )
    last = one_round(tried("a", gain=0.0), tried("baseline_drift", gain=0.0, fitted=fitted))
    last.place_or_time = (PlaceOrTime("baseline_drift", {"times": (1.0, 1.0)}),)
    found = advice((last,))
    assert found is not None and found.between == ("baseline_drift", "something in place")
    assert found.number == number
    if number is None:
        assert found.touches == UNDECIDED
    else:
        assert found.touches.startswith("at the first places again, at the end")
    last.place_or_time = (PlaceOrTime("baseline_drift", {"times": (9.0, 1.0)}),)
    assert advice((last,)) is None
