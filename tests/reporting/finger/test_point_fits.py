"""Least-squares fits of touches, against noise-free readings and against the paper's simplex."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from report_cases import FINGER, small

import bayestouch
from bayestouch.contact import composite_radius
from bayestouch.data.touches import touches_from
from bayestouch.paper.simplex import fit_touch
from bayestouch.reporting.finger.point_fits import fit_points, model_finger
from bayestouch.results.objects import Calibration


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    return bayestouch.calibrate(small(FINGER).dataset, draws=64)


@pytest.mark.parametrize("contact", ["layer", "hertz"])
def test_point_fits_recover_noise_free_touches(calibration: Calibration, contact: str) -> None:
    finger = model_finger(calibration, contact)
    radius = composite_radius([1.59, 3.9, 12.3, 25.25], finger.outer_radius_mm)
    angle, load = np.array([-8.0, 3.0, 0.5, 11.0]), np.array([180.0, 200.0, 220.0, 190.0])
    readings = finger.predict(radius, np.radians(angle), load)
    means = touches_from(np.arange(4), readings, load=load, angle_deg=angle).averaged()
    found = fit_points(means, calibration, finger)
    # The search ends when a step gains less than 1e-4 in log density, 0.015 standard deviations; those of a reading
    # at 1.7 % noise are 1 mm, 0.15 degree and 5 N/m (Table 4).
    np.testing.assert_allclose(found.R, radius, rtol=0, atol=0.015)
    np.testing.assert_allclose(found.theta_c, angle, rtol=0, atol=0.0025)
    np.testing.assert_allclose(found.P, load, rtol=0, atol=0.08)
    np.testing.assert_allclose(found.r_c, [1.59, 3.9, 12.3, 25.25], rtol=0.02)


def test_point_fits_are_those_of_the_papers_simplex(calibration: Calibration) -> None:
    """All elements alike, so that weighing by noise and by gain (the paper's strain error) is the same."""
    gain = calibration.mode["gain"]
    alike = replace(
        calibration,
        noise=replace(calibration.noise, tactile_sd=0.002 * gain, discrepancy_sd=np.zeros(len(gain))),
    )
    finger = model_finger(alike, "layer")
    rng = np.random.default_rng(3)
    clean = finger.predict(np.array([3.0, 6.0]), np.radians([2.0, -7.0]), np.array([200.0, 190.0]))
    readings = clean + 0.001 * gain * rng.standard_normal(clean.shape)
    means = touches_from(np.arange(2), readings).averaged()
    found = fit_points(means, alike, finger)
    for i, row in enumerate(readings):
        paper = fit_touch(finger, row)
        # Tolerances: 0.03 of the standard deviations that this noise gives (some 0.1 mm, 0.02 degree, 0.8 N/m).
        assert found.R[i] == pytest.approx(paper.composite_radius_mm, abs=0.01)
        assert found.theta_c[i] == pytest.approx(paper.angle_deg, abs=0.002)
        assert found.P[i] == pytest.approx(paper.load, abs=0.1)


def test_a_dead_element_is_left_out(calibration: Calibration) -> None:
    """Its reading of zero is no measurement: the calibration knows nothing of the element."""
    finger = model_finger(calibration, "layer")
    radius, angle, load = np.array([3.0, 6.0]), np.radians([2.0, -7.0]), np.array([200.0, 190.0])
    readings = finger.predict(radius, angle, load)
    rows = replace(calibration.rows, observed=calibration.rows.observed * (np.arange(readings.shape[1]) != 2))
    dead = replace(calibration, rows=rows)
    zero, missing = readings.copy(), readings.copy()
    zero[:, 2], missing[:, 2] = 0.0, np.nan
    found = fit_points(touches_from(np.arange(2), zero).averaged(), dead, finger)
    expected = fit_points(touches_from(np.arange(2), missing).averaged(), calibration, finger)
    np.testing.assert_array_equal(found.R, expected.R)
    np.testing.assert_allclose(found.R, radius, rtol=0, atol=0.015)
