"""Summary of `bayestouch infer`."""

from __future__ import annotations

import math

import pytest

from bayestouch.commands.infer import mixing


@pytest.mark.parametrize(
    ("rhat", "words"),
    [(1.0149, "R-hat 1.015 or less"), (math.inf, "chains not mixed"), (math.nan, "chains not mixed")],
)
def test_chains_that_did_not_move_are_said_in_words(rhat: float, words: str) -> None:
    assert mixing(rhat) == words
