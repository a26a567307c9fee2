"""Newton steps in location and load on quadratic densities, where one step is exact."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from bayestouch.finger.reading import conditional_modes as module
from bayestouch.priors.parameters import Normal, Uniform

CURVATURE = np.array([[4.0, 1.0], [1.0, 9.0]])
FLAT = np.array([4.0, 1.0, 9.0])[:, None, None]


def test_root_of_a_two_by_two_inverse() -> None:
    wanted = np.linalg.cholesky(np.linalg.inv(CURVATURE))
    np.testing.assert_allclose(module.root_of_inverse(FLAT)[0, 0], [wanted[0, 0], wanted[1, 0], wanted[1, 1]])


def test_newton_step() -> None:
    gradient = np.array([2.0, -5.0])
    step, length = module._newton_step(gradient[:, None, None], FLAT)
    wanted = np.linalg.solve(CURVATURE, gradient)
    np.testing.assert_allclose(step[0, 0], wanted)
    np.testing.assert_allclose(length[0, 0], np.sqrt(gradient @ wanted))


def test_a_product_is_not_larger_than_that_of_the_lengths() -> None:
    product, one, other = np.array([1.0, 6.0 + 1e-6, -6.0 - 1e-6]), np.full(3, 4.0), np.full(3, 9.0)
    np.testing.assert_array_equal(module.bounded_product(product, one, other), [1.0, 6.0, -6.0])


class Linear:
    """Three residuals that are linear in location and load, and go with w; a normal prior of the load."""

    priors = SimpleNamespace(location=Uniform(-2.0, 3.0), load=Normal(50.0, 10.0, 0.0))
    slope = np.array([[30.0, 0.2], [-10.0, 0.1], [5.0, -0.3]])

    def residual(self, x: np.ndarray, blocks: np.ndarray) -> np.ndarray:
        offset = np.array([1.0, -2.0, 0.5]) * blocks[:, None, None] + 3 * x[..., :1]
        return offset + x[..., 1:] @ self.slope.T

    def log_factor(self, x: np.ndarray, blocks: np.ndarray) -> np.ndarray:
        return -0.5 * ((x[..., 2] - 50) / 10) ** 2


def problem() -> tuple[Any, np.ndarray, np.ndarray, np.ndarray]:
    w = np.array([[0.1, 0.7], [0.2, 0.4]])
    rest = np.tile([0.3, 40.0], (2, 2, 1))
    return Linear(), w, rest, np.array([1, 2])


def test_expansion() -> None:
    """Log density, gradient and curvature; a little information that spans the priors is added."""
    posterior, w, rest, blocks = problem()
    value, gradient, bend = module._expansion(posterior, w, rest, blocks)
    for i in range(2):
        for j in range(2):
            z = np.array([1.0, -2.0, 0.5]) * blocks[i] + 3 * w[i, j] + Linear.slope @ rest[i, j]
            assert np.isclose(value[i, j], -0.5 * z @ z - 0.5)
            # Central differences are exact, but for rounding.
            np.testing.assert_allclose(gradient[:, i, j], -Linear.slope.T @ z + [0, 0.1], rtol=1e-6)
            wanted = Linear.slope.T @ Linear.slope + np.diag([1 / 25, 0.01 + 1e-3 / 1600])
            np.testing.assert_allclose(bend[:, i, j], [wanted[0, 0], wanted[0, 1], wanted[1, 1]], rtol=1e-5)


def test_modes_given_the_indenter() -> None:
    """Of a quadratic density; steps are no longer than three sds, so that it takes some of them."""
    posterior, w, rest, _ = problem()
    far = rest.copy()
    far[...] = [[0.0, 50.0], [0.2, 70.0]]
    # blocks are numbered from 0 in a search
    mode, value, curvature = module.conditional_modes(posterior, w, far)
    for i in range(2):
        for j in range(2):
            offset = np.array([1.0, -2.0, 0.5]) * i + 3 * w[i, j]
            precision = Linear.slope.T @ Linear.slope + np.diag([0.0, 0.01])
            exact = np.linalg.solve(precision, -Linear.slope.T @ offset + [0.0, 0.5])
            sd = np.sqrt(np.diag(np.linalg.inv(precision)))
            # The information that is added draws a Newton step short by a per cent.
            np.testing.assert_array_less(np.abs(mode[i, j] - exact), 0.05 * sd)
            z = offset + Linear.slope @ exact
            assert np.isclose(value[i, j], -0.5 * z @ z - 0.5 * ((exact[1] - 50) / 10) ** 2, atol=0.01)
    np.testing.assert_allclose(curvature[0], (Linear.slope[:, 0] ** 2).sum() + 1 / 25, rtol=1e-4)
