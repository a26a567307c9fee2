"""Notes of the calibration of a pad with effects."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from pad_simulation import line

import bayestouch
from bayestouch.data.touches import touches_from
from bayestouch.effects.stated import StatedModel
from bayestouch.pad.calibration_with_effects import FIRST_WITHOUT_NOISE, _notes
from bayestouch.pad.corrected import PadEffects
from bayestouch.pad.reading.reader import PadReader


@pytest.mark.parametrize(
    ("left", "said"),
    [
        ((), []),
        (
            ("tilt", "gain_map"),
            ["tilt and gain_map: left to the empirical map, as it goes with the location"],
        ),
    ],
)
def test_effects_that_are_left_to_the_map_are_named(left: tuple[str, ...], said: list[str]) -> None:
    effects: Any = SimpleNamespace(left_to_map=left, listed=SimpleNamespace(drifts=()))
    assert _notes(effects) == said


@pytest.mark.slow
def test_noise_of_the_force_sensor_is_one_of_the_load_as_read() -> None:
    """A channel whose response flattens: what a load of the calibration, and one that is read, is uncertain by."""
    rng, pad = np.random.default_rng(2), line()
    x, load = rng.uniform(6.0, 32.0, 240), rng.uniform(0.5, 6.0, 240)
    clean = pad.chain.predict(x[:, None], load / (1 + 0.4 * load))
    table = touches_from(np.arange(240), clean + 0.02 * rng.standard_normal(clean.shape), x_mm=x, load=load)
    dataset = replace(pad.dataset(table), sensor=replace(pad.sensor, force_noise_sd=0.02))
    made = bayestouch.diagnose(replace(dataset, calibration=None), kernel="gaussian").calibration_after
    effects = PadEffects.of(made)
    assert effects is not None and [e.name for e in effects.listed.effects] == ["load_nonlinearity"]
    reader = PadReader.from_calibration(made)
    step = 1e-3
    for read in (1.0, 5.5):
        up, down = effects.acting(np.array([read + step, read - step]))
        acting, slope = effects.acting(np.array([read])), (up - down) / (2 * step)
        assert reader.measured_load_sd(acting, np.ones(1)) == pytest.approx(0.02 * slope, rel=0.02)


def test_wrong_readings_are_left_out_of_the_calibration_and_of_touches() -> None:
    """Two readings in a hundred are wrong: with the effect, noise and errors are those of a pad without them."""
    design = bayestouch.PadDesign(
        element_x_mm=(0.0, 6.0, 12.0), element_y_mm=None, samples_per_touch=5, calibration_step_mm=0.75, n_touches=60
    )
    noise, error = {}, {}
    for name, effects in (("clean", {}), ("wrong", {"outliers": 0.02})):
        data = bayestouch.simulate(design, effects=effects, seed=3).dataset
        model = StatedModel("pad", "", (("outliers", {}),)) if effects else None
        made = bayestouch.calibrate(data, kernel="layer", e_map="model", model=model, draws=100)
        read = bayestouch.infer(data.touches, made, draws=256)
        noise[name] = made.noise.tactile_sd
        error[name] = np.sqrt(np.mean((read.mean("x") - read.reference["x"]) ** 2))
    np.testing.assert_allclose(noise["wrong"], noise["clean"], rtol=0.03)
    assert error["wrong"] < 1.1 * error["clean"]


def test_first_samples_of_readings_that_creep_have_no_noise_of_all_samples() -> None:
    """The scatter of samples that creep is not the noise of the first: touches had places up to 1.4 times as wrong."""
    design = bayestouch.PadDesign(
        element_x_mm=(0.0, 6.0, 12.0), element_y_mm=None, samples_per_touch=5, calibration_step_mm=0.75, n_touches=120
    )
    data = bayestouch.simulate(design, effects={"creep": 0.15}, seed=1).dataset
    stated = StatedModel("pad", "", (("signal_dependent_noise", {}),))
    made, without = (
        bayestouch.calibrate(data, kernel="layer", e_map="model", model=model, draws=100) for model in (stated, None)
    )
    assert FIRST_WITHOUT_NOISE in made.notes and FIRST_WITHOUT_NOISE not in without.notes
    once, zero = np.ones(3), np.zeros(3)
    np.testing.assert_allclose(made.noise.mean_variance(once, zero), without.noise.mean_variance(once, zero), rtol=0.05)
    read = bayestouch.infer(data.touches, made, draws=256)
    error = read.mean("x") - read.reference["x"]
    assert np.sqrt(np.mean(error**2)) < 0.07
    assert np.sqrt(np.mean((error / read.sd("x")) ** 2)) == pytest.approx(1.0, abs=0.2)


def test_wrong_readings_among_first_samples_are_told_by_the_noise_of_the_others() -> None:
    """With creep only first samples are used, which have no scatter: their noise of 10 was zero, and tables of one to
    three samples could not be read. With it, one wrong reading in fifty costs hardly more than the readings it spoils.
    """
    design = bayestouch.PadDesign(
        element_x_mm=(0.0, 6.0, 12.0), element_y_mm=None, samples_per_touch=5, calibration_step_mm=0.75, n_touches=60
    )
    rms = {}
    for stated in (("creep",), ("creep", "outliers")):
        effects = {"creep": 0.05, "outliers": 0.02}
        data = bayestouch.simulate(design, effects={name: effects[name] for name in stated}, seed=3).dataset
        model = StatedModel("pad", "", tuple((name, {}) for name in stated))
        made = bayestouch.calibrate(data, kernel="layer", e_map="model", model=model, draws=50)
        assert made.settings["samples"] == "first"
        for samples in (1, 3):
            table = data.touches.select(data.touches.sample < samples)
            read = bayestouch.infer(table, made, draws=128)
            error = read.mean("x") - read.reference["x"]
            rms[stated, samples] = np.sqrt(np.mean(error**2))
            # 60 errors over their sd: three standard errors of their rms are 27 per cent
            assert np.sqrt(np.mean((error / read.sd("x")) ** 2)) == pytest.approx(1.0, abs=0.27)
            assert not any("sensor check" in note for note in read.notes)
    # 102 touches of 5 samples
    np.testing.assert_allclose(made.noise.tactile_sd, design.noise_percent_peak / 100 * design.peak_reading, rtol=0.1)
    for samples in (1, 3):
        assert rms[("creep", "outliers"), samples] < 1.25 * rms[("creep",), samples]


@pytest.mark.parametrize("last", [1, -1])
def test_noise_of_a_pad_with_two_effects_of_the_noise(last: int) -> None:
    """Own noise 10, beside an error of 20 that all share and one of 30 at the peak; it was 12.2 and 12.6 on average."""
    design = bayestouch.PadDesign(
        element_x_mm=(0.0, 6.0, 12.0, 18.0),
        element_y_mm=None,
        samples_per_touch=8,
        calibration_step_mm=0.5,
        n_touches=2,
    )
    sizes = {"common_mode_noise": 0.02, "signal_dependent_noise": 0.03}
    data = bayestouch.simulate(design, effects=sizes, seed=3).dataset
    model = StatedModel("pad", "", tuple((name, {}) for name in tuple(sizes)[::last]))
    made = bayestouch.calibrate(data, kernel="layer", e_map="model", model=model, draws=20)
    # In five simulations, the mean over the four elements is 9.9 to 10.3.
    assert made.noise.tactile_sd.mean() == pytest.approx(10.0, abs=0.6)
    # Standard deviations of these sizes in five simulations: 0.001 and 0.002.
    assert made.mode["common_mode_noise_sd"] == pytest.approx(0.02, abs=0.003)
    assert made.mode["signal_dependent_noise_share"] == pytest.approx(0.03, abs=0.006)
