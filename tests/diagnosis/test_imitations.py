"""Probabilities of causes that allow for imitations: sums by hand, and over all ways to be there or not."""

from __future__ import annotations

from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bayestouch.diagnosis import imitations
from bayestouch.diagnosis.causes import IN_TIME, NOTHING, Causes
from bayestouch.diagnosis.imitations import NOTHING_LEFT, SOMETHING_ELSE, STRUCTURE_LEFT, with_imitations
from bayestouch.diagnosis.place_or_time import IN_PLACE

NAMES = ("creep", "memory", "gain_drift", IN_TIME)


def split(*found: tuple[tuple[str, ...], float], structure_left: bool = False) -> dict[tuple[str, ...], float]:
    sets = with_imitations([Causes(*each) for each in found], structure_left)
    return {each.names: each.probability for each in sets}


def test_one_effect_is_there_or_something_else_is() -> None:
    assert split((("creep",), 1.0)) == pytest.approx(
        {("creep",): NOTHING_LEFT.first, (SOMETHING_ELSE,): 1 - NOTHING_LEFT.first}
    )
    assert split((("creep",), 1.0), structure_left=True)["creep",] == pytest.approx(STRUCTURE_LEFT.first)


def test_a_later_effect_may_repair_the_formula_of_the_first() -> None:
    first, later = STRUCTURE_LEFT.first, STRUCTURE_LEFT.later
    found = split((("creep", "memory", IN_PLACE), 0.6), (("creep", IN_PLACE), 0.4), structure_left=True)
    assert found == pytest.approx(
        {
            ("creep", IN_PLACE): 0.6 * first * (1 - later) + 0.4 * first,
            ("creep", "memory", IN_PLACE): 0.6 * first * later,
            ("memory", IN_PLACE): 0.6 * (1 - first) * later,
            (SOMETHING_ELSE,): 0.6 * (1 - first) * (1 - later) + 0.4 * (1 - first),
        }
    )
    assert list(found.values()) == sorted(found.values(), reverse=True)


def test_nothing_is_left_as_it_is_and_a_place_alone_may_be_an_effect() -> None:
    found = split(((NOTHING,), 0.8), ((IN_PLACE,), 0.2))
    assert found[NOTHING,] == 0.8
    assert found[IN_PLACE,] == pytest.approx(0.2 * NOTHING_LEFT.in_place)
    assert found[SOMETHING_ELSE,] == pytest.approx(0.2 * (1 - NOTHING_LEFT.in_place))


def test_the_effect_that_predicted_best_may_hide_in_the_place() -> None:
    """A drift that was not added has no name of an effect, and a set of two is none that predicted best by itself."""
    sets = ((IN_PLACE,), 0.9), ((IN_TIME,), 0.1), (("creep", IN_PLACE), 0.0), (("memory",), 0.0), (("creep",), 0.0)
    found = split(*sets, structure_left=True)
    assert found["memory",] == pytest.approx(0.9 * STRUCTURE_LEFT.hidden)
    assert found[IN_PLACE,] == pytest.approx(0.9 * STRUCTURE_LEFT.in_place)
    assert found["creep",] == 0.0
    rest = 1 - STRUCTURE_LEFT.in_place - STRUCTURE_LEFT.hidden
    assert found[SOMETHING_ELSE,] == pytest.approx(0.9 * rest + 0.1 * (1 - STRUCTURE_LEFT.first))


@given(st.lists(st.permutations(NAMES), min_size=1, max_size=3), st.integers(1, 4), st.booleans())
def test_each_cause_is_there_with_its_share(orders: list[list[str]], length: int, structure_left: bool) -> None:
    """Probabilities sum to one; what is named first, or later, is there with its share, whatever else is named."""
    shares = STRUCTURE_LEFT if structure_left else NOTHING_LEFT
    found = [(tuple(order[:length]), 1 / len(orders)) for order in orders]
    after = split(*found, structure_left=structure_left)
    assert sum(after.values()) == pytest.approx(1)
    for name in NAMES:
        wanted = sum(p * (shares.first if names[0] == name else shares.later) for names, p in found if name in names)
        assert sum(p for names, p in after.items() if name in names) == pytest.approx(wanted)


@pytest.mark.parametrize(
    ("found", "name"),
    [
        ((("creep",), 0.66), "creep"),  # times 0.77 it is more than a half
        ((("creep",), 0.64), None),
        (((NOTHING,), 1.0), None),
        (((IN_PLACE,), 1.0), None),
        (((IN_TIME,), 1.0), None),
    ],
)
def test_an_effect_that_is_more_probable_than_all_else(
    monkeypatch: pytest.MonkeyPatch, found: tuple[tuple[str, ...], float], name: str | None
) -> None:
    one = SimpleNamespace(before=SimpleNamespace(names=()))
    rest = Causes(("memory",), 1 - found[1])
    monkeypatch.setattr(imitations, "causes", lambda rounds: [Causes(*found), rest] if rounds == (one,) else [])
    assert imitations.most_probable_alone(one) == name  # type: ignore[arg-type]


def test_after_another_effect_none_is() -> None:
    assert imitations.most_probable_alone(SimpleNamespace(before=SimpleNamespace(names=("creep",)))) is None  # type: ignore[arg-type]
