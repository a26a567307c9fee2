"""Tail probabilities of the diagnosis against scipy's laws, and against data in which nothing is missing."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from bayestouch.diagnosis.verdict import lack_of_fit
from bayestouch.model.significance import at_least_one, lack_of_fit_tail, normal_score, quadratic_score


@pytest.mark.parametrize(("ratio", "freedom", "pure"), [(1.2, 400, 60), (1.2, 60, 400), (2.5, 8, 30), (0.8, 30, 8)])
def test_lack_of_fit_is_an_f_test(ratio: float, freedom: float, pure: float) -> None:
    assert lack_of_fit_tail(ratio, freedom, pure) == pytest.approx(stats.f(freedom, pure).sf(ratio), rel=1e-10)


def test_the_f_test_keeps_its_level() -> None:
    """Mean squares of 40 residuals over those of 6 repeats, 20,000 times: p is uniform (swapped freedoms are not)."""
    rng = np.random.default_rng(0)
    ratio = rng.chisquare(40, 20_000) / 40 / (rng.chisquare(6, 20_000) / 6)
    p = np.array([lack_of_fit_tail(float(each), 40.0, 6.0) for each in ratio])
    # the largest distance of 20,000 uniform numbers from their law: beyond 1.95/sqrt(n) once in a thousand
    assert stats.kstest(p, "uniform").statistic < 1.95 / np.sqrt(20_000)


def test_a_model_that_is_right_has_uniform_p_values_on_held_out_touches() -> None:
    """Through `lack_of_fit`: held-out readings about a prediction of known spread, noise from a few repeats.

    `HeldOut` is made of whitened residuals whose noise was estimated with 12 degrees of freedom.
    """
    from bayestouch.model.held_out import HeldOut

    rng, t, m = np.random.default_rng(1), 20, 5
    # what a fit of some fifty parameters to hundreds of touches leaves open: 6 % of the variance of the noise
    design = 0.14 * rng.normal(size=(t * m, 3))
    present = np.ones((t, m), dtype=bool)
    empty = HeldOut(
        observed=None,  # type: ignore[arg-type]  # not looked at
        residual=np.zeros((t, m)),
        whitened=np.zeros((t, m)),
        present=present,
        design=design,
        reference={},
        stated={},
        quantities=(),
        noise_sd=np.ones((t, m)),
        load_free=np.zeros(t),
        log_volume=np.zeros(t),
    )
    means = SimpleNamespace(pure_error_dof=np.array([4.0, 4.0, 4.0]))
    fitted = SimpleNamespace(model=SimpleNamespace(known=SimpleNamespace(means=means)), drifts=())
    p = []
    for _ in range(3000):
        noise = np.sqrt(rng.chisquare(12) / 12)
        whitened = (rng.normal(size=t * m) + design @ rng.normal(size=3)) / noise
        held = replace(empty, whitened=whitened.reshape(t, m))
        # the model's own spread is in units of the true noise
        p.append(lack_of_fit(fitted, replace(held, design=design / noise)).p_value)  # type: ignore[arg-type]
    # `design` over an estimated noise changes nothing but the three directions out of 100: 3 % of the ratio
    assert stats.kstest(p, "uniform").statistic < 1.95 / np.sqrt(3000) + 0.02


def test_scores_of_chi_squares() -> None:
    """Two-sided normal score of the same tail; of a sum with any covariance its level is kept."""
    for chi_square, freedom in ((3.84, 1), (25.0, 10), (60.0, 30)):
        expected = stats.norm.isf(0.5 * stats.chi2(freedom).sf(chi_square))
        assert normal_score(chi_square, freedom) == pytest.approx(expected, rel=1e-9)
    rng = np.random.default_rng(2)
    root = rng.normal(size=(12, 12)) * np.linspace(0.3, 2, 12)
    information = root @ root.T
    scores = np.array([quadratic_score(root @ rng.normal(size=12), information) for _ in range(4000)])
    # Satterthwaite's law of a weighted sum is good to some per cent; 2 for the Monte Carlo error
    for level in (0.01, 0.05, 0.2):
        assert np.mean(scores > stats.norm.isf(0.5 * level)) == pytest.approx(
            level, abs=4 * np.sqrt(level / 4000) + 0.02
        )
    assert at_least_one(0.01, 5) == pytest.approx(1 - 0.99**5, rel=1e-12)
