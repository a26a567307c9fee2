"""Evidence of touches that one shallow element reads almost alone, against a sum over a fine grid."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import logsumexp

from bayestouch import FingerDesign
from bayestouch.contact import composite_radius
from bayestouch.reliability import TouchPlaces, expected_finger, log_evidence

# Elements 1.2 mm below the surface and 2.8 mm apart.
SHALLOW = expected_finger(
    FingerDesign(n_elements=8, noise_percent_peak=1.72, sensing_radius_mm=11.5, pitch_deg=14.0), calibrated=False
)
ABOVE_DEG = 7.0


@pytest.mark.parametrize("use_load", [False, True])
def test_a_touch_beside_an_element_may_be_on_either_side(use_load: bool) -> None:
    """Of a tip above an element an edge is thought to be on either side of it: the places have two peaks."""
    rng, noise, force = np.random.default_rng(3), SHALLOW.noise.tactile_sd, SHALLOW.noise.force_sd
    radii = composite_radius([0.0, 3.86], SHALLOW.outer_radius_mm)
    n = 20
    true = TouchPlaces(np.full(n, radii[1]), np.full(n, np.radians(ABOVE_DEG)), np.full(n, 200.0))
    readings = SHALLOW.predict(true) + noise * rng.standard_normal((n, len(noise)))
    felt = 200.0 + force * rng.standard_normal(n)
    angle = np.radians(np.arange(ABOVE_DEG - 7, ABOVE_DEG + 7, 0.05))
    load = np.linspace(194.0, 206.0, 61) if use_load else np.linspace(60.0, 640.0, 291)
    angle, load = (grid.ravel() for grid in np.meshgrid(angle, load, indexing="ij"))
    of_load = -0.5 * ((felt[:, None] - load) / force) ** 2 if use_load else 0.0
    summed = []
    for radius in radii:
        scaled = SHALLOW.predict(TouchPlaces(np.full(len(load), radius), angle, load)) / noise
        misfit = (scaled**2).sum(axis=1) - 2 * (readings / noise) @ scaled.T
        summed.append(logsumexp(of_load - 0.5 * misfit, axis=1))
    found = log_evidence(SHALLOW, readings, radii, load=felt if use_load else None)
    odds = summed[1] - summed[0]
    # A normal density at one peak was off by 0.4 here.
    np.testing.assert_allclose(found[:, 1] - found[:, 0], odds, atol=0.1)
    assert np.abs(odds).max() > 1
