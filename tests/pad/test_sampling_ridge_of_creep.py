"""Draws of a creep that is slower than the touches are held, against Laplace's approximation at each time constant."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

import bayestouch
from bayestouch.array_types import FloatArray
from bayestouch.calibration.with_effects import fit_stated
from bayestouch.effects.stated import StatedModel
from bayestouch.pad.density import PadDensity
from bayestouch.pad.sampling import sample_density


@pytest.fixture(scope="module")
def density() -> PadDensity:
    design = bayestouch.PadDesign(
        element_x_mm=(0.0, 5.0, 10.0), element_y_mm=None, samples_per_touch=4, calibration_step_mm=0.75, n_touches=2
    )
    made = bayestouch.simulate(design, effects={"creep": 0.3, "creep.time": 3.0}, seed=2)
    stated = fit_stated(made.dataset, StatedModel("pad", "", (("creep", {}),)), draws=8, seed=0, kernel="gaussian")
    return PadDensity.of(stated.fitted)


def moments_of_log_time(density: PadDensity) -> tuple[float, float]:
    """Mean and standard deviation of the last entry; at each value all others are optimised and integrated out."""
    grid, log_density = np.linspace(-1.5, 4.0, 12), []
    unit, start = np.sqrt(np.diag(density.covariance))[:-1], density.mode[:-1]
    near = int(np.argmin(np.abs(grid - density.mode[-1])))
    found: dict[int, FloatArray] = {near: np.zeros(len(unit))}
    for i in [*range(near, len(grid)), *reversed(range(near))]:

        def cost(z: FloatArray, value: float = float(grid[i])) -> float:
            return -float(density(np.append(start + unit * z, value)))

        before = found.get(i, found.get(i - 1, found.get(i + 1)))
        assert before is not None
        found[i] = np.asarray(minimize(cost, before, method="BFGS").x)
    for i, value in enumerate(grid):
        steps = 0.1 * np.eye(len(unit))
        moves = np.array([a + b for a in steps for b in steps] + [a - b for a in steps for b in steps])
        points = found[i] + np.concatenate([moves, -moves, np.zeros((1, len(unit)))])
        at = density(np.column_stack([start + unit * points, np.full(len(points), value)]))
        plus, minus, plus_back, minus_back = at[:-1].reshape(4, len(unit), len(unit))
        hessian = -(plus + plus_back - minus - minus_back) / (4 * 0.1**2)
        log_density.append(at[-1] - 0.5 * np.linalg.slogdet(hessian)[1])
    weight = np.exp(np.array(log_density) - np.max(log_density))
    mean = float(weight @ grid / weight.sum())
    return mean, float(np.sqrt(weight @ (grid - mean) ** 2 / weight.sum()))


@pytest.mark.slow
def test_draws_reach_along_the_ridge(density: PadDensity) -> None:
    """Only share over time is known. Draws about the mode alone had three quarters of this standard deviation."""
    drawn = sample_density(density, 4000, seed=1)
    log_time = drawn.draws[:, :, 0, -1]
    mean, sd = moments_of_log_time(density)
    assert sd > 0.4
    # Some 3,000 independent draws: the standard deviation to 1.3 %, the mean to 1.8 % of it.
    assert log_time.std() == pytest.approx(sd, rel=0.05)
    assert log_time.mean() == pytest.approx(mean, abs=0.06 * sd)
    assert drawn.rhat.max() < 1.01
