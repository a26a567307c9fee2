"""Conditional density of the noise of an element, on a grid."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from bayestouch.finger.layout import FlatPrior
from bayestouch.finger.noise import _element_log_density
from bayestouch.priors.parameters import LogNormal, Normal


def test_repeats_alone_give_the_density_of_a_variance_from_its_sum_of_squares() -> None:
    """No mean reading of the element is there: s^-6 exp(-1.5/s²) times a prior that is flat where it counts."""
    flat = LogNormal(1.0, 1e6)
    normal = Normal(0.0, 1.0)
    prior = FlatPrior.of(1, (flat, normal, normal, normal, flat, flat, flat))
    known: Any = SimpleNamespace(
        scatter_dof=np.array([6.0]),
        scatter=np.array([3.0]),
        counts=np.zeros((0, 1)),
        missing=np.zeros((0, 1), dtype=bool),
    )
    empty, s = np.zeros(0), np.array([0.5, 1.0, 2.0])
    found = _element_log_density(known, prior, 0, (empty, empty), [np.log(s)], 0.0)
    np.testing.assert_allclose(np.exp(found), s**-6 * np.exp(-1.5 / s**2), rtol=1e-9)
