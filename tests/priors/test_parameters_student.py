"""Student-t priors against scipy.stats, as text, in files, and in the flat prior of a finger."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import approx_fprime
from scipy.stats import norm
from scipy.stats import t as student

from bayestouch.errors import InputError
from bayestouch.finger.layout import FlatPrior
from bayestouch.priors.parameter_text import parameters_from_json, parameters_to_json
from bayestouch.priors.parameters import LogNormal, LogStudentT, Normal, Parameter, Prior, StudentT, truncated
from bayestouch.priors.prior_text import prior_from_text

PLAIN, CUT = StudentT(0.47, 0.01, 5.0), StudentT(0.47, 0.01, 5.0, 0.0, 0.475)
LOG = LogStudentT(0.15, 0.1, 4.5)
PROBABILITIES = np.array([0.01, 0.3, 0.5, 0.9])


def test_density_and_quantiles() -> None:
    """Also truncated, where density and quantiles are those of the part that is left."""
    exact = student(5.0, 0.47, 0.01)
    value = np.array([0.43, 0.46, 0.4749])
    np.testing.assert_allclose(PLAIN.log_density(value), exact.logpdf(value))
    mass = exact.cdf(0.475) - exact.cdf(0.0)
    np.testing.assert_allclose(CUT.log_density(value), exact.logpdf(value) - np.log(mass))
    assert CUT.log_density(0.476) == -np.inf
    np.testing.assert_allclose(PLAIN.quantile(PROBABILITIES), exact.ppf(PROBABILITIES))
    np.testing.assert_allclose(CUT.quantile(PROBABILITIES), exact.ppf(exact.cdf(0.0) + mass * PROBABILITIES))


def test_logarithmic_density_and_quantiles() -> None:
    exact = student(4.5, np.log(0.15), 0.1)
    value = np.array([0.08, 0.15, 0.4])
    np.testing.assert_allclose(LOG.log_density(value), exact.logpdf(np.log(value)) - np.log(value))
    assert LOG.log_density(-1.0) == -np.inf
    np.testing.assert_allclose(LOG.quantile(PROBABILITIES), np.exp(exact.ppf(PROBABILITIES)))


def test_quantiles_at_both_ends() -> None:
    """They are the ends of the support."""
    for prior in (PLAIN, CUT, LOG, StudentT(2.0, 1.0, 3.0, -np.inf, 5.0)):
        np.testing.assert_allclose(prior.quantile([0.0, 1.0]), prior.support, atol=1e-15)


def test_truncation() -> None:
    assert truncated(PLAIN, 0.0, 0.475) == CUT
    with pytest.raises(InputError, match="nothing of the prior"):
        truncated(PLAIN, 0.9, 1.0)


@pytest.mark.parametrize("wrong", [(0.47, 0.0, 5.0), (0.47, 0.01, -1.0), (np.nan, 0.01, 5.0)])
def test_impossible_priors_are_refused(wrong: tuple[float, float, float]) -> None:
    with pytest.raises(InputError, match="Student-t prior: expected a finite centre"):
        StudentT(*wrong)
    with pytest.raises(InputError, match="nothing of it lies between"):
        StudentT(0.47, 0.01, 5.0, 2.0, 1.0)
    with pytest.raises(InputError, match="log-Student-t prior: expected median"):
        LogStudentT(0.0, 0.1, 5.0)


def test_text() -> None:
    assert prior_from_text("student-t:0.47,0.01,5") == PLAIN
    prior = prior_from_text("log-student-t:0.15,1.35,4")
    assert isinstance(prior, LogStudentT)
    assert (prior.median, prior.spread, prior.dof) == (0.15, pytest.approx(np.log(1.35)), 4)
    for text in ("student-t:0.47,0.01", "normal:0.47,0.01,5", "log-student-t:0.15,1.35", "t:1,2,3"):
        with pytest.raises(InputError, match="expected normal:MEAN,SD"):
            prior_from_text(text)
    assert str(CUT) == "Student-t, 0.47 ± 0.01, 5 degrees of freedom, within 0 to 0.475"
    assert str(replace(CUT, high=np.inf)).endswith(", above 0")
    assert str(replace(CUT, low=-np.inf)).endswith(", below 0.475")
    assert str(LOG) == "log-Student-t, median 0.15, factor 1.11, 4.5 degrees of freedom"


def test_file() -> None:
    parameters = tuple(Parameter("x", "x", "x", "mm", prior) for prior in (PLAIN, CUT, LOG))
    assert parameters_from_json(parameters_to_json(parameters)) == parameters


@pytest.fixture
def flat() -> FlatPrior:
    """One element: log response, depth, angle, σ, log μ, log noise, log force noise."""
    priors: tuple[Prior, ...] = (LOG, StudentT(9.9, 0.1, 3.0), Normal(0.0, 0.1), CUT, LOG, LogNormal(1.0, 0.5), LOG)
    return FlatPrior.of(1, priors)


def test_flat_density(flat: FlatPrior) -> None:
    """Against scipy, up to a constant."""
    log = student(4.5, np.log(0.15), 0.1)
    exact = [log, student(3.0, 9.9, 0.1), norm(0, 0.1), student(5.0, 0.47, 0.01), log, norm(0, 0.5), log]
    vectors = flat.mean + np.random.default_rng(1).uniform(-3, 0.4, (10, 7)) * flat.spread
    wanted = np.sum([one.logpdf(column) for one, column in zip(exact, vectors.T, strict=True)], axis=0)
    got = flat.log_density(vectors)
    np.testing.assert_allclose(got - got[0], wanted - wanted[0], atol=1e-10)


def test_normal_approximation_about_a_vector_has_its_slope(flat: FlatPrior) -> None:
    """The slope of the log density decreases far from the centre, and so does that of the approximation."""
    vector = flat.mean + np.array([6.0, -4.0, 1.0, -5.0, 0.5, 1.0, 2.0]) * flat.spread
    about = flat.about(vector)
    slope = approx_fprime(vector, lambda x: float(flat.log_density(x)), 1e-7)
    np.testing.assert_allclose((about.mean - vector) / about.spread**2, slope, rtol=1e-4)
    assert about.log_density(vector) == flat.log_density(vector)


def test_proposals_are_as_wide_as_the_prior(flat: FlatPrior) -> None:
    """The sd of Student's t, at most twice its scale; other spreads stay."""
    wide = flat.about(flat.mean).for_proposals().spread
    assert wide[3] == pytest.approx(0.01 * np.sqrt(5 / 3))
    assert wide[1] == pytest.approx(0.1 * np.sqrt(3.0))
    assert wide[0] == pytest.approx(student(4.5, 0, 0.1).std())
    np.testing.assert_array_equal(wide[[2, 5]], flat.spread[[2, 5]])


@pytest.mark.parametrize(
    "prior",
    [
        lambda: Normal(0.0, 1.0, low=8.0),
        lambda: Normal(0.0, 1.0, high=-8.0),
        lambda: StudentT(0.0, 1.0, 30.0, low=1e3),
    ],
)
def test_bounds_with_next_to_no_probability_are_refused(prior: Callable[[], Prior]) -> None:
    with pytest.raises(InputError, match="nothing of it lies between"):
        prior()


def test_quantiles_far_in_the_upper_tail() -> None:
    """A normal prior from 6.5 sd: quantiles from the other tail, where probabilities keep their digits."""
    found = Normal(1.0, 2.0, low=14.0).quantile(np.array([0.01, 0.5, 0.99]))
    np.testing.assert_allclose(found, 1 + 2 * norm.isf(norm.sf(6.5) * np.array([0.99, 0.5, 0.01])), rtol=1e-4)
