"""Simulated sensors with effects: values, and readings against written-out ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

import bayestouch
from bayestouch.chain.recording import Recording
from bayestouch.effects.random import RandomEffect
from bayestouch.effects.readout import Memory
from bayestouch.errors import InputError
from bayestouch.model.timing import Timing
from bayestouch.simulation import FingerDesign, PadDesign
from bayestouch.simulation_based_calibration.calibrations import CalibrationDesign, simulate_calibration
from bayestouch.simulation_based_calibration.effects import drift_of
from bayestouch.simulation_based_calibration.pads import GAIN_FACTOR, OFFSET_SHARE, PLACE_MM, PadCalibrationDesign

FINGER = FingerDesign(
    n_elements=3,
    samples_per_touch=4,
    calibration_span_deg=24.0,
    edge_step_deg=4.0,
    flat_step_deg=8.0,
    touch_radii_mm=(3.9,),
    touch_span_deg=2.0,
    contact="hertz",
)
LINE = PadDesign(
    element_x_mm=(0.0, 5.0, 10.0), element_y_mm=None, samples_per_touch=4, calibration_step_mm=0.75, n_touches=2
)


def finger_design(*effects: str) -> CalibrationDesign:
    return CalibrationDesign.of(bayestouch.simulate(FINGER, seed=1).dataset, {}, "hertz", 100, 1, effects)


@pytest.fixture(scope="module")
def pad_design() -> PadCalibrationDesign:
    return PadCalibrationDesign.of(bayestouch.simulate(LINE, seed=1).dataset, "gaussian", 100, 1, ("creep",))


def test_values_are_drawn_from_the_documented_priors() -> None:
    """Share normal of sd 0.1, reach uniform to 1, lean normal of sd 0.2 within 0.8; a drift's sd half-normal."""
    added, rng = finger_design("crosstalk", "baseline_drift", "gain_drift").added, np.random.default_rng(1)
    drawn = [added.named(added.draw(rng)) for _ in range(2000)]
    values = {name: np.array([float(each[name]) for each in drawn]) for name in drawn[0]}
    documented = {
        "crosstalk_share": stats.norm(0, 0.1),
        "crosstalk_reach": stats.uniform(0, 1),
        "crosstalk_lean": stats.truncnorm(-4, 4, 0, 0.2),
        "baseline_drift_sd": stats.halfnorm(0, 0.05),
    }
    for name, distribution in documented.items():
        assert stats.kstest(values[name], distribution.cdf).pvalue > 1e-3, name
    assert set(values["gain_drift_own"]) == {0.0, 1.0}


def test_readings_have_crosstalk_and_creep() -> None:
    """Written out: each element has its neighbours' shares, and every reading creeps from the start of its touch."""
    design = finger_design("creep", "crosstalk")
    means, signal = design.touches.averaged(), np.random.default_rng(4).normal(size=(20, 3))
    values = ((0.2, 0.8), (0.05, 0.3, -0.4))
    found = design.added.readings(
        values,
        design.touches,
        means,
        (np.array([-8.8, 0.0, 8.8]),),
        (means.angle_deg,),
        means.load,
        np.ones(3),
        lambda recording: signal,
        lambda clean, rng: clean,
        np.random.default_rng(1),
    )
    up, down = 0.05 * (1 - 0.4), 0.05 * (1 + 0.4)
    leaks = np.array([[1, down, down * 0.3], [up, 1, down], [up * 0.3, up, 1]])
    creep = 1 + 0.2 * (1 - np.exp(-0.25 * design.touches.sample / 0.8))
    rows = np.repeat(signal, 4, axis=0)
    np.testing.assert_allclose(found, rows @ leaks.T * creep[:, None], rtol=1e-12)


def test_a_constant_kernel_needs_three_places_only() -> None:
    """Its elements have a gain and an offset, and no place of their own."""
    sparse = bayestouch.PadDesign(
        element_x_mm=(0.0, 8.0, 16.0), element_y_mm=None, margin_mm=2.0, calibration_step_mm=10.0, n_touches=4
    )
    dataset = bayestouch.simulate(sparse, seed=1).dataset
    assert len(np.unique(dataset.calibration.x_mm)) == 3
    assert PadCalibrationDesign.of(dataset, "constant", 8, 0).kernel.name == "constant"
    with pytest.raises(bayestouch.InputError, match="gain, offset and position of each element need at least 4"):
        PadCalibrationDesign.of(dataset, "gaussian", 8, 0)


@pytest.mark.parametrize("on_pad", [False, True])
def test_readings_have_what_measured_touches_left(on_pad: bool) -> None:
    """Written out in the order of time: what is left of the means of earlier touches, with their noise and gaps."""
    if on_pad:
        design: CalibrationDesign | PadCalibrationDesign = PadCalibrationDesign.of(
            bayestouch.simulate(LINE, seed=1).dataset, "gaussian", 100, 1, ("memory",)
        )
    else:
        design = finger_design("memory")
    touches, (memory,) = design.touches, design.added.effects
    assert isinstance(memory, Memory)
    means, noise = touches.averaged(), np.random.default_rng(5).normal(0.0, 0.3, touches.readings.shape)
    noise[:4, 1] = np.nan
    signal = np.random.default_rng(4).normal(size=(means.n_touches, 3))
    share, time = 0.2, 2 * memory.pause_s
    found = design.added.readings(
        ((share, time, 0.0),),
        touches,
        means,
        (np.array([-8.8, 0.0, 8.8]),),
        (means.load,),
        means.load,
        np.ones(3),
        lambda recording: signal,
        lambda clean, rng: clean + noise,
        np.random.default_rng(1),
    )
    clock, expected = Timing.of(touches), np.empty_like(noise)
    left, end = np.zeros(3), 0.0
    for t, touch in enumerate(means.touch):
        rows = touches.touch == touch
        since = clock.time_s[rows, None] - end
        after_pause = np.exp(-memory.pause_s / time)
        expected[rows] = signal[t] + share * left * np.exp(-since / time) / after_pause + noise[rows]
        left = left * np.exp(-since[-1] / time) + np.nan_to_num(expected[rows]).mean(axis=0)
        end = clock.time_s[rows][-1]
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)


def test_the_finger_is_the_same_with_effects_as_without() -> None:
    """Parameters come first from the random numbers; the values of effects are among the truth."""
    design = finger_design("crosstalk")
    true, loads, touches = simulate_calibration(design, np.random.default_rng(4))
    quiet = replace(design, added=replace(design.added, effects=()))
    plain, same, _ = simulate_calibration(quiet, np.random.default_rng(4))
    assert set(true) - set(plain) == {"crosstalk_share", "crosstalk_reach", "crosstalk_lean"}
    for name, value in plain.items():
        np.testing.assert_array_equal(true[name], value)
    np.testing.assert_array_equal(loads, same)
    assert design.model is not None and quiet.model is None
    assert touches.readings.shape == (80, 3)


def test_readings_of_a_pad_are_those_of_its_kernel(pad_design: PadCalibrationDesign) -> None:
    """Load times gain times a Gaussian of the distance, creep, offset and noise: mean squares over 200 pads."""
    rng, scores = np.random.default_rng(2), []
    for _ in range(200):
        true, touches = pad_design.simulated(rng)
        distance = touches.x_mm[:, None] - true["x_s"]
        kernel = np.exp(-0.5 * (distance / true["w"]) ** 2)
        creep = 1 + true["creep_share"] * (1 - np.exp(-touches.sample * 0.25 / true["creep_time"]))
        clean = true["offset"] + touches.load[:, None] * true["gain"] * kernel * creep[:, None]
        # The load of a row has noise of 0.01 N.
        sd = np.hypot(pad_design.noise_sd, 0.0)
        off = (touches.readings - clean)[np.abs(kernel).max(axis=1) < 0.02]
        scores.append((off**2).sum(axis=0) / sd**2 / max(len(off), 1) if len(off) else np.full(3, np.nan))
    # A log-normal factor of 1.5 has the mean square exp(2 log(1.5)²) = 1.39.
    assert np.nanmean(scores) == pytest.approx(np.exp(2 * np.log(1.5) ** 2), rel=0.2)


def test_readings_that_a_pad_lacks_are_not_simulated(pad_design: PadCalibrationDesign) -> None:
    """Also an element's whole touch; what is there is the same to the last bit."""
    touches = pad_design.touches
    readings = touches.readings.copy()
    readings[::7, 1] = np.nan
    readings[touches.touch == touches.touch[0], 2] = np.nan
    gaps = replace(pad_design, touches=touches.with_(readings=readings))
    (true, found), (same, whole) = (each.simulated(np.random.default_rng(5)) for each in (gaps, pad_design))
    np.testing.assert_array_equal(found.readings, np.where(np.isnan(readings), np.nan, whole.readings))
    np.testing.assert_array_equal(true["gain"], same["gain"])


def test_gains_offsets_and_places_of_pads_are_drawn_from_the_stated_priors(pad_design: PadCalibrationDesign) -> None:
    drawn = [pad_design.simulated(np.random.default_rng(seed))[0] for seed in range(300)]
    gain = np.log([each["gain"] for each in drawn]) - np.log(pad_design.gain)
    peak = np.array([each["gain"] for each in drawn]) * pad_design.added.reference_load
    offset = np.array([each["offset"] for each in drawn]) / peak
    place = np.array([each["x_s"] for each in drawn]) - pad_design.place[:, 0]
    w = np.log([float(each["w"]) for each in drawn])
    for values, mean, sd in (
        (gain, 0, np.log(GAIN_FACTOR)),
        (offset, 0, OFFSET_SHARE),
        (place, 0, PLACE_MM),
        (w, np.log(2.5), np.log(2)),
    ):
        assert stats.kstest(values.ravel(), stats.norm(mean, sd).cdf).pvalue > 1e-3
    assert (GAIN_FACTOR, OFFSET_SHARE, PLACE_MM) == (1.3, 0.1, 0.3)


def test_all_parameters_and_effects_have_ranks(pad_design: PadCalibrationDesign) -> None:
    elements = [f"e{e:02d}" for e in (1, 2, 3)]
    own = [f"{name} {e}" for name in ("gain", "offset", "x_s") for e in elements]
    assert set(pad_design.ranked(1)) == {*own, "w", "creep_share", "creep_time"}
    found = finger_design("crosstalk").ranked(1)
    own = [
        f"{name} {e}" for name in ("r_s", "theta_s", "response", "gain", "noise_sd", "discrepancy_sd") for e in elements
    ]
    shared = ["sigma", "mu", "force_noise_sd", "log density", *(f"crosstalk_{n}" for n in ("share", "reach", "lean"))]
    assert set(found) == {*own, *shared}
    assert all(0 <= place <= 99 for place, _ in found.values())


def test_effects_that_cannot_occur_are_refused() -> None:
    with pytest.raises(InputError, match="unknown effect 'haste'"):
        finger_design("haste")
    silent = replace(LINE, force_noise_sd=0.0)
    with pytest.raises(InputError, match="noise of the force sensor"):
        PadCalibrationDesign.of(bayestouch.simulate(silent, seed=1).dataset, "gaussian", 100, 1)


def test_drifts_have_the_covariance_of_their_process() -> None:
    """Written out: sd² (1 + s) exp(-s) with s = √3 gap / time, also between touches far closer than the time."""
    effect = finger_design("baseline_drift").added.effects[0]
    assert isinstance(effect, RandomEffect)
    time = np.array([0.0, 1.0, 5.0, 30.0])
    touches = Recording(
        indenter_radius_mm=np.full(4, np.nan),
        place=(np.zeros(4),),
        load=np.ones(4),
        time_s=time,
        held_s=np.zeros(4),
        element_place=(np.zeros(4000),),
        peak=np.ones(4000),
        reference_load=1.0,
        signal=np.zeros((4, 4000)),
    )
    course = drift_of(effect, (0.3, 10.0), touches, np.random.default_rng(2))
    scaled = np.sqrt(3) * np.abs(time[:, None] - time) / 10.0
    exact = 0.3**2 * (1 + scaled) * np.exp(-scaled)
    # Standard error of a covariance of 4,000 pairs: at most sqrt(2 / 4000) of the variance, 2.2 %.
    assert np.abs(course @ course.T / 4000 - exact).max() < 4.5 * np.sqrt(2 / 4000) * 0.3**2
