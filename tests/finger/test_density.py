"""Prior of the true load in the density of a finger's calibration."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from known_fingers import FORCE_NOISE, NOISE, SAMPLES, known_touches, sensor
from scipy.special import logsumexp
from scipy.stats import norm

from bayestouch.data.sensor import finger_of
from bayestouch.finger.density import FingerDensity, log_prior_of_loads
from bayestouch.finger.fit import fit_finger
from bayestouch.finger.priors import FingerPriors
from bayestouch.sampling.rank_one import AlongError, log_density_with_shared_error


@pytest.mark.parametrize("force_sd", [6.0, 30.0, 2000.0])
def test_a_load_with_a_prior_of_one_over_load_is_integrated_out(force_sd: float) -> None:
    """Readings in proportion to the load, at several gains, against the integral over the load."""
    gains, read, measured = np.array([4.5, 5.0, 5.5]), np.array([1000.0, 480.0]), 190.0
    shape, sd = np.array([1.0, 0.5]), np.array([3.0, 5.0])

    load = np.linspace(1.0, 1000.0, 200_000)
    given = norm(gains[:, None, None] * shape * load[:, None], sd).logpdf(read).sum(axis=2)
    expected = logsumexp(given + norm(load, force_sd).logpdf(measured) - np.log(load), axis=1)
    slope = (gains[:, None] * shape)[:, None]
    left, weight = read - measured * slope, np.broadcast_to(sd**-2.0, slope.shape)
    load_sd = np.full((3, 1), force_sd)
    of_load = AlongError.of(left, slope, weight)
    found = log_density_with_shared_error(left, weight, of_load, load_sd)
    found = found + log_prior_of_loads(of_load, measured * slope, load_sd)[:, 0]
    np.testing.assert_allclose(found - found[1], expected - expected[1], atol=1e-3)


def test_the_readings_of_an_element_that_is_missing_say_nothing_of_the_load() -> None:
    nothing = np.zeros((1, 2, 3))
    of_load = AlongError.of(nothing + 5.0, nothing + 1.0, nothing)
    assert not log_prior_of_loads(of_load, nothing, np.ones((1, 2))).any()


def test_touches_of_unknown_load_do_not_say_how_large_all_gains_are() -> None:
    """Gains times c, shear modulus and loads over c: the same readings, and 1/load has no preferred scale.

    Of edges exactly; a flat's readings are linear in the load only nearly. A prior that is flat in the load prefers the
    lower gains, by log c for each edge.
    """
    table = known_touches(2, step=6.0)
    unknown = table.touch % 4 > 0
    table = replace(table, load=np.where(unknown, np.nan, table.load))
    assert (NOISE, FORCE_NOISE, SAMPLES) == (12.0, 1.0, 4)
    priors, _ = FingerPriors.of(sensor())
    fit, _ = fit_finger(table.averaged(), finger_of(sensor()), priors)
    at, known, change = fit.likelihood.layout, fit.likelihood.known, np.array([-0.03, 0.0, 0.03])
    vectors = np.tile(fit.vector, (3, 1))
    vectors[:, at.response] += change[:, None]
    vectors[:, at.log_mu] -= change
    log = FingerDensity.of(fit).touch_log_likelihood(vectors)
    for flat, slope in ((False, 0.02), (True, 0.2)):
        here = (known.load_reads == 0) & ((known.radius_mm > 0) == flat)
        assert here.sum() >= 5
        assert abs(log[2, here].mean() - log[0, here].mean()) < slope * 0.06
