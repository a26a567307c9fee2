"""Errors of held-out touches and their summaries, by hand."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayestouch.finger.touch_errors import errors_by_touch
from bayestouch.model import held_out as module
from bayestouch.model.held_out import HeldOut, design_of, free_load, rms_percent
from bayestouch.model.linear import Linearised
from bayestouch.model.noise import AddedNoise, NoiseModel
from bayestouch.model.touch_errors import summarised

NAN = np.nan


def held(**changes: Any) -> HeldOut:
    """Two touches of three elements, the last of which is dead."""
    residual = np.array([[0.03, -0.01, NAN], [0.04, NAN, NAN]])
    values: dict[str, Any] = {
        "observed": None,
        "residual": residual,
        "whitened": np.array([[2.0, 1.0, 0.0], [3.0, 0.0, 0.0]]),
        "present": np.isfinite(residual),
        "design": np.zeros((6, 0)),
        "reference": {},
        "stated": {},
        "quantities": (),
        "noise_sd": np.array([[0.01, 0.02, 9.0], [0.03, 9.0, 9.0]]),
        "load_free": np.array([0.0, 0.5]),
        "log_volume": np.zeros(2),
    }
    return HeldOut(**(values | changes))


def test_root_mean_squares_of_elements() -> None:
    """Each over its own readings, then their mean; dead ones left out."""
    wanted = 100 * (np.sqrt((0.0009 + 0.0016) / 2) + 0.01) / 2
    assert rms_percent(held().residual) == pytest.approx(wanted)
    assert held().error_percent_peak == held().touch_error_percent_peak == pytest.approx(wanted)
    assert np.isnan(rms_percent(np.full((2, 2), NAN)))


def test_errors_of_samples() -> None:
    made = held(samples=np.array([[0.02, 0.02, NAN]] * 3), noise_sd=np.array([[0.01, 0.03, NAN]] * 3))
    assert made.error_percent_peak == pytest.approx(2.0) and made.touch_error_percent_peak != made.error_percent_peak
    assert made.floor_percent_peak == pytest.approx(2.0)


def test_floor() -> None:
    """Expected error by the noise of the readings that are there; not known where that of one is not."""
    assert held().floor_percent_peak == pytest.approx(100 * (np.sqrt(0.0005) + 0.02) / 2)
    noise = held().noise_sd
    noise[0, 0] = NAN
    assert np.isnan(held(noise_sd=noise).floor_percent_peak)


def test_lack_of_fit() -> None:
    """Squares 14 over three readings, less half a one that an unknown load takes."""
    assert held().freedom == 2.5 and held().mean_square == held().lack_of_fit == pytest.approx(14 / 2.5)
    assert np.isnan(held(repeated=False).lack_of_fit) and held(repeated=False).mean_square == pytest.approx(5.6)
    assert held(load_free=np.array([1.0, 1.0])).mean_square == 14.0
    assert np.isnan(held(load_free=np.array([1.0, 1.1])).mean_square)


def test_what_an_unknown_load_takes() -> None:
    """The squared whitened length of one sd of it."""
    whitening: Any = SimpleNamespace(touches=lambda rows: 2 * rows)
    found = free_load(whitening, np.array([[0.1, 0.2], [0.3, 0.4]]), np.array([True, False]))
    np.testing.assert_allclose(found, [0.0, 4 * 0.25])


def test_design_has_the_models_covariance() -> None:
    """Its square is what parameters leave open of the predictions."""
    rng = np.random.default_rng(0)
    jacobian = rng.standard_normal((8, 2))
    linear = Linearised(
        residual=np.zeros((4, 2)),
        jacobian=jacobian,
        deviation=np.zeros((0, 2)),
        deviation_jacobian=None,
        touch=np.zeros(0, dtype=np.int64),
        pull=np.zeros(2),
        precision=np.array([0.5, 2.0]),
    )
    slopes = rng.standard_normal((2, 3, 2))
    whitening: Any = SimpleNamespace(touches=lambda rows: rows / 0.5)
    fitted: Any = SimpleNamespace(linear=linear)
    design = design_of(fitted, slopes, np.zeros((0, 3, 2)), whitening)
    columns = slopes.reshape(2, 6).T / 0.5
    covariance = np.linalg.inv(jacobian.T @ jacobian + np.diag([0.5, 2.0]))
    np.testing.assert_allclose(design @ design.T, columns @ covariance @ columns.T, rtol=1e-7)
    assert design_of(fitted, slopes[:1], np.zeros((0, 3, 2)), whitening).shape == (6, 0)


def test_errors_by_touch() -> None:
    """Intervals hold their own ends; edges, flats and unknown tips are not counted."""
    one = np.array([1.0, 2.0, 3.0, 4.0, 5.0])
    found = errors_by_touch(
        {"R": one, "theta_c": 2 * one, "P": 3 * one},
        np.array([0.5, 1.0, 0.0, 0.0, 9.0]),
        np.array([0.7, 2.0, 1.5, 9.0, 9.0]),
        {"R": np.full(5, 0.5), "theta_c": np.full(5, 1.0), "P": np.full(5, 2.0)},
        np.array([3.0, 3.0, 3.0, 0.0, np.inf]),
    )
    np.testing.assert_array_equal(found["R_bias_mm"], one - 0.5)
    np.testing.assert_array_equal(found["R_rms_mm"], one - 0.5)
    np.testing.assert_array_equal(found["theta_rms_deg"], 2 * one - 1)
    np.testing.assert_array_equal(found["P_rms_N_per_m"], 3 * one - 2)
    np.testing.assert_array_equal(found["coverage_90"], [1, 0, 1, NAN, NAN])


def test_summaries() -> None:
    values = np.array([3.0, NAN, -4.0])
    assert summarised("R_rms_mm", values) == pytest.approx(np.sqrt(12.5)) and summarised("R_bias_mm", values) == -0.5
    assert np.isnan(summarised("coverage_90", np.array([NAN])))
    assert replace(held(), repeated=True).repeated


def test_touches_without_wrong_readings(monkeypatch: pytest.MonkeyPatch) -> None:
    """What effects of the noise take to be wrong, by the deviations from the medians and the noise of the fit."""
    seen: list[Any] = []
    monkeypatch.setattr(module, "from_prediction", lambda table, samples: f"from {table} and {samples}")
    outliers = SimpleNamespace(wrong=lambda *given: seen.append(given) or "wrong")
    other = SimpleNamespace(wrong=lambda *given: None)
    observed: Any = SimpleNamespace(table="table", without=lambda wrong: f"without {wrong}")
    effects = ((other, (1.0,)), (outliers, (0.1, 0.2)))
    noise = SimpleNamespace(sd="sd", peak="peak", effects=effects, added=AddedNoise())
    there = SimpleNamespace(predict=lambda vector: SimpleNamespace(samples=vector, touches=np.array([[0.0], [50.0]])))
    model = SimpleNamespace(observing=lambda rows: there if rows is observed else None)
    fitted: Any = SimpleNamespace(noise=noise, model=model, vector="samples")
    assert module.without_wrong_readings(fitted, observed) == "without wrong"  # type: ignore[comparison-overlap]
    assert seen == [("from table and samples", "sd", "peak", (0.1, 0.2))]
    # Beside noise that grows with the signal, each sample has the sd of its touch: 4, and √(4² + (0.06 · 50)²) = 5.
    observed.row_touch = np.array([0, 1, 1])
    # An error of a whole touch is in its median, too.
    added = AddedNoise(share=0.06, common_touch=0.5)
    fitted.noise = NoiseModel(np.array([4.0]), np.ones(2), np.array([100.0]), added, effects=effects)
    module.without_wrong_readings(fitted, observed)
    np.testing.assert_allclose(seen[1][1], [[4.0], [5.0], [5.0]])
    fitted.noise = NoiseModel(np.array([4.0]), np.ones(2), np.array([100.0]), effects=effects[:1])
    assert module.without_wrong_readings(fitted, observed) is observed


def test_weights_of_a_correction_follow_those_of_the_drifts(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two drifts, and a correction of one function: 2 a + 3 b + 5 c, where the fit's own list has all three."""
    drifts = np.array([[[1.0, 0.0]], [[0.0, 1.0]]])
    own = np.array([[[10.0, 100.0]]])
    monkeypatch.setattr(module, "drift_columns", lambda model, vector, drifts_: drifts)
    model: Any = SimpleNamespace(observing=lambda observed: model, correction_inputs=lambda vector: (1, 2))
    fitted: Any = SimpleNamespace(
        model=model, vector=None, drifts=(), linear=SimpleNamespace(weights=lambda: np.array([2.0, 3.0, 5.0]))
    )
    correction: Any = SimpleNamespace(columns=lambda *inputs: own)
    total, functions = module.functions_at(fitted, correction, SimpleNamespace())  # type: ignore[arg-type]
    np.testing.assert_allclose(total, [[52.0, 503.0]])
    assert functions.shape == (3, 1, 2)
