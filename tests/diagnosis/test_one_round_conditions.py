"""Conditions for an effect to be real, at their limits."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
from scipy.special import ndtri
from search_cases import DRIFT, tried

from bayestouch.diagnosis import choice, comparison, one_round


def test_settings() -> None:
    """What docs/diagnosis.md says of a round rests on these."""
    assert (one_round.CHANCE, one_round.MATERIAL, one_round.SHARE) == (0.01, 0.1, 0.3)
    assert (one_round.LEADING, one_round.VISIBLE, comparison.MOST_OF_A_TOUCH) == (5, 0.2, 10.0)
    assert (choice.INDISTINGUISHABLE, choice.NEARLY) == (2.0, 0.9)


@pytest.mark.parametrize(("readings", "least"), [(1000, 5.0), (10_000, 50.0), (20_000, 50.0)])
def test_least_gain(readings: int, least: float) -> None:
    """Half the squares of a tenth of the noise: n/200, and no more than 50."""
    assert one_round.smallest_gain(SimpleNamespace(n_readings=readings)) == pytest.approx(least)  # type: ignore[arg-type]


@pytest.mark.parametrize("trials", [1, 40])
def test_chance_of_the_best_of_many_trials(trials: int) -> None:
    """1 - (1 - p)^n = 0.01, on both sides of zero."""
    limit = -float(ndtri(0.5 * (1 - 0.99 ** (1 / trials))))
    for sign in (1, -1):
        assert one_round._passes(sign * limit * (1 + 1e-6), trials)
        assert not one_round._passes(sign * limit * (1 - 1e-6), trials)


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
    assert one_round._is_real(tried(**changes), 10, 20.0, None) == real


@pytest.mark.parametrize(
    ("changes", "real"),
    [
        ({"clear": False, "share": 0.0}, True),
        ({"effect": DRIFT, "seen": 0.2}, False),
        ({"z": 2.0}, False),
        ({"gain": 19.9}, False),
    ],
)
def test_what_is_probable_need_not_explain_a_share(changes: dict[str, Any], real: bool) -> None:
    """It must be no chance, and of relevant size. The drift is not the effect that is probable."""
    assert one_round._is_real(tried(**changes), 10, 20.0, "one") == real


@pytest.mark.parametrize(
    ("gain", "share", "near"),
    [(0.0, 0.3, False), (0.5, 0.3, True), (29, 0.29, False)],
)
def test_what_is_near(gain: float, share: float, near: bool) -> None:
    """It gains something, though not clearly, and explains enough."""
    assert one_round.is_near(tried(gain=gain, share=share, clear=False)) == near
    assert not one_round.is_near(tried(gain=gain, share=share))


def test_share_of_what_can_be_explained() -> None:
    """By the means where it was refitted, by all where it shows by itself, else by the score; between 0 and 1."""
    scored: Any = SimpleNamespace(gain=10.0)
    assert one_round._share(tried(of_means=50), scored, 200.0) == 0.25
    assert one_round._share(tried(of_means=50, by_itself=True), scored, 200.0) == 0.3
    assert one_round._share(tried(gain=float("nan")), scored, 200.0) == 0.05
    assert one_round._share(tried(of_means=300), scored, 200.0) == 1.0
    assert one_round._share(tried(of_means=-300), scored, 200.0) == 0.0
