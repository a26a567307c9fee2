"""Pareto-smoothed weights, as ArviZ has them, and tails that do not count."""

from __future__ import annotations

import arviz as az
import numpy as np
import pytest

from bayestouch.sampling import pareto_shape, pareto_smooth
from bayestouch.sampling.pareto import shape_that_counts


@pytest.mark.skipif("psislw" not in vars(az), reason="ArviZ 1 fits a tail that is one draw shorter (floor, not ceil)")
def test_pareto_smoothing_is_that_of_arviz() -> None:
    rng = np.random.default_rng(3)
    log_weights = rng.standard_t(3, size=(7, 1000)) * np.array([0.1, 0.5, 1, 2, 3, 1, 1])[:, None]
    log_weights[1, :950] = -np.inf  # the cut falls among the zero weights
    log_weights[2, 900:] = log_weights[2, 900]  # ties
    log_weights[5, :997] = -np.inf  # too few
    log_weights[6] = 0.0  # all the same
    weights, shape = pareto_smooth(log_weights.copy())
    for block in range(7):
        expected, k = az.psislw(log_weights[block].copy())
        assert shape[block] == pytest.approx(float(k), rel=1e-6)
        np.testing.assert_allclose(weights[block], np.exp(expected), rtol=1e-6, atol=1e-12)
    np.testing.assert_array_equal(pareto_shape(log_weights), shape)


def test_a_tail_without_weight_does_not_count() -> None:
    """Weights near 1, and a few of 1.2 to 1.5 or of 2 to 6: tails of shape above 0.5, of 0.2 and 3 % of all weights."""
    n = 2000
    even = 1 + 1e-3 * np.arange(n)[None] / n
    weights = np.concatenate([even, even, even])
    weights[0, :12] = np.linspace(1.2, 1.5, 12)
    weights[1, :20] = np.linspace(2.0, 6.0, 20)
    weights[2] = 1e-300
    weights[2, :3] = 1.0
    shape = pareto_shape(np.log(weights))
    assert (shape > 0.5).all()
    found = shape_that_counts(np.log(weights), shape)
    assert found[0] == 0.0
    np.testing.assert_array_equal(found[1:], shape[1:])
    # A shape that is no cause for doubt is given back as it is, and so is that of a row without any weight.
    np.testing.assert_array_equal(shape_that_counts(np.log(weights[:1]), np.array([0.4])), [0.4])
    assert np.isposinf(shape_that_counts(np.full((1, 100), -np.inf), np.array([np.inf]))).all()


def test_pareto_smoothing_without_any_weight() -> None:
    weights, shape = pareto_smooth(np.full((2, 100), -np.inf))
    assert np.all(weights == 0) and np.all(np.isposinf(shape))
