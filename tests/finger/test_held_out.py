"""Residuals of a finger's held-out touches, written out."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayestouch.finger import held_out as module
from bayestouch.model.noise import NoiseModel

NAN = np.nan


def test_residuals_of_held_out_touches(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two touches, of which the second lacks a load and a reading; a drift adds 0.5 to every reading."""
    predicted, by_load = np.array([[8.0, 2.0], [4.0, 1.0]]), np.array([[0.2, 0.1], [0.3, 0.2]])
    peak = np.array([5.0, 2.0]) * 10
    means = SimpleNamespace(
        readings=np.array([[9.0, 2.2], [5.0, NAN]]),
        counts=np.array([[4, 2], [9, 0]]),
        reads_of_load=np.array([3.0, 9.0]),
        indenter_radius_mm=np.array([6.0, 0.0]),
        angle_deg=np.array([10.0, 20.0]),
    )
    observed: Any = SimpleNamespace(
        means=means,
        load=np.array([7.0, NAN]),
        row_touch=np.zeros(0, dtype=int),
        weight=np.zeros(0),
        deviation=np.zeros((0, 2)),
        n_touches=2,
    )
    recording = SimpleNamespace(
        place=(np.array([11.0, 21.0]),), load=np.array([7.5, 8.0]), indenter_radius_mm=np.array([4.0, 1.0])
    )
    model = SimpleNamespace(
        predict=lambda vector: SimpleNamespace(touches=predicted - 0.5),
        by_load=lambda vector: by_load,
        load=np.array([7.0, 9.0]),
        chain=lambda vector: SimpleNamespace(response=np.array([-5.0, 2.0])),
        reference_load=10.0,
        poses=lambda vector: recording,
        derivatives=lambda vector: ("slopes", None),
        finger=SimpleNamespace(outer_radius_mm=12.0, element_angles_deg=(0.0, 15.0)),
        known=SimpleNamespace(means=SimpleNamespace(pure_error_dof=np.array([3.0, NAN]))),
    )
    model.observing = lambda given: model
    monkeypatch.setattr(module, "finger_model", lambda given: given)
    monkeypatch.setattr(module, "without_wrong_readings", lambda fitted, given: given)
    monkeypatch.setattr(module, "functions_at", lambda *given: (np.full((2, 2), 0.5), "functions"))
    monkeypatch.setattr(module, "design_of", lambda shown, *given: given[:2])
    monkeypatch.setattr(module, "quantities", lambda *given: given)
    monkeypatch.setattr(module, "at_stated_references", lambda fitted: SimpleNamespace(model=model, vector="stated"))
    noise = NoiseModel(np.array([0.4, 0.6]), np.zeros(1), peak)
    fitted: Any = SimpleNamespace(model=model, vector=None, noise=noise)
    monkeypatch.setattr(module, "force_noise", lambda given: 3.0)
    found = module.held_out(fitted, None, observed, peak)
    assert found.repeated
    residual = means.readings - predicted
    np.testing.assert_allclose(found.residual, residual / peak)
    # Errors of the loads: 3/sqrt(3), because three of the four samples have one; 0.3 of the mean load where no one has.
    spread = np.array([3 / np.sqrt(3), 0.3 * 8.0])
    covariance = np.diag([0.16 / 4, 0.36 / 2]) + spread[0] ** 2 * np.outer(by_load[0], by_load[0])
    assert (found.whitened[0] ** 2).sum() == pytest.approx(residual[0] @ np.linalg.solve(covariance, residual[0]))
    variance = 0.16 / 9 + (spread[1] * 0.3) ** 2
    np.testing.assert_allclose(found.whitened[1] ** 2, [1 / variance, 0.0])
    np.testing.assert_array_equal(found.present, [[True, True], [True, False]])
    np.testing.assert_allclose(found.noise_sd, [np.sqrt(np.diag(covariance)) / peak, [NAN, NAN]])
    np.testing.assert_allclose(found.load_free, [0.0, (spread[1] * 0.3) ** 2 / variance])
    # 1/R = 1/r_c + 1/r_b.
    for got, radius, angle, load in (
        (found.reference, [3.0, 12 / 13], [11.0, 21.0], [7.5, NAN]),
        (found.stated, [4.0, 0.0], [10.0, 20.0], [7.0, NAN]),
    ):
        np.testing.assert_allclose(got["R"], radius)
        np.testing.assert_array_equal(got["theta_c"], angle)
        np.testing.assert_array_equal(got["P"], load)
    _, element, at, radius_mm, force, share, of = found.quantities
    np.testing.assert_array_equal(element, [0.0, 15.0])
    np.testing.assert_array_equal(at, [11.0, 21.0])
    np.testing.assert_allclose(radius_mm, [3.0, 12 / 13])
    np.testing.assert_array_equal(force, [7.5, NAN])
    np.testing.assert_allclose(share, predicted / peak)
    np.testing.assert_array_equal(of, peak)
    assert found.design == ("slopes", "functions") and found.repeated and found.samples is None
