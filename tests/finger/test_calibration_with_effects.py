"""What a calibration with effects says of the touches it was fitted to."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayestouch.finger import calibration_with_effects as module


class Enough(Exception):
    """The rows are made: what comes after them is not looked at."""


def test_readings_that_are_missing_count_as_none(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing was read where the mean reading is missing, and its standard deviation has no end."""
    readings, one = np.array([[1.0, np.nan], [3.0, 4.0]]), np.zeros(2)
    means = SimpleNamespace(readings=readings, counts=np.array([[5, 5], [2, 4]]), touch=np.arange(2))
    means.angle_deg = means.indenter_radius_mm = means.load = one
    model = SimpleNamespace(
        known=SimpleNamespace(means=means),
        n_elements=2,
        layout=SimpleNamespace(response=slice(0, 2)),
        sign=1.0,
        chain=lambda vector: None,
        predict=lambda vector: SimpleNamespace(touches=np.zeros((2, 2))),
    )
    fitted: Any = SimpleNamespace(
        model=model,
        vector=one,
        drifted=0.0,
        linear=SimpleNamespace(covariance=lambda: np.eye(2)),
        noise=SimpleNamespace(sd=np.array([2.0, 2.0]), added=None),
    )
    rows: dict[str, Any] = {}

    def keep(**columns: Any) -> None:
        rows.update(columns)
        raise Enough

    monkeypatch.setattr(module, "TouchRows", keep)
    monkeypatch.setattr(module, "finger_model", lambda model: model)
    monkeypatch.setattr(module, "_draws", lambda *given: None)
    monkeypatch.setattr(module, "discrepancy", lambda fitted: one)
    monkeypatch.setattr(module, "force_noise", lambda fitted: 0.0)
    sensor: Any = None
    setting: Any = None
    with pytest.raises(Enough):
        module.calibration_with_effects(fitted, (), sensor=sensor, setting=setting, rest=None, draws=4, seed=0)
    np.testing.assert_array_equal(rows["counts"], [[5, 0], [2, 4]])
    np.testing.assert_allclose(rows["sd"], [[2 / np.sqrt(5), np.inf], [2 / np.sqrt(2), 1.0]])
