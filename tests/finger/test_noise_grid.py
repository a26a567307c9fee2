"""Grids that follow the width of a density."""

from __future__ import annotations

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.finger.noise import _moments
from bayestouch.finger.noise_grid import masses_on_grid


def test_a_grid_follows_a_density_that_is_narrower_than_its_steps() -> None:
    """Mean and sd of a normal density of sd 0.01 on steps of 0.15, beside one of sd 1; other grids stay as they are."""
    wide, coarse = np.linspace(-6, 6, 41), np.arange(-2.0, 2.0, 0.15)

    def log_density(axes: list[FloatArray]) -> FloatArray:
        return np.asarray(-0.5 * axes[0][:, None] ** 2 - 0.5 * ((axes[1] - 0.337) / 0.01) ** 2)

    (first, second), mass = masses_on_grid([wide, coarse], log_density)
    assert first is wide and len(second) == len(coarse)
    mean, covariance = _moments([first, second], mass)
    # Steps of less than one standard deviation: the sum is that of the integral to 1e-3 of the width.
    np.testing.assert_allclose(mean, [0, 0.337], atol=2e-5)
    np.testing.assert_allclose(np.sqrt(np.diag(covariance)), [1, 0.01], rtol=1e-3)
    np.testing.assert_allclose(np.diff(second), second[1] - second[0])
