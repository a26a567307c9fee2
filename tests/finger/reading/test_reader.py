"""Priors of touches on a finger, and touches that are beyond them."""

from __future__ import annotations

from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from live_cases import sensor

import bayestouch
from bayestouch.data.touches import touches_from
from bayestouch.finger.calibration import finger_chain
from bayestouch.finger.reading.likelihood import FingerTouchModel
from bayestouch.finger.reading.reader import IndenterPriors
from bayestouch.priors.indenters import KnownTips
from bayestouch.priors.parameters import Parameter


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
