"""Lower bound of the shear modulus: contacts have a solution there, and every fit has the same one."""

from __future__ import annotations

import numpy as np
import pytest
from report_cases import FINGER, small

from bayestouch.contact.layer import LayerContact
from bayestouch.data.sensor import finger_of
from bayestouch.finger.fit import fit_finger
from bayestouch.finger.priors import FingerPriors
from bayestouch.finger.softest_rubber import softest


@pytest.mark.parametrize("lowest", [0.0, 0.3, 0.46, 0.49])
def test_contacts_have_a_solution_on_the_softest_rubber(lowest: float) -> None:
    """κ = P R/μ of a flat stays inside the table of contacts, whatever Poisson's ratio above the lowest."""
    finger = finger_of(small(FINGER).dataset.sensor)
    radii, load = (finger.core_radius_mm, finger.outer_radius_mm), 600.0
    widest = load / 1000 * radii[1] / np.exp(softest(finger, load, lowest))
    for poisson_ratio in np.linspace(lowest, 0.499, 4):
        assert widest < LayerContact.for_body(*radii, float(poisson_ratio)).kappas[-1]
    # and no wider than a quarter of the circumference, P R/(10 r_b²), though as soft as that allows
    assert 0.4 < widest / (10 * radii[1] ** 2) < 1


def test_fits_with_and_without_effects_have_the_same_bound() -> None:
    dataset = small(FINGER).dataset
    finger, table = finger_of(dataset.sensor), dataset.calibration
    assert table is not None
    fit, _ = fit_finger(table.averaged(), finger, FingerPriors.of(dataset.sensor)[0])
    likelihood = fit.likelihood
    at, (low, _) = likelihood.layout, likelihood.bounds
    assert low[at.log_mu] == likelihood.model.prior()[2][at.log_mu]
    assert low[at.log_mu] == softest(finger, likelihood.model.largest_load, float(low[at.sigma]))


def test_a_flatter_surface_needs_stiffer_rubber() -> None:
    """κ = P R/μ is the same at the bound: twice the radius, twice the modulus; no surface makes it softer."""
    finger = finger_of(small(FINGER).dataset.sensor)
    bounds = [softest(finger, 600.0, 0.3, times * finger.outer_radius_mm) for times in (0.5, 1.0, 2.0)]
    np.testing.assert_allclose(np.diff(bounds), [0.0, np.log(2.0)], atol=1e-12)
    assert bounds[0] == softest(finger, 600.0, 0.3)
