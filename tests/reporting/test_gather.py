"""Computations for a report: how many draws they keep, and what is made while effects are searched for."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import pytest
from report_cases import LINE, small

import bayestouch
from bayestouch.reporting import gather as gathering


class _Enough(Exception):
    """The calibration was asked for."""


@pytest.mark.parametrize(("of_touch", "of_calibration"), [(64, 1000), (1024, 1000), (2048, 2000), (4000, 3906)])
def test_more_draws_are_more_of_the_calibration_too(
    monkeypatch: pytest.MonkeyPatch, of_touch: int, of_calibration: int
) -> None:
    """In the ratio of the defaults, 1000 to 1024; fewer draws of a touch do not make the calibration rougher."""
    asked: dict[str, Any] = {}

    def calibrate(*_: Any, **options: Any) -> None:
        asked.update(options)
        raise _Enough

    monkeypatch.setattr("bayestouch.calibration.calibrate", calibrate)
    with pytest.raises(_Enough):
        gathering.gather(small(LINE).dataset, lambda evidence, _: evidence, seed=0, draws=of_touch, plug_in=False)
    assert asked["draws"] == of_calibration


def test_the_ratio_is_that_of_the_defaults() -> None:
    from inspect import signature

    defaults = [signature(each).parameters["draws"].default for each in (bayestouch.calibrate, bayestouch.report)]
    assert defaults == [1000, 1024]


def test_the_report_is_drafted_while_effects_are_searched_for(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The draft needs no diagnosis: the search, which takes longest, need not end before it."""
    drafted = tmp_path / "drafted"

    def search(*_: Any, **options: Any) -> bool:
        for _ in range(500):
            if drafted.exists():
                return True
            time.sleep(0.02)
        return False

    def draft(evidence: str, _: object) -> str:
        drafted.touch()
        return f"draft of {evidence}"

    monkeypatch.setattr(gathering, "_read", lambda *_: "what was read")
    monkeypatch.setattr(gathering, "light_diagnosis", search)
    made = gathering.gather(small(LINE).dataset, draft, seed=0, draws=64, plug_in=False, diagnosis=True)
    assert made == ("draft of what was read", True)


@pytest.mark.parametrize(("diagnosis", "last"), [(False, 0.95), (True, 0.5)])
def test_a_draft_takes_the_time_of_the_search_where_there_is_none(
    diagnosis: bool, last: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The bar goes from what was read, 35 %, to the files, 95 %: all but these is in the draft."""
    seen: list[float] = []

    def draft(evidence: str, progress: Any) -> str:
        for share in (0.5, 1.0):
            progress(share)
        return evidence

    monkeypatch.setattr(gathering, "_read", lambda *_: "what was read")
    monkeypatch.setattr(gathering, "light_diagnosis", lambda *_, **options: None)
    gathering.gather(
        small(LINE).dataset, draft, seed=0, draws=64, plug_in=False, diagnosis=diagnosis, progress=seen.append
    )
    assert seen[:3] == pytest.approx([0.35, (0.35 + last) / 2, last])
