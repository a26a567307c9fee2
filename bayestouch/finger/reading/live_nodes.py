"""Posterior of one touch on a finger as a sum over indenters, each with a nearly normal location and load.

For a given indenter, location and load are nearly normal: a Newton step finds their mode, and a small Gauss-Hermite
grid about it, weighted with the exact density, gives their moments and the evidence of the indenter. Indenters are the
known tips, and evenly spaced knots in w for a density of R (trapezoidal rule, whose error falls exponentially with the
spacing for a smooth density).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.finger.reading.conditional_modes import (
    ANGLE_STEP,
    LEAST_WEIGHT,
    LOAD_STEP,
    LONGEST_STEP,
    bounded_product,
)
from bayestouch.finger.reading.live_density import OneTouch

# Newton steps of location and load for the indenters: largest number, and length (sd) at which the search ends.
MOST_STEPS, SETTLED = 12, 0.7
# Difference of log probability from the most probable indenter at which an indenter is negligible.
NEGLIGIBLE = 12.0
# Largest sd of the location over the width of its prior: so at most one of the outer points, at 1.73 sd, is beyond it.
WIDEST = 0.28
# Centre, and both neighbours in location (rad) and in load (in steps).
_ANGLES, _LOADS = ANGLE_STEP * np.array([0.0, 1, -1, 0, 0]), np.array([0.0, 0, 0, 1, -1])


def _hermite(n_angle: int, n_load: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Standard normal points (n,) and (n,), and the logarithm of weight over the normal density of exp(-z²/2)."""
    one, two = (np.polynomial.hermite_e.hermegauss(n) for n in (n_angle, n_load))
    z1, z2 = (each.ravel() for each in np.meshgrid(one[0], two[0], indexing="ij"))
    log_weight = np.log(np.outer(one[1], two[1]).ravel()) + 0.5 * (z1**2 + z2**2)
    return z1, z2, log_weight


_Z1, _Z2, _LOG_WEIGHT = _hermite(3, 3)
_N = len(_Z1)


@dataclass(frozen=True, eq=False)
class Nodes:
    """Indenters of one touch with their probabilities, and location and load given each; g indenters.

    Attributes
    ----------
    radius : (g,) array
        R of each, mm.
    log_mass : (g,) array
        Log of evidence times prior probability of each, up to a constant.
    log_rise : (g,) array
        Logarithm of the exact integral over location and load over that of the normal approximation.
    mean : (2, g) array
        Mean location (rad) and load (N/m) for each indenter.
    covariance : (3, g) array
        Their covariance as 11, 12, 22.
    """

    radius: FloatArray
    log_mass: FloatArray
    log_rise: FloatArray
    mean: FloatArray
    covariance: FloatArray


def nodes_of(touch: OneTouch, radius: FloatArray, log_prior: FloatArray, angle: FloatArray, load: FloatArray) -> Nodes:
    """Integrals over location and load for indenters R (g,), mm, with log prior masses (g,).

    `angle` (rad) and `load` (N/m), (g,), are where the search for the modes starts.
    """
    (angle, load), curvature = _conditional_modes(touch, radius, log_prior, angle, load)
    c11, c12, c22 = curvature
    determinant = c11 * c22 - c12 * c12
    low, high, *_ = touch.ends
    exact = np.sqrt(c22 / determinant)
    l11, l21, l22 = np.minimum(exact, WIDEST * (high - low)), -c12 / (determinant * exact), 1 / np.sqrt(c22)
    z1, z2 = _Z1[:, None], _Z2[:, None]
    angles, loads = angle + l11 * z1, load + l21 * z1 + l22 * z2
    log = touch.log_density(np.tile(radius, _N), angles.ravel(), loads.ravel()).reshape(_N, -1) + _LOG_WEIGHT[:, None]
    top = log.max(axis=0)
    top = np.where(np.isfinite(top), top, 0.0)
    weight = np.exp(log - top)
    total = weight.sum(axis=0)
    weight /= np.maximum(total, 1e-300)
    mean = np.stack([(weight * angles).sum(axis=0), (weight * loads).sum(axis=0)])
    d1, d2 = angles - mean[0], loads - mean[1]
    w1 = weight * d1
    covariance = np.stack([(w1 * d1).sum(axis=0), (w1 * d2).sum(axis=0), (weight * d2 * d2).sum(axis=0)])
    with np.errstate(divide="ignore"):
        log_evidence = np.log(total) + top
    rise = log_evidence - log[_N // 2] + _LOG_WEIGHT[_N // 2] - np.log(2 * np.pi)
    return Nodes(radius, log_prior + log_evidence + np.log(l11 * l22), rise, mean, covariance)


def _conditional_modes(
    touch: OneTouch, radius: FloatArray, log_prior: FloatArray, angle: FloatArray, load: FloatArray
) -> tuple[tuple[FloatArray, FloatArray], FloatArray]:
    """Modes of (θ_c, P) for indenters R (g,), and minus the Hessian there as 11, 12, 22; as `conditional_modes`."""
    low, high, least, most = touch.ends
    g = len(radius)
    wide, precision = np.repeat(radius, 5), 0.0
    if touch.load == touch.load:
        precision = 1 / touch.load_sd**2
    for _ in range(MOST_STEPS):
        scale = np.maximum(load, 1e-3)
        load_step = LOAD_STEP * scale
        angles = (angle[:, None] + _ANGLES).ravel()
        loads = (load[:, None] + load_step[:, None] * _LOADS).ravel()
        z = touch.residual(wide, angles, loads).reshape(g, 5, -1)
        differences = np.stack([z[:, 0], z[:, 1] - z[:, 2], z[:, 3] - z[:, 4]], axis=1)
        square = (differences @ differences.swapaxes(1, 2)).astype(np.float64).reshape(g, 9).T
        by_angle, by_load = 0.5 / ANGLE_STEP, 0.5 / load_step
        c11 = square[4] * by_angle**2 + 1 / (high - low) ** 2
        c12 = bounded_product(square[5], square[4], square[8]) * by_angle * by_load
        c22 = square[8] * by_load**2 + precision + LEAST_WEIGHT / scale**2
        d1, d2 = -square[1] * by_angle, -square[2] * by_load
        value = log_prior - 0.5 * square[0]
        if precision:
            miss = load - touch.load
            d2 -= precision * miss
            value -= 0.5 * precision * miss * miss
        determinant = c11 * c22 - c12 * c12
        s1, s2 = (c22 * d1 - c12 * d2) / determinant, (c11 * d2 - c12 * d1) / determinant
        square_length = np.maximum(s1 * d1 + s2 * d2, 0.0)
        length = np.sqrt(square_length)
        share = np.minimum(1.0, LONGEST_STEP / np.maximum(length, 1e-12))
        angle = np.minimum(np.maximum(angle + share * s1, low + 1e-9), high - 1e-9)
        load = np.minimum(np.maximum(load + share * s2, least + 1e-9), most - 1e-9)
        value += 0.5 * square_length
        if length[value > value.max() - NEGLIGIBLE].max() < SETTLED:
            break
    return (angle, load), np.stack([c11, c12, c22])
