"""Rounds of a search."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from bayestouch.diagnosis.place_or_time import PlaceOrTime
from bayestouch.diagnosis.rounds import SearchRound, with_undecided_drift


def last_round(*across: tuple[float, float]) -> SearchRound:
    """Two drifts, best first, whose differences across times and places have a standard error of one."""
    names = ("baseline_drift", "gain_drift")
    tried: Any = tuple(SimpleNamespace(effect=SimpleNamespace(name=name)) for name in names)
    faced = tuple(
        PlaceOrTime(name, {"times": (times, 1.0), "places": (places, 1.0)})
        for name, (times, places) in zip(names, across, strict=True)
    )
    before: Any = object()
    return SearchRound(before, tried, 0.0, None, 0.0, 0.0, None, place_or_time=faced)


@pytest.mark.parametrize(
    ("across", "begun"),
    [
        (((1.0, 1.5), (1.9, 0.1)), "baseline_drift"),
        (((1.0, -0.5), (1.9, 0.1)), "gain_drift"),  # the first one is not ahead across places
        (((3.0, 1.0), (-3.0, 0.0)), None),  # both are decided
    ],
)
def test_a_search_goes_on_with_a_drift_that_is_ahead(
    across: tuple[tuple[float, float], ...], begun: str | None
) -> None:
    last = last_round(*across)
    rounds = with_undecided_drift(last)
    assert [each.added.effect.name for each in rounds if each.added] == ([begun] if begun else [])
    assert all(each.before is last.before for each in rounds)
