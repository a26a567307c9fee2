"""What an uncertain calibration does to readings: the product of a full Jacobian."""

from __future__ import annotations

import numpy as np

from bayestouch.finger.reading.covariance import reading_covariance


def test_covariance_of_the_readings() -> None:
    """Responses, depths and angles move their own element; Poisson's ratio and shear modulus all."""
    t, m = 2, 3
    rng = np.random.default_rng(1)
    root, jacobian = rng.standard_normal((3 * m + 2, 3 * m + 2)), rng.standard_normal((5, t, m))
    covariance = root @ root.T
    found = reading_covariance(jacobian, covariance)
    for touch in range(t):
        full = np.zeros((m, 3 * m + 2))
        for kind in range(3):
            full[np.arange(m), kind * m + np.arange(m)] = jacobian[kind, touch]
        full[:, 3 * m :] = jacobian[3:, touch].T
        np.testing.assert_allclose(found[touch], full @ covariance @ full.T, rtol=1e-12)
