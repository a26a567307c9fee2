"""Probabilities of causes that allow for imitations: sums by hand, and over all ways to be there or not."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bayestouch.diagnosis import imitations
from bayestouch.diagnosis.causes import IN_TIME, IN_TOUCHES, NOTHING, Causes
from bayestouch.diagnosis.imitations import SHARES, SOMETHING_ELSE, Named, by_chance, with_imitations
from bayestouch.diagnosis.place_or_time import IN_PLACE

NAMES = ("creep", "memory", "gain_drift", IN_TIME)
LEFT, NOT_LEFT = SHARES[True], SHARES[False]


def split(
    *found: tuple[tuple[str, ...], float],
    named: tuple[str, ...] = (),
    structure_left: bool = False,
    not_distinguishable: tuple[tuple[str, ...], ...] = (),
) -> dict[tuple[str, ...], float]:
    sets = with_imitations([Causes(*each) for each in found], Named(named, structure_left, not_distinguishable))
    return {each.names: each.probability for each in sets}


def test_one_effect_is_there_or_something_else_is() -> None:
    for left, of in SHARES.items():
        assert split((("creep",), 1.0), named=("creep",), structure_left=left) == pytest.approx(
            {
                ("creep",): of.alone * (1 - of.more),
                ("creep", SOMETHING_ELSE): of.alone * of.more,
                (SOMETHING_ELSE,): 1 - of.alone,
            }
        )


def test_a_second_effect_may_repair_the_formula_of_the_first() -> None:
    """By hand; where the verdict names none and finds structure, it is the same as where it names both."""
    first, more = LEFT.first, LEFT.more
    sets = (("creep", "memory", IN_PLACE), 0.6), (("creep", IN_PLACE), 0.4)
    there = {
        ("creep", IN_PLACE): 0.6 * first * (1 - LEFT.beside) + 0.4 * LEFT.alone,
        ("creep", "memory", IN_PLACE): 0.6 * first * LEFT.beside,
        ("memory", IN_PLACE): 0.6 * (1 - first) * LEFT.instead,
    }
    wanted = {
        **{names: (1 - more) * each for names, each in there.items()},
        **{(*names, SOMETHING_ELSE): more * each for names, each in there.items()},
        (SOMETHING_ELSE,): 1 - sum(there.values()),
    }
    for named in (("creep", "memory"), ()):
        found = split(*sets, named=named, structure_left=True)
        assert found == pytest.approx(wanted)
        assert list(found.values()) == sorted(found.values(), reverse=True)


def test_an_effect_that_was_passed_over_has_a_share_of_its_own() -> None:
    """Beside an effect that is named, and where none is: without structure nothing is there then."""
    beside = split((("creep", "memory"), 1.0), named=("creep",))
    of = NOT_LEFT
    assert sum(p for names, p in beside.items() if "memory" in names) == pytest.approx(of.passed_over)
    assert beside["creep",] == pytest.approx(of.alone * (1 - of.passed_over) * (1 - of.more))
    assert beside[SOMETHING_ELSE,] == pytest.approx((1 - of.alone) * (1 - of.passed_over))
    none = split(((NOTHING,), 0.8), (("memory",), 0.2))
    assert none[NOTHING,] == pytest.approx(0.8 + 0.2 * (1 - of.passed_over))
    assert none["memory",] == pytest.approx(0.2 * of.passed_over * (1 - of.more))
    assert SOMETHING_ELSE not in {names[0] for names in none}
    instead = split((("memory",), 1.0), named=("creep",), structure_left=True)
    assert instead[SOMETHING_ELSE,] == pytest.approx(1 - LEFT.passed_over)


def test_something_in_time_that_was_passed_over_has_another_share() -> None:
    found = split((("creep", IN_TIME), 1.0), named=("creep",), structure_left=True)
    assert sum(p for names, p in found.items() if IN_TIME in names) == pytest.approx(LEFT.in_time)


def test_a_cause_that_is_not_distinguishable_is_not_passed_over() -> None:
    """In place of the other it counts as named; beside it, it was passed over."""
    sets = ((IN_TIME,), 0.5), (("creep", IN_TIME), 0.25), (("creep",), 0.25)
    found = split(*sets, named=("creep",), not_distinguishable=(("creep", IN_TIME),))
    of = NOT_LEFT
    assert found[IN_TIME,] == pytest.approx((0.5 * of.alone + 0.25 * of.in_time * (1 - of.alone)) * (1 - of.more))
    assert found["creep",] == pytest.approx((0.25 + 0.25 * (1 - of.in_time)) * of.alone * (1 - of.more))
    undecided = split(
        (("creep", IN_TIME), 1.0),
        named=("creep",),
        structure_left=True,
        not_distinguishable=((IN_TIME, IN_PLACE),),
    )
    there = LEFT.first * LEFT.beside
    assert undecided["creep", IN_TIME] == pytest.approx(there * (1 - LEFT.more))


def test_a_rival_that_is_not_named_opens_nothing() -> None:
    """Nor does something in place where nothing is named and no structure is left."""
    of = NOT_LEFT
    dropped = split((("memory",), 1.0), named=("creep",), not_distinguishable=(("gain_drift", "memory"),))
    assert dropped["memory",] == pytest.approx(of.passed_over * (1 - of.more))
    nothing = split(((IN_TIME,), 1.0), not_distinguishable=((IN_TIME, IN_PLACE),))
    assert nothing[NOTHING,] == pytest.approx(1 - of.in_time)


def test_something_in_single_touches_has_the_share_of_a_drift_that_was_not_added() -> None:
    """It is no effect that could hide in a place, and it is passed over as often as something in time."""
    found = split((("creep", IN_TOUCHES), 1.0), named=("creep",), structure_left=True)
    assert sum(p for names, p in found.items() if IN_TOUCHES in names) == pytest.approx(LEFT.in_time)
    alone = split(((IN_TOUCHES,), 0.6), ((IN_PLACE,), 0.4), structure_left=True)
    assert alone[IN_TOUCHES,] == pytest.approx(0.6 * LEFT.alone * (1 - LEFT.more))
    rest = 1 - LEFT.unlisted
    assert alone[SOMETHING_ELSE,] == pytest.approx(0.4 * rest + 0.6 * (1 - LEFT.alone))


def test_nothing_is_left_as_it_is_and_a_place_alone_may_be_an_effect() -> None:
    found = split(((NOTHING,), 0.8), ((IN_PLACE,), 0.2))
    assert found[NOTHING,] == 0.8
    assert found[IN_PLACE,] == pytest.approx(0.2 * NOT_LEFT.unlisted)
    assert found[SOMETHING_ELSE,] == pytest.approx(0.2 * (1 - NOT_LEFT.unlisted))


def test_the_effect_that_predicted_best_may_hide_in_the_place() -> None:
    """A drift that was not added has no name of an effect, and a set of two is none that predicted best by itself."""
    sets = ((IN_PLACE,), 0.9), ((IN_TIME,), 0.1), (("creep", IN_PLACE), 0.0), (("memory",), 0.0), (("creep",), 0.0)
    found = split(*sets, structure_left=True)
    assert found["memory",] == pytest.approx(0.9 * LEFT.hidden)
    assert found[IN_PLACE,] == pytest.approx(0.9 * LEFT.unlisted)
    assert found["creep",] == 0.0
    rest = 1 - LEFT.unlisted - LEFT.hidden
    assert found[SOMETHING_ELSE,] == pytest.approx(0.9 * rest + 0.1 * (1 - LEFT.alone))


@given(
    st.lists(st.permutations(NAMES), min_size=1, max_size=3),
    st.integers(1, 4),
    st.lists(st.sampled_from(NAMES[:3]), unique=True),
    st.booleans(),
)
def test_each_cause_is_there_with_its_share(
    orders: list[list[str]], length: int, named: list[str], structure_left: bool
) -> None:
    """Probabilities sum to one; each is there with its share, by whether it is named, and by what is named before."""
    shares = SHARES[structure_left]
    found = [(tuple(order[:length]), 1 / len(orders)) for order in orders]
    after = split(*found, named=tuple(named), structure_left=structure_left)
    assert sum(after.values()) == pytest.approx(1)
    every = structure_left and not named

    def share(name: str, names: tuple[str, ...]) -> float:
        chosen = [each for each in names if every or each in named]
        if name not in chosen:
            return shares.in_time if name == IN_TIME else shares.passed_over
        second = shares.first * shares.beside + (1 - shares.first) * shares.instead
        of_each = [shares.first, second, shares.further, shares.further] if chosen[1:] else [shares.alone]
        return of_each[chosen.index(name)]

    for name in NAMES:
        wanted = sum(p * share(name, names) for names, p in found if name in names)
        assert sum(p for names, p in after.items() if name in names) == pytest.approx(wanted)


@pytest.mark.parametrize(
    ("found", "name"),
    [
        ((("creep",), 0.64), "creep"),  # times 0.79 it is more than a half
        ((("creep",), 0.62), None),
        (((NOTHING,), 1.0), None),
        (((IN_PLACE,), 1.0), None),
        (((IN_TIME,), 1.0), None),
        (((IN_TOUCHES,), 1.0), None),
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


@pytest.mark.parametrize("p_value", [1e-12, 1e-4, 0.004, 0.2])
def test_chance_has_the_least_marginal_likelihood_ratio_of_its_p_value(p_value: float) -> None:
    """Over all beta densities of p that fall: the minimum is found on a grid of their exponents."""
    exponent = np.linspace(1e-3, 1, 200_000)
    ratio = (1 / (exponent * p_value ** (exponent - 1))).min()
    assert by_chance(p_value, 20) == pytest.approx(20 * ratio / (1 + 20 * ratio), rel=1e-4)


def test_chance_has_the_prior_odds_where_the_test_says_nothing() -> None:
    assert by_chance(0.6, 20) == pytest.approx(20 / 21)
    assert by_chance(float("nan"), 20) == 1
    assert by_chance(0.0, 20) == 0


def test_nothing_that_a_lack_of_fit_contradicts_is_something_else() -> None:
    """Of a large lack of fit all of it; the sum stays one."""
    sets = [Causes((NOTHING,), 0.9), Causes(("creep",), 0.1)]
    named = Named((), structure_left=True, chance=by_chance(1e-30, 20))
    found = {each.names: each.probability for each in with_imitations(sets, named)}
    assert found[NOTHING,] < 1e-25
    assert found[SOMETHING_ELSE,] == pytest.approx(0.9 + 0.1 * (1 - LEFT.alone))
    assert sum(found.values()) == pytest.approx(1)
    shared = with_imitations(sets, Named((), structure_left=True, chance=0.25))
    assert {each.names: each.probability for each in shared}[NOTHING,] == pytest.approx(0.225)
