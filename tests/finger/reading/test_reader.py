"""Priors of touches on a finger, and touches that are beyond them."""

from __future__ import annotations

from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from live_cases import sensor
from scipy.stats import multivariate_normal

import bayestouch
from bayestouch.data.touches import touches_from
from bayestouch.effects.stated import StatedModel
from bayestouch.finger.calibration import finger_chain
from bayestouch.finger.chain_with_effects import ChainWithEffects
from bayestouch.finger.reading.likelihood import FingerTouchModel
from bayestouch.finger.reading.reader import FingerPosterior, IndenterPriors, TouchReadings
from bayestouch.finger.reading.signal_noise import SignalNoise
from bayestouch.model.noise import AddedNoise
from bayestouch.priors.indenters import KnownTips
from bayestouch.priors.parameters import Parameter

ZERO = np.zeros(1, dtype=np.int64)


@cache
def small_finger() -> bayestouch.Calibration:
    design = bayestouch.FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=10.0)
    return bayestouch.calibrate(bayestouch.simulate(design, seed=3).dataset, draws=64)


def priors_of(angles_deg: np.ndarray) -> IndenterPriors:
    chain: Any = SimpleNamespace(angle=np.radians(angles_deg), outer_radius_mm=12.7)
    return IndenterPriors.of(chain, 200.0)


@pytest.mark.parametrize(
    ("angles", "margin"),
    [
        (np.array([-26.4, 0.0, 26.4]), 20.0),
        (45.0 * np.arange(8), 20.0),
        (30.0 * np.arange(12), 15.0),
        (10.0 * np.arange(36), 5.0),
    ],
)
def test_no_location_is_in_the_prior_twice(angles: np.ndarray, margin: float) -> None:
    """20° beyond the elements; half of the gap where elements are all around."""
    low, high = np.degrees(priors_of(angles).location.support)
    assert low == pytest.approx(angles.min() - margin) and high == pytest.approx(angles.max() + margin)
    assert high - low <= 360 * (1 + 1e-12)


def test_posteriors_that_an_end_of_a_prior_cuts_off() -> None:
    """Loads from 0 to 600 N/m, locations within ±60°; four chains of 500 draws of each touch."""
    rng = np.random.default_rng(1)
    priors = priors_of(np.array([-40.0, 40.0]))
    cases = {
        "at the hardest load": (np.zeros(2000), 600 - rng.exponential(0.01, 2000), True),
        "in the last hundredth of the loads, but inside": (np.zeros(2000), rng.normal(597, 0.3, 2000), False),
        "light": (np.zeros(2000), rng.exponential(0.5, 2000), False),
        "any load": (np.zeros(2000), rng.uniform(0, 600, 2000), False),
        "at the last location": (60 - rng.exponential(0.1, 2000), np.full(2000, 200.0), True),
        "at the first location": (rng.exponential(0.1, 2000) - 60, np.full(2000, 200.0), True),
        "inside the last location": (rng.normal(59, 0.1, 2000), np.full(2000, 200.0), False),
        "any location": (rng.uniform(-60, 60, 2000), np.full(2000, 200.0), False),
    }
    angle, load, expected = (np.stack([case[k] for case in cases.values()], axis=-1) for k in range(3))
    found = priors.cut_off(np.radians(angle).reshape(4, 500, -1), load.reshape(4, 500, -1))
    assert dict(zip(cases, found, strict=True)) == dict(zip(cases, expected.astype(bool), strict=True))


@pytest.mark.parametrize("use_load", [True, False])
@pytest.mark.parametrize("method", ["emcee", "importance"])
def test_touches_beyond_the_priors_are_not_good(method: str, use_load: bool) -> None:
    """Four times the typical load, and 30° beyond the last element; the touches beside them are as they were."""
    calibration = small_finger()
    chain, typical = finger_chain(calibration), float(calibration.settings["typical_load"])
    outside = np.degrees(chain.angle.max()) + 30
    load, angle = typical * np.array([1.0, 2.0, 4.0, 1.0]), np.array([0.0, 5.0, 0.0, outside])
    clean, touch = chain.predict(np.full(4, 4.0), np.radians(angle), load), np.repeat(np.arange(4), 8)
    readings = clean[touch] + np.random.default_rng(0).normal(0, calibration.noise.tactile_sd, (32, 4))
    touches = touches_from(touch, readings, load=load[touch], contact=1.0)
    options: Any = {"method": method, "use_load": use_load, "check_sensor": False, "draws": 512, "workers": 1}
    found = bayestouch.infer(touches, calibration, **options)
    # Without its load a touch beyond the elements is ambiguous, and its posterior wide.
    expected = [1, 1, 0, 0] if use_load else [1, 1, 0]
    np.testing.assert_array_equal(found.sample_stats["grade"][: len(expected)], expected)
    assert found.mean("P")[2] == pytest.approx(3 * typical, rel=1e-3) and found.sd("P")[2] < 0.1
    inside = touches.select(touches.touch < 2)
    alone = bayestouch.infer(inside, calibration, **options)
    for name, values in alone.posterior.items():
        np.testing.assert_array_equal(found.posterior[name][..., :2], values)


@pytest.mark.filterwarnings("error")
def test_one_element_alone_does_not_tell_the_load() -> None:
    """Its reading changes with location and load alike: rounding errors of 32 bits must not tell them apart."""
    data, calibration = sensor("finger")
    some = data.touches.select(np.isin(data.touches.touch, np.unique(data.touches.touch)[10:16]))
    touches = some.with_(readings=np.where(np.arange(8) == 2, some.readings, np.nan))
    found = bayestouch.infer(touches, calibration, use_load=False, check_sensor=False, draws=128, workers=1)
    assert (found.sd("P") > 5.0).all()


@pytest.mark.parametrize("outer", [12.7, 3.7, 7.9, 12.6])
def test_a_flat_of_the_prior_has_no_radius(outer: float) -> None:
    """The group `prior` holds r_c = ∞ for a flat on a finger of any radius."""
    prior = KnownTips((0.0, 2.0, np.inf)).radius_prior(outer)
    posterior: Any = SimpleNamespace(chain=SimpleNamespace(outer_radius_mm=outer))
    model = FingerTouchModel(posterior, (Parameter("R", "R", "R", "mm", prior),), np.zeros(3))
    drawn = model.prior(np.array([[[0.1, 0.5, 0.9]]]))
    np.testing.assert_allclose(drawn["r_c"], [[0.0, 2.0, np.inf]], rtol=1e-12)


def test_noise_that_depends_on_the_signal_is_that_at_each_point() -> None:
    """Normal density of the readings there are, with the variances at the point and the correlations at the mode."""
    calibration = small_finger()
    chain, m = finger_chain(calibration), 4
    rng = np.random.default_rng(2)
    added, peak, counts = (
        AddedNoise(share=0.1, power=0.7),
        np.array([90.0, 110.0, 100.0, 80.0]),
        np.array([[1, 2, 0, 3]]),
    )
    mode = np.array([0.3, 0.05, 180.0])
    priors = IndenterPriors.of(chain, 200.0)
    here, root = [0, 1, 3], rng.standard_normal((m, m))
    signal = chain.predict(12.7 / (1 + np.exp(-mode[0])), mode[1], mode[2])[None]
    own = (0.1 * peak) ** 2 * np.abs(signal / peak) ** 1.4 / np.array([1, 2, 1, 3])
    covariance = root @ root.T + np.diag(own[0])
    whitener = np.zeros((1, m, m))
    whitener[0][np.ix_(here, here)] = np.linalg.inv(np.linalg.cholesky(covariance[np.ix_(here, here)]))
    readings = np.where(counts > 0, signal + 3.0, np.nan)
    touches = TouchReadings(readings, counts, np.array([np.nan]), np.array([1.0]))
    noise = SignalNoise.of(added, peak, counts, signal, covariance[None])
    posterior = FingerPosterior(chain, touches, priors, whitener, noise_of_signal=noise)
    x = mode + rng.standard_normal((20, 3)) * np.array([0.5, 0.05, 60.0])
    wanted = []
    for w, angle, load in x:
        predicted = chain.predict(12.7 / (1 + np.exp(-w)), angle, load)
        there = (0.1 * peak) ** 2 * np.abs(predicted / peak) ** 1.4 / np.array([1, 2, 1, 3]) - own[0]
        growth = np.sqrt(1 + there / np.diag(covariance))
        normal = multivariate_normal(predicted[here], (covariance * np.outer(growth, growth))[np.ix_(here, here)])
        wanted.append(
            normal.logpdf(readings[0, here]) + posterior.log_prior(np.array([[[w, angle, load]]]), ZERO)[0, 0]
        )
    found = posterior.log_density(x[None], ZERO)[0]
    np.testing.assert_allclose(found - found[0], np.array(wanted) - wanted[0], rtol=1e-9, atol=1e-9)


def test_noise_that_depends_on_the_signal_goes_with_its_touch() -> None:
    """Of two touches, the second by itself: the variance of its readings over that at its mode, written out."""
    calibration = small_finger()
    added, peak = AddedNoise(share=0.1, power=0.5), np.full(4, 100.0)
    counts, at_mode = np.array([[1, 1, 1, 1], [2, 2, 4, 4]]), np.array([[50.0] * 4, [80.0] * 4])
    noise = SignalNoise.of(added, peak, counts, at_mode, np.array([np.eye(4) * 110.0, np.eye(4) * 60.0]))
    touches = TouchReadings(at_mode, counts, np.full(2, np.nan), np.ones(2))
    chain = finger_chain(calibration)
    posterior = FingerPosterior(chain, touches, IndenterPriors.of(chain, 200.0), np.ones((2, 4)), noise_of_signal=noise)
    alone = posterior.select(np.array([1])).noise_of_signal
    assert alone is not None
    # (10 % of 100)² = 100 times the signal over the peak, over the readings of the mean; all else is the rest of 60.
    own = np.array([20.0, 40.0, 60.0, 80.0]) / np.array([2, 2, 4, 4])
    other = 60.0 - 80.0 / np.array([2, 2, 4, 4])
    growth = alone.growth(np.array([[[20.0, 40.0, 60.0, 80.0]]]), ZERO)
    np.testing.assert_allclose(growth[0, 0], (own + other) / 60.0, rtol=1e-12)


@pytest.mark.slow
def test_noise_that_depends_on_the_signal_does_not_bias_the_load() -> None:
    """Single samples with noise of 15 % of the signal: with the noise at the mode, loads were 0.28 sd too small."""
    design = bayestouch.FingerDesign(samples_per_touch=10, noise_percent_peak=0.5, edge_step_deg=3.0, flat_step_deg=9.0)
    data = bayestouch.simulate(design, effects={"signal_dependent_noise": 0.15}, seed=1).dataset
    model = StatedModel("finger", "layer", (("signal_dependent_noise", {}),))
    calibration = bayestouch.calibrate(data, model=model, draws=64)
    effects = ChainWithEffects.of(calibration)
    chain, added, peak = effects.model.chain(effects.vector), effects.listed.noise, effects.model.peak
    rng, n = np.random.default_rng(3), 500
    radius, angle = rng.uniform(0, chain.outer_radius_mm, n), np.radians(rng.uniform(-20, 20, n))
    load = rng.uniform(60, 600, n)  # as by the prior, without the lightest
    clean = chain.predict(radius, angle, load)
    sd = np.sqrt(
        calibration.noise.tactile_sd**2 + (added.share * peak) ** 2 * np.abs(clean / peak) ** (2 * added.power)
    )
    table = touches_from(np.arange(n), clean + sd * rng.standard_normal(clean.shape), load=np.nan, contact=1.0)
    found = bayestouch.infer(table, calibration, plug_in=True, check_sensor=False, draws=256, seed=1, workers=1)
    inside = (load > 120) & (load < 420)
    off = ((found.mean("P") - load) / found.sd("P"))[inside]
    # Three standard errors of the mean of some 250 touches.
    assert abs(off.mean()) < 3 / np.sqrt(inside.sum())
