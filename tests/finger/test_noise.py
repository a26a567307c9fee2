"""Noise of a finger as an unknown: densities on grids against the normal density that they stand for."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm

from bayestouch.finger.known_touches import KnownTouches
from bayestouch.finger.layout import FlatLayout, FlatPrior
from bayestouch.finger.noise import Residuals, _force_noise
from bayestouch.priors.parameters import LogNormal, Normal


def test_force_noise_from_residuals_that_go_with_the_load() -> None:
    """Each touch of one element leaves a residual of variance 1/w + (slope · s_F)²/n: quadrature over log s_F."""
    left, slope, weight, reads = np.array([3.0, -5.0, 2.0]), np.array([2.0, 1.0, 4.0]), 0.25, np.array([1.0, 4.0, 2.0])
    known = KnownTouches(
        radius_mm=np.ones(3),
        angle=np.zeros(3),
        load=np.full(3, 100.0),
        load_reads=reads,
        readings=np.zeros((3, 1)),
        counts=np.ones((3, 1), dtype=np.int64),
        scatter=np.zeros(1),
        scatter_dof=np.zeros(1),
    )
    layout = FlatLayout(1, False)
    same: tuple[Normal | LogNormal, ...] = (Normal(0.0, 1.0),) * layout.size
    mean, spread = np.zeros(layout.size), np.full(layout.size, 0.5)
    prior = FlatPrior(layout, same, np.zeros(layout.size, dtype=bool), mean, spread)
    found = _force_noise(known, prior, Residuals(left[:, None], slope[:, None], np.zeros(1)), np.full((3, 1), weight))
    grid = np.linspace(-4.0, 4.0, 4001)
    variance = 1 / weight + (slope * np.exp(grid)[:, None]) ** 2 / reads
    density = norm.pdf(left, 0.0, np.sqrt(variance)).prod(axis=1) * norm.pdf(grid, 0.0, 0.5)
    density /= density.sum()
    expected = density @ grid
    # both sums are of a smooth density that ends far inside the grid: only rounding is left
    assert found == pytest.approx((expected, density @ (grid - expected) ** 2), rel=1e-6)
