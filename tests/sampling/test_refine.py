"""A normal proposal that is moved and reshaped to its target."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayestouch.sampling.refine import ENOUGH, refined

FloatArray = NDArray[np.float64]


def test_a_proposal_becomes_its_normal_target() -> None:
    """Off by two to four of its standard deviations, too narrow or too wide by half, two coordinates correlated."""
    sd = np.array([1.0, 0.5, 1.6, 1.0, 1.0])
    mean = np.array([0.0, 2.0, -3.0, 4.0, 0.0])
    covariance = np.diag(sd**2)
    covariance[3, 4] = covariance[4, 3] = 0.8
    precision = np.linalg.inv(covariance)

    def log_density(x: FloatArray) -> FloatArray:
        return -0.5 * np.einsum("ni,ij,nj->n", x - mean, precision, x - mean)

    rng = np.random.default_rng(0)
    centre, found = refined(log_density, np.zeros(5), np.eye(5), np.array([3, 4]), rng)
    root = np.linalg.cholesky(found)
    z = rng.standard_normal((4000, 5))
    ratio = log_density(centre + z @ root.T) + 0.5 * (z**2).sum(axis=1)
    assert ratio.std() < ENOUGH
    if ratio.std() < 1e-6:
        np.testing.assert_allclose(found, covariance, rtol=1e-6, atol=1e-6)


def test_a_good_proposal_is_kept() -> None:
    rng = np.random.default_rng(0)
    centre, covariance = np.ones(3), 2 * np.eye(3)
    found = refined(lambda x: -0.25 * ((x - 1) ** 2).sum(axis=1), centre, covariance, np.arange(0), rng)
    np.testing.assert_array_equal(found[0], centre)
    np.testing.assert_array_equal(found[1], covariance)
