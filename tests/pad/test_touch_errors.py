"""Errors of held-out touches on a pad, worked out by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayestouch.pad import touch_errors
from bayestouch.pad.touch_errors import read_held_out

STATED = np.array([2.0, np.nan, 4.0])


def reading(monkeypatch: pytest.MonkeyPatch, stated: np.ndarray) -> Any:
    """Of three touches at 0 mm, read at 3, 0 and 4 mm, with loads of 2.5, 3 and 4 and intervals 0.2 wide."""
    means = {"x": np.array([3.0, 0.0, 4.0]), "P": np.array([2.5, 3.0, 4.0])}
    read = SimpleNamespace(
        mean=means.__getitem__,
        interval=lambda name, level: (means[name] - 0.1, means[name] + 0.1),
        sample_stats={"reference_level": np.array([0.5, 0.95, 0.2])},
    )
    monkeypatch.setattr(touch_errors, "_to_be_read", lambda *given: None)
    monkeypatch.setattr(touch_errors, "rows_of_held_out", lambda *given: np.arange(3))
    monkeypatch.setattr(touch_errors.PadEffects, "of", lambda calibration: None)
    calibration: Any = SimpleNamespace(settings={"load_measured": 1.0})
    calibration.with_rest_reading = lambda rest: calibration
    held: Any = SimpleNamespace(stated={"x": np.zeros(3), "P": stated})
    return read_held_out(lambda *given, **options: read, calibration, None, held, seed=0)  # type: ignore[arg-type]


def test_a_touch_without_a_load_leaves_the_others_theirs(monkeypatch: pytest.MonkeyPatch) -> None:
    found = reading(monkeypatch, STATED)
    np.testing.assert_allclose(found.by_touch["P_rms_N"], [0.5, np.nan, 0.0])
    np.testing.assert_allclose(found.by_touch["P_coverage_90"], [0.0, np.nan, 1.0])
    assert found.errors.P_rms_N == pytest.approx(0.5 / np.sqrt(2))
    assert found.errors.P_coverage_90 == 0.5
    assert found.errors.location_rms_mm == pytest.approx(5 / np.sqrt(3))
    assert found.errors.coverage_90 == pytest.approx(2 / 3)


def test_without_a_load_there_is_no_error_of_the_load(monkeypatch: pytest.MonkeyPatch) -> None:
    found = reading(monkeypatch, np.full(3, np.nan))
    assert np.isnan([found.errors.P_rms_N, found.errors.P_coverage_90]).all()
