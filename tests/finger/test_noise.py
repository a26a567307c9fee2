"""Noise of a finger as an unknown: densities on grids against the normal density that they stand for."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import multivariate_normal, norm

from bayestouch.array_types import FloatArray
from bayestouch.finger.known_touches import KnownTouches
from bayestouch.finger.layout import FlatLayout, FlatPrior
from bayestouch.finger.noise import Residuals, _force_noise, noise_shape
from bayestouch.priors.parameters import LogNormal, Normal


def touches(loads: FloatArray, elements: int, counts: int, scatter: FloatArray) -> KnownTouches:
    """Touches with so many reads of the force sensor, and the scatter of 40 degrees of freedom."""
    t = len(loads)
    return KnownTouches(
        radius_mm=np.ones(t),
        angle=np.zeros(t),
        load=np.full(t, 100.0),
        load_reads=loads,
        readings=np.zeros((t, elements)),
        counts=np.full((t, elements), counts),
        scatter=scatter,
        scatter_dof=np.where(scatter > 0, 40.0, 0.0),
    )


def normal_prior(layout: FlatLayout, spread: float) -> FlatPrior:
    """Normal priors about zero."""
    same: tuple[Normal | LogNormal, ...] = (Normal(0.0, 1.0),) * layout.size
    return FlatPrior(
        layout, same, np.zeros(layout.size, dtype=bool), np.zeros(layout.size), np.full(layout.size, spread)
    )


def test_force_noise_from_residuals_that_go_with_the_load() -> None:
    """Each touch of one element leaves a residual of variance 1/w + (slope · s_F)²/n: quadrature over log s_F."""
    left, slope, weight, reads = np.array([3.0, -5.0, 2.0]), np.array([2.0, 1.0, 4.0]), 0.25, np.array([1.0, 4.0, 2.0])
    known, prior = touches(reads, 1, 1, np.zeros(1)), normal_prior(FlatLayout(1, False), 0.5)
    found = _force_noise(known, prior, Residuals(left[:, None], slope[:, None], np.zeros(1)), np.full((3, 1), weight))
    grid = np.linspace(-4.0, 4.0, 4001)
    variance = 1 / weight + (slope * np.exp(grid)[:, None]) ** 2 / reads
    density = norm.pdf(left, 0.0, np.sqrt(variance)).prod(axis=1) * norm.pdf(grid, 0.0, 0.5)
    density /= density.sum()
    expected = density @ grid
    # both sums are of a smooth density that ends far inside the grid: only rounding is left
    assert found == pytest.approx((expected, density @ (grid - expected) ** 2), rel=1e-6)


# Three elements with an error that they share, far larger than their own noise and their model error.
RNG = np.random.default_rng(7)
LEFT = 9.0 * RNG.standard_normal((30, 1)) * np.array([1.0, 0.8, 1.2]) + 0.6 * RNG.standard_normal((30, 3))
SLOPE = np.array([0.5, 0.1, 0.3]) * np.ones((30, 1))
SHARED, ADDED = 9.0 * np.array([1.0, 0.8, 1.2]) * np.ones((30, 1)), np.full((30, 3), 0.04)
COMMON = Residuals(LEFT, SLOPE, np.zeros(3), ADDED, (SHARED,))


def of_touches(own: FloatArray, load_sd: float) -> float:
    """Log density of all residuals, for the variance of each element's own errors (3,) and the sd of the load."""
    covariance = np.diag(own + ADDED[0]) + np.outer(SHARED[0], SHARED[0]) + load_sd**2 * np.outer(SLOPE[0], SLOPE[0])
    return float(multivariate_normal.logpdf(LEFT, np.zeros(3), covariance).sum())


def test_an_error_that_elements_share_is_not_a_discrepancy_of_each() -> None:
    """Log s and log τ of each element, the noise of the others held: sums of the normal density written out."""
    layout = FlatLayout(3, True)
    known, prior = touches(np.full(30, 4.0), 3, 4, np.full(3, 40.0)), normal_prior(layout, 1.0)
    shape = noise_shape(known, prior, np.zeros(layout.size), COMMON)
    held = np.full(3, 1 / 4 + 1 / 4)  # s = 1, τ = 1, 4 reads
    log_s, log_tau = np.linspace(-0.8, 0.8, 41), np.linspace(-5.0, 3.0, 81)
    for e in range(3):
        log_density = np.empty((len(log_s), len(log_tau)))
        for i, s in enumerate(log_s):
            for j, tau in enumerate(log_tau):
                own = held.copy()
                own[e] = np.exp(2 * s) * (1 + np.exp(2 * tau)) / 4
                scatter = -40 * s - 20 * np.exp(-2 * s)
                log_density[i, j] = of_touches(own, 0.5) + scatter - 0.5 * (s**2 + tau**2)
        mass = np.exp(log_density - log_density.max())
        mass /= mass.sum()
        expected = mass.sum(axis=1) @ log_s, mass.sum(axis=0) @ log_tau
        # sums over the grid of `noise_shape`, whose steps are half a standard deviation
        np.testing.assert_allclose((shape.mean[e], shape.mean[3 + e]), expected, atol=0.01)


def test_force_noise_beside_an_error_that_elements_share() -> None:
    layout = FlatLayout(3, False)
    known, prior = touches(np.full(30, 4.0), 3, 4, np.zeros(3)), normal_prior(layout, 0.5)
    found = _force_noise(known, prior, COMMON, 1 / (0.25 + ADDED))
    grid = np.linspace(-4.0, 4.0, 401)
    log_density = np.array([of_touches(np.full(3, 0.25), np.exp(each) / 2) for each in grid]) - 2 * grid**2
    mass = np.exp(log_density - log_density.max())
    mass /= mass.sum()
    assert found == pytest.approx((mass @ grid, mass @ grid**2 - (mass @ grid) ** 2), rel=1e-4)
