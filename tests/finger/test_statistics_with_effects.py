"""Statistics of the calibration of a finger with effects, by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayestouch.finger import calibration_with_effects as module


def test_error_and_noise_are_shares_of_the_peaks_of_elements_that_are_read(monkeypatch: pytest.MonkeyPatch) -> None:
    """Peaks of 20 and 40 under 10 N/m, noise of 1 and 4: 5 % and 10 %. A third element has no reading."""
    means = SimpleNamespace(
        readings=np.array([[21.0, 42.0, np.nan], [19.0, 38.0, np.nan]]),
        counts=np.ones((2, 3), dtype=int),
        angle_deg=np.zeros(2),
        touch=np.arange(2),
        indenter_radius_mm=np.ones(2),
        load=np.full(2, 10.0),
    )
    model = SimpleNamespace(
        known=SimpleNamespace(means=means, n_touches=2),
        n_elements=3,
        n_base=0,
        layout=SimpleNamespace(response=slice(0, 3)),
        sign=-1.0,
        reference_load=10.0,
        peak=None,
        contact="layer",
        finger=None,
        effects=(),
        chain=lambda vector: SimpleNamespace(largest_load=100.0),
        predict=lambda vector: SimpleNamespace(touches=np.array([[20.0, 40.0, 0.0]] * 2)),
    )
    fitted: Any = SimpleNamespace(
        model=model,
        vector=np.log([2.0, 4.0, 1.0]),
        linear=SimpleNamespace(covariance=lambda: np.eye(3)),
        noise=SimpleNamespace(sd=np.array([1.0, 4.0, 100.0]), added=None),
        drifted=0.0,
        chi_square=lambda: 6.0,
    )
    priors = SimpleNamespace(with_stated=lambda *given: SimpleNamespace(parameters=lambda *given, **more: ()))
    stubs: dict[str, Any] = {
        "finger_model": lambda model: model,
        "_draws": lambda *given: None,
        "_public": lambda *given: ({}, {}),
        "discrepancy": lambda fitted: np.zeros(3),
        "force_noise": lambda fitted: 0.1,
        "EffectList": lambda *given: SimpleNamespace(settings={}),
        "FingerPriors": SimpleNamespace(of=lambda sensor: (priors, ())),
        "Calibration": SimpleNamespace,
    }
    for name, stub in stubs.items():
        monkeypatch.setattr(module, name, stub)
    sensor: Any = SimpleNamespace(reading_unit="mV")
    made = module.calibration_with_effects(
        fitted,
        (),
        sensor=sensor,
        setting=None,  # type: ignore[arg-type]
        rest=None,
        draws=4,
        seed=0,
    )
    # Four readings and no parameter; residuals of 1 over 20 and of 2 over 40.
    expected = {"touches": 2.0, "lack_of_fit": 6 / 4, "error_percent_peak": 5.0, "noise_percent_peak": 7.5}
    assert made.statistics == pytest.approx(expected)
