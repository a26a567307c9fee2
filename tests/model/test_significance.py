"""Tail probabilities and normal scores against scipy's distributions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats
from scipy.special import logsumexp

from bayestouch.model.significance import (
    at_least_one,
    lack_of_fit_limits,
    lack_of_fit_tail,
    normal_score,
    quadratic_score,
)


@pytest.mark.parametrize(("chi_square", "freedom"), [(5.0, 3.0), (0.3, 1.0), (0.5, 4.0), (590.0, 2.5)])
def test_normal_score_has_the_tail_of_the_chi_square(chi_square: float, freedom: float) -> None:
    wanted = stats.norm.isf(stats.chi2.sf(chi_square, freedom) / 2)
    assert normal_score(chi_square, freedom) == pytest.approx(wanted, rel=1e-9)


def test_normal_score_at_its_ends() -> None:
    assert normal_score(0.0, 3.0) == 0.0 and normal_score(-1.0, 3.0) == 0.0
    assert normal_score(1e4, 1.0) == pytest.approx(100.0, rel=1e-12)
    assert normal_score(601.0, 1.0) == np.sqrt(601.0)


@pytest.mark.parametrize(
    ("chi_square", "freedom"),
    [
        (610.0, 2.0),
        (610.0, 5.0),
        (650.0, 600.0),
        (1300.0, 20.0),
        (1500.0, 2.0),
        (2e4, 2.0),
        (4000.0, 600.0),
        (9e4, 3e4),
    ],
)
def test_normal_score_has_the_tail_of_a_large_chi_square(chi_square: float, freedom: float) -> None:
    """Twice the tail of z is that of the chi-square, here as logarithms from the Poisson sum of an even freedom."""
    n = np.arange(int(freedom) // 2)
    wanted = stats.chi2.logsf(chi_square, freedom)
    if freedom % 2 == 0:
        wanted = logsumexp(stats.poisson.logpmf(n, chi_square / 2))
    z = normal_score(chi_square, freedom)
    # The error of z is that of the logarithm over z.
    assert np.log(2) + stats.norm.logsf(z) == pytest.approx(wanted, abs=1e-5 * z**2 + 1e-9)
    assert z > 1.7


def test_sum_of_squares_of_a_slope() -> None:
    """Variances 1 and 2: mean 3, sum of squares 5, so 5/3 of a chi-square with 9/5 degrees of freedom."""
    z = quadratic_score(np.array([3.0, 2.0]), np.diag([1.0, 2.0]))
    assert z == pytest.approx(stats.norm.isf(0.5 * stats.chi2.sf(13 / (5 / 3), 1.8)))
    assert quadratic_score(np.array([1.0, 1.0]), np.diag([1.0, 2.0])) == 0.0
    assert quadratic_score(np.zeros(2), np.zeros((2, 2))) == 0.0


def test_the_best_of_many_trials() -> None:
    assert at_least_one(0.01, 5) == pytest.approx(1 - 0.99**5)
    assert at_least_one(1e-20, 7) == pytest.approx(7e-20)
    assert at_least_one(1.0, 1) == pytest.approx(1.0)


def test_lack_of_fit() -> None:
    assert lack_of_fit_tail(1.3, 20.0, 30.0) == pytest.approx(stats.f.sf(1.3, 20, 30))
    wanted = stats.f.ppf([0.02, 0.98], 20, 30)
    np.testing.assert_allclose(lack_of_fit_limits(0.04, 20.0, 30.0), wanted)
    for freedoms in ((0.0, 30.0), (20.0, 0.0)):
        assert np.isnan(lack_of_fit_tail(1.3, *freedoms)) and np.isnan(lack_of_fit_limits(0.04, *freedoms)).all()
    # One degree of freedom is enough.
    assert np.isfinite(lack_of_fit_tail(1.3, 1.0, 1.0)) and np.isfinite(lack_of_fit_limits(0.04, 1.0, 1.0)).all()
