"""Conditional density of the noise of an element, on a grid."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.finger.layout import FlatPrior
from bayestouch.finger.noise import _element_log_density, _masses, _moments
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
    found = _element_log_density(known, prior, 0, (empty, empty, empty, empty), [np.log(s)], 0.0)
    np.testing.assert_allclose(np.exp(found), s**-6 * np.exp(-1.5 / s**2), rtol=1e-9)


def test_a_grid_follows_a_density_that_is_narrower_than_its_steps() -> None:
    """Mean and sd of a normal density of sd 0.01 on steps of 0.15, beside one of sd 1; other grids stay as they are."""
    wide, coarse = np.linspace(-6, 6, 41), np.arange(-2.0, 2.0, 0.15)

    def log_density(axes: list[FloatArray]) -> FloatArray:
        return np.asarray(-0.5 * axes[0][:, None] ** 2 - 0.5 * ((axes[1] - 0.337) / 0.01) ** 2)

    (first, second), mass = _masses([wide, coarse], log_density)
    assert first is wide and len(second) == len(coarse)
    mean, covariance = _moments([first, second], mass)
    # Steps of less than one standard deviation: the sum is that of the integral to 1e-3 of the width.
    np.testing.assert_allclose(mean, [0, 0.337], atol=2e-5)
    np.testing.assert_allclose(np.sqrt(np.diag(covariance)), [1, 0.01], rtol=1e-3)
    np.testing.assert_allclose(np.diff(second), second[1] - second[0])
