"""Damped Newton steps of many minimisations at once."""

from __future__ import annotations

import numpy as np

from bayestouch.sampling.laplace import damped_newton_steps


def quadratics() -> tuple[np.ndarray, np.ndarray]:
    """Gradients (n, d) and Hessians (n, d, d), correlated and of very different scales."""
    rng = np.random.default_rng(1)
    roots = rng.standard_normal((5, 3, 3)) * np.array([1.0, 10.0, 0.1])
    return rng.standard_normal((5, 3)), roots.swapaxes(1, 2) @ roots + 0.1 * np.eye(3)


def test_without_damping_one_step_reaches_the_minimum_of_a_quadratic() -> None:
    gradient, hessian = quadratics()
    step = damped_newton_steps(gradient, hessian, np.zeros(5))
    # at the minimum the gradient is zero; rounding grows by the condition of the Hessians, up to 1e6
    np.testing.assert_allclose(np.einsum("nij,nj->ni", hessian, step), gradient, rtol=0, atol=1e-9)


def test_each_has_its_own_damping_in_proportion_to_its_diagonal() -> None:
    """Against each solved by itself; and steps do not depend on the units of a parameter."""
    gradient, hessian = quadratics()
    damping = np.array([0.0, 0.01, 0.5, 3.0, 1e4])
    step = damped_newton_steps(gradient, hessian, damping)
    for one in range(5):
        raised = hessian[one].copy()
        for axis in range(3):
            raised[axis, axis] *= 1 + damping[one]
        np.testing.assert_allclose(step[one], np.linalg.inv(raised) @ gradient[one], rtol=1e-8)
    units = np.array([1e3, 1.0, 1e-2])
    other = damped_newton_steps(gradient * units, hessian * units * units[:, None], damping)
    np.testing.assert_allclose(other * units, step, rtol=1e-8)
