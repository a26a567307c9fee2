"""Touches on a pad: with an effect of the load, and outside of the calibrated region."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from pad_simulation import FORCE_NOISE, SimulatedPad, flattened, flattening, grid, line, square
from scipy.stats import norm

import bayestouch
from bayestouch.effects.stated import StatedModel


def test_measured_loads_of_a_result_are_as_read() -> None:
    """Also those below the threshold, from which no acting load leads back; their mean is that of the samples."""
    pad, calibration = flattening()
    rng = np.random.default_rng(8)
    load = np.array([0.05, 0.2, 1.0, 3.0])
    place = np.full((4, 1), 16.0)
    table = pad.touch(place, rng, load=load, measured=True, acting=flattened(load), samples=4)
    table = table.with_(load=table.load + FORCE_NOISE * rng.standard_normal(table.n_rows))
    for plug_in in (False, True):
        result = bayestouch.infer(table, calibration, plug_in=plug_in)
        np.testing.assert_allclose(result.rows.load, table.load.reshape(4, 4).mean(axis=1), rtol=1e-12)
        np.testing.assert_array_equal(result.reference["P"], result.rows.load)
    assert np.isnan(bayestouch.infer(table, calibration, use_load=False).rows.load).all()


def test_weights_for_another_prior_of_a_measured_load_are_as_documented() -> None:
    """Divided by the group `log_prior`: a normal prior times a measurement is a more precise measurement.

    The prior that `parameters` states is that of a load that is not measured, and is not used.
    """
    pad, rng = line(floor=1.0), np.random.default_rng(3)
    load = rng.uniform(0.9, 1.1, 120)
    table = pad.touch(np.linspace(6, 32, 120)[:, None], rng, load=load, measured=True)
    measured_sd, centre, width = 0.05, 1.05, 0.04
    dataset = replace(pad.dataset(table), sensor=replace(pad.sensor, force_noise_sd=measured_sd))
    calibration = bayestouch.calibrate(dataset, kernel="gaussian", e_map="model", draws=8)
    touches = pad.touch(np.full((3, 1), 16.0), rng, load=np.array([0.95, 1.0, 1.1]), measured=True)
    made = bayestouch.infer(touches, calibration, draws=4000, groups="log_prior")
    weight = np.exp(norm(centre, width).logpdf(made.posterior["P"]) - made.groups["log_prior"]["P"])
    weight /= weight.sum(axis=(0, 1))
    mean = (weight * made.posterior["P"]).sum(axis=(0, 1))

    precision = measured_sd**-2 + width**-2
    both = (touches.load / measured_sd**2 + centre / width**2) / precision
    better = replace(calibration, noise=replace(calibration.noise, force_sd=precision**-0.5))
    exact = bayestouch.infer(touches.with_(load=both), better, draws=4000)
    # Monte Carlo error of a mean of weighted draws, at 4 standard errors.
    error = 4 * exact.sd("P") * np.sqrt((weight**2).sum(axis=(0, 1)))
    np.testing.assert_array_less(np.abs(mean - exact.mean("P")), error)
    assert made.parameters[-1].description == (
        "load (the prior is of a load that is not measured; that of a measured one is flat)"
    )


@pytest.mark.parametrize("make", [line, square])
def test_touches_outside_of_the_calibrated_region_are_not_good(make: Callable[[], SimulatedPad]) -> None:
    """Read at its edge with a small sd; touches in the middle and 0.5 mm inside of the edge are good."""
    pad, rng = make(), np.random.default_rng(2)
    dimensions = pad.nominal.shape[1]
    low, high, n = (9.0, 29.0, 60) if dimensions == 1 else (6.0, 16.0, 8)
    calibration = bayestouch.calibrate(
        pad.dataset(pad.touch(grid(low, high, n, dimensions), rng, samples=4)), kernel="gaussian", draws=200
    )
    place = np.full((4, dimensions), 0.5 * (low + high))
    place[1:, -1] = high - 0.5, high + 4, low - 4
    read = bayestouch.infer(pad.touch(place, rng, samples=16), calibration, draws=512)
    np.testing.assert_array_equal(read.sample_stats["grade"], [1, 1, 0, 0])
    assert (read.beyond, read.missed) == (2, 0)


@pytest.mark.parametrize("check_sensor", [True, False])
def test_a_load_in_another_unit_spoils_no_other_touch(check_sensor: bool) -> None:
    """One load of twelve is a hundred times too large: no place in the region fits it, and its grade is 0."""
    design = bayestouch.PadDesign(element_x_mm=(0.0, 0.0, 6.0, 6.0), element_y_mm=(0.0, 6.0, 0.0, 6.0), n_touches=12)
    dataset = bayestouch.simulate(design, seed=6).dataset
    calibration, touches = bayestouch.calibrate(dataset, draws=200), dataset.touches
    right = bayestouch.infer(touches, calibration, draws=512, check_sensor=check_sensor)
    load = np.where(touches.touch == 3, 100 * touches.load, touches.load)
    wrong = bayestouch.infer(touches.with_(load=load), calibration, draws=512, check_sensor=check_sensor)
    np.testing.assert_array_equal(wrong.sample_stats["grade"], np.arange(12) != 3)
    for name, draws in wrong.posterior.items():
        np.testing.assert_array_equal(np.delete(draws, 3, axis=-1), np.delete(right.posterior[name], 3, axis=-1))
    for name in ("x", "y"):
        # The region reaches from 4.33 mm before the first elements to as far behind the last ones.
        assert ((wrong.posterior[name] > -4.34) & (wrong.posterior[name] < 10.34)).all()


@pytest.mark.parametrize("use_load", [False, True])
def test_draws_go_by_the_position_of_a_touch_not_by_its_id(use_load: bool) -> None:
    """With acting loads from felt ones, and with true loads resampled: both have random numbers of their own."""
    pad, calibration = flattening()
    calibration = replace(calibration, noise=replace(calibration.noise, load_scatter=0.02))
    table = pad.touch(np.full((4, 1), 16.0), np.random.default_rng(8), load=np.full(4, 1.0), measured=True, samples=4)

    def loads(table: bayestouch.Touches) -> np.ndarray:
        return bayestouch.infer(table, calibration, draws=64, use_load=use_load, check_sensor=False).posterior["P"]

    first = loads(table)
    for ids in (table.touch + 1000, -table.touch):
        np.testing.assert_array_equal(loads(table.with_(touch=ids)), first)
    # The touches before may be others; one touch fewer before it gives other random numbers.
    before = table.touch < 2
    other = table.with_(readings=np.where(before[:, None], 1.01 * table.readings, table.readings))
    np.testing.assert_array_equal(loads(other)[..., 2:], first[..., 2:])
    assert (loads(table.select(table.touch > 0))[..., -1] != first[..., -1]).any()


@pytest.mark.slow
@pytest.mark.parametrize("effect", ["memory", "creep"])
def test_touches_without_times_are_read_with_a_note(effect: str) -> None:
    """One unit a touch, of which samples take a fifth: corrected as with these times written out, without a note."""
    design = bayestouch.PadDesign(
        element_x_mm=(0.0, 6.0, 12.0), element_y_mm=None, samples_per_touch=2, calibration_step_mm=1.5, n_touches=8
    )
    dataset = bayestouch.simulate(design, seed=3, effects={effect: 0.1}).dataset
    stated = StatedModel("pad", "", ((effect, {}),))
    calibration = bayestouch.calibrate(dataset, model=stated, kernel="layer", e_map="model", draws=8)
    touches = dataset.touches
    timeless, written = (
        bayestouch.infer(touches.with_(time_s=time), calibration, draws=64, check_sensor=False)
        for time in (np.full(16, np.nan), touches.touch + 0.2 * touches.sample)
    )
    np.testing.assert_allclose(timeless.rows.observed, written.rows.observed, rtol=1e-9)
    note = (
        "times are missing: the order of the rows is taken as time, one unit a touch. The effects of the calibration "
        "have times in s, which do not fit."
    )
    assert note in timeless.notes and not any("time" in each for each in written.notes)
