"""Computations for a report: how many draws they keep."""

from __future__ import annotations

from typing import Any

import pytest
from report_cases import LINE, small

import bayestouch
from bayestouch.reporting.gather import gather


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
        gather(small(LINE).dataset, seed=0, draws=of_touch, plug_in=False)
    assert asked["draws"] == of_calibration


def test_the_ratio_is_that_of_the_defaults() -> None:
    from inspect import signature

    defaults = [signature(each).parameters["draws"].default for each in (bayestouch.calibrate, bayestouch.report)]
    assert defaults == [1000, 1024]
