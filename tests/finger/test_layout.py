"""The flat vector of a finger's parameters, and its prior."""

from __future__ import annotations

import numpy as np

from bayestouch.finger.layout import FlatPrior
from bayestouch.priors.parameters import LogNormal, Normal


def test_the_prior_of_normal_coordinates_is_counted_in_their_own_sds() -> None:
    """Two sds off in the first coordinate, three in the second, none in the others: -(4 + 9)/2."""
    prior = FlatPrior.of(
        1,
        (
            LogNormal(np.exp(1.0), 0.5),
            Normal(4.0, 0.1),
            Normal(0.3, 0.2),
            Normal(0.45, 0.02),
            LogNormal(1.0, 0.3),
            LogNormal(np.exp(-2.0), 1.5),
            LogNormal(1.0, 0.7),
        ),
    )
    off = np.array([1.0 + 2 * 0.5, 4.0 - 3 * 0.1, 0.3, 0.45, 0.0, -2.0, 0.0])
    np.testing.assert_allclose(prior.log_density(off), -6.5, rtol=1e-9)
