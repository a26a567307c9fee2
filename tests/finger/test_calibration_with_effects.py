"""What a calibration with effects says of the touches it was fitted to, and its draws."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import bayestouch
from bayestouch.chain.noise import Noise
from bayestouch.effects.stated import StatedModel
from bayestouch.finger.calibration_with_effects import fit_statistics, touch_rows
from bayestouch.model.noise import AddedNoise


def test_readings_that_are_missing_count_as_none(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing was read where the mean reading is missing, and its standard deviation has no end."""
    readings, one = np.array([[1.0, np.nan], [3.0, 4.0]]), np.zeros(2)
    means = SimpleNamespace(readings=readings, counts=np.array([[5, 5], [2, 4]]), touch=np.arange(2))
    means.angle_deg = means.indenter_radius_mm = means.load = one
    means.samples, means.reads_of_load = np.array([5.0, 4.0]), np.array([1.0, 4.0])
    model = SimpleNamespace(
        known=SimpleNamespace(means=means),
        predict=lambda vector: SimpleNamespace(touches=np.zeros((2, 2))),
        by_load=lambda vector: np.zeros((2, 2)),
        peak=np.ones(2),
    )
    finger = SimpleNamespace(finger=SimpleNamespace(near=lambda angle: angle))
    monkeypatch.setattr("bayestouch.finger.calibration_with_effects.finger_model", lambda model: finger)
    fitted: Any = SimpleNamespace(model=model, vector=one, drifted=0.0, noise=SimpleNamespace(added=AddedNoise()))
    rows = touch_rows(fitted, Noise(np.array([2.0, 2.0]), one, 0.0, 0.0))
    np.testing.assert_array_equal(rows.counts, [[5, 0], [2, 4]])
    np.testing.assert_array_equal([rows.samples, rows.load_reads], [[5.0, 4.0], [1.0, 4.0]])
    np.testing.assert_allclose(rows.sd, [[2 / np.sqrt(5), np.inf], [2 / np.sqrt(2), 1.0]])


def test_sd_of_a_reading_has_the_noise_of_effects_and_the_error_of_a_measured_load(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Own noise 2, 10 % of a signal of 50, 3 % of a peak of 100 in common, and 4 N/m at a slope of 3: by 4 samples.

    The load of the second touch was not measured: its readings are not predicted with it.
    """
    means = SimpleNamespace(readings=np.full((2, 1), 50.0), counts=np.full((2, 1), 4), touch=np.arange(2))
    means.angle_deg = means.indenter_radius_mm = np.zeros(2)
    means.load, means.samples, means.reads_of_load = np.array([10.0, np.nan]), np.full(2, 4.0), np.array([4.0, 1.0])
    model = SimpleNamespace(
        known=SimpleNamespace(means=means),
        predict=lambda vector: SimpleNamespace(touches=np.full((2, 1), 50.0)),
        by_load=lambda vector: np.full((2, 1), 3.0),
        peak=np.array([100.0]),
    )
    finger = SimpleNamespace(finger=SimpleNamespace(near=lambda angle: angle))
    monkeypatch.setattr("bayestouch.finger.calibration_with_effects.finger_model", lambda model: finger)
    noise: Any = SimpleNamespace(added=AddedNoise(share=0.1, power=1.0, common=0.03))
    fitted: Any = SimpleNamespace(model=model, vector=np.zeros(1), drifted=0.0, noise=noise)
    rows = touch_rows(fitted, Noise(np.array([2.0]), np.zeros(1), 0.0, 4.0))
    of_noise = (2.0**2 + 5.0**2 + 3.0**2) / 4
    np.testing.assert_allclose(rows.sd[:, 0] ** 2, [of_noise + (3.0 * 4.0) ** 2 / 4, of_noise])


def test_error_and_noise_are_shares_of_the_peaks_of_elements_that_are_read(monkeypatch: pytest.MonkeyPatch) -> None:
    """Peaks of 20 and 40 under 10 N/m, noise of 1 and 4: 5 % and 10 %. A third element has no reading."""
    rows: Any = SimpleNamespace(
        observed=np.array([[21.0, 42.0, np.nan], [19.0, 38.0, np.nan]]),
        predicted=np.array([[20.0, 40.0, 0.0]] * 2),
        counts=np.array([[1, 1, 0]] * 2),
    )
    model = SimpleNamespace(
        known=SimpleNamespace(n_touches=2),
        layout=SimpleNamespace(response=slice(0, 3), n_determined=lambda present: int(present.sum()) - 2),
        reference_load=10.0,
    )
    monkeypatch.setattr("bayestouch.finger.calibration_with_effects.finger_model", lambda model: model)
    fitted: Any = SimpleNamespace(model=model, vector=np.log([2.0, 4.0, 1.0]), chi_square=lambda: 6.0)
    found = fit_statistics(fitted, rows, Noise(np.array([1.0, 4.0, 100.0]), np.zeros(3), 0.0, 0.0))
    assert found["error_percent_peak"] == pytest.approx(5.0)
    assert found["noise_percent_peak"] == pytest.approx(100 * (1 / 20 + 4 / 40) / 2)
    assert found["lack_of_fit"] == pytest.approx(6 / (4 - 2))


@pytest.mark.slow
def test_two_effects_are_drawn_with_all_parameters() -> None:
    """Cross-talk and creep of a finger of four elements: grades, and the truth within the posterior."""
    design = bayestouch.FingerDesign(n_elements=4, edge_step_deg=2.0, flat_step_deg=4.0, touch_step_deg=8.0)
    made = bayestouch.simulate(design, effects={"crosstalk": 0.04, "creep": 0.05}, seed=3)
    stated = StatedModel("finger", "layer", (("crosstalk", {}), ("creep", {})))
    calibration = bayestouch.calibrate(made.dataset, model=stated, seed=1)
    assert calibration.statistics["rhat"] < 1.02 and calibration.statistics["ess_bulk"] > 400
    assert "sampler" not in calibration.settings and not calibration.notes
    draws = calibration.posterior
    for name, truth in {"crosstalk_share": 0.04, "creep_share": 0.05, "sigma": 0.46, "mu": 0.15}.items():
        # Four of them: none is four standard deviations off by chance.
        assert abs(draws[name].mean() - truth) < 4 * draws[name].std(), name
    # A share of elements further away cannot be below zero: the normal approximation would be.
    assert draws["crosstalk_reach"].min() > 0
    names = [name.removeprefix("log ") for name in calibration.layout]
    for name in ("crosstalk_share", "creep_share", "sigma"):
        row = names.index(name)
        assert np.sqrt(calibration.covariance[row, row]) == pytest.approx(draws[name].std(ddof=1), rel=1e-6)


def test_few_draws_that_are_kept_do_not_change_the_covariance() -> None:
    """It is that of 200 draws of the same chains; 8 draws alone have a rank of 7."""
    design = bayestouch.FingerDesign(n_elements=3, edge_step_deg=4.0, flat_step_deg=8.0, touch_step_deg=20.0)
    data = bayestouch.simulate(design, effects={"crosstalk": 0.04}, seed=3).dataset
    stated = StatedModel("finger", "layer", (("crosstalk", {}),))
    few, many = (bayestouch.calibrate(data, model=stated, draws=draws, seed=1) for draws in (8, 200))
    assert few.posterior["sigma"].shape == (4, 2)
    expected = np.concatenate([many.posterior["r_s"].std(axis=(0, 1), ddof=0), [many.posterior["sigma"].std()]])
    rows = [few.layout.index(name) for name in ("r_s[0]", "r_s[1]", "r_s[2]", "sigma")]
    np.testing.assert_allclose(np.sqrt(np.diag(few.covariance)[rows]), expected * np.sqrt(200 / 199))


@pytest.mark.slow
def test_an_error_that_all_elements_share_is_no_discrepancy() -> None:
    """The simulated finger is exact: draws are not where smaller discrepancies are far more probable."""
    design = bayestouch.FingerDesign(
        n_elements=4, samples_per_touch=10, noise_percent_peak=0.5, edge_step_deg=3.0, flat_step_deg=9.0
    )
    made = bayestouch.simulate(design, effects={"common_mode_noise": 0.03}, seed=3)
    model = StatedModel("finger", "layer", (("common_mode_noise", {}),))
    calibration = bayestouch.calibrate(made.dataset, model=model, draws=200)
    noise_of_mean = calibration.noise.tactile_sd / np.sqrt(10)
    found = calibration.posterior["discrepancy_sd"].mean(axis=(0, 1))
    assert np.all(found < noise_of_mean), found / noise_of_mean
    density = bayestouch.log_density(calibration, made.dataset)
    drawn = density.from_parameters({k: v.reshape(-1, *v.shape[2:]) for k, v in calibration.posterior.items()})
    smaller = drawn.copy()
    smaller[:, [name.startswith("log discrepancy_sd") for name in density.names]] -= np.log(3)
    # Where discrepancies are not seen, a third of them changes the density by their prior alone: a few nats.
    assert density(smaller).mean() < density(drawn).mean() + 5
    # The start is near the mode, which is above nearly all draws.
    assert density(density.start) > np.quantile(density(drawn), 0.5)


@pytest.mark.slow
def test_no_step_ends_where_the_model_fits_worse() -> None:
    """The readings have no slope over the breadth of a memory at zero, where a Newton step sent it to 1.

    The chains then began 600 below the mode, and stayed at discrepancies of 25 to 50 instead of 0.8: posteriors of
    touches were three to eight times too wide.
    """
    design = bayestouch.FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=10.0)
    memory = bayestouch.simulate(design, seed=3, effects={"memory": 0.1}).dataset
    model = StatedModel("finger", "", (("memory", {}),))
    made = bayestouch.calibrate(memory, model=model, draws=200)
    clean = bayestouch.calibrate(bayestouch.simulate(design, seed=3).dataset, draws=200)
    np.testing.assert_allclose(made.mode["discrepancy_sd"], clean.mode["discrepancy_sd"], rtol=0.25)
    assert made.statistics["ess_bulk"] > 100
    # Touches before the table are not known to it: its first ones are off, and said to be.
    read = bayestouch.infer(memory.touches, made, draws=256)
    error = (read.mean("theta_c") - read.reference["theta_c"])[3:]
    assert np.sqrt(np.mean((error / read.sd("theta_c")[3:]) ** 2)) == pytest.approx(1.0, abs=0.32)
