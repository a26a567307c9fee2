"""Posterior of one touch on a finger as a sum over indenters, each with a nearly normal location and load.

For a given indenter, location and load are nearly normal: a Newton step finds their mode, and a small Gauss-Hermite
grid about it, weighted with the exact density, gives their moments and the evidence of the indenter. Indenters are the
known tips, and evenly spaced knots in w for a density of R (trapezoidal rule, whose error falls exponentially with the
spacing for a smooth density). Beside the elements the location may have a long tail on one side, which that grid does
not reach: it then has even points, too.
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
# Distance (sd) at which the tails of the location are looked at; sum of both densities there, over that at the mode,
# above which three points are not enough. Those of a normal one are 7e-4 together; a tail of 5e-3 that falls by e in
# one sd adds some 3 % to the variance. The location then has so many even points on either side, in steps of so many
# sd: their error falls exponentially with the step, and they reach nine sd.
FAR_OUT, TAIL, WIDE, WIDE_STEP = 4.0, 5e-3, 12, 0.75
# Two normal distributions are one hump if they are not farther apart than so many sd: three points integrate one hump.
HUMPS = 2.0
# Centre, and both neighbours in location (rad) and in load (in steps).
_ANGLES, _LOADS = ANGLE_STEP * np.array([0.0, 1, -1, 0, 0]), np.array([0.0, 0, 0, 1, -1])


@dataclass(frozen=True, eq=False)
class Rule:
    """Points of an integral over location and load in standard coordinates, (n, 1), and their log weights.

    `log_weight` is the logarithm of the weight over the normal density exp(-z²/2), minus infinity for points that are
    looked at only. `centre` is the index of the point (0, 0). `reach` is how far from it another hump is integrated.
    """

    z1: FloatArray
    z2: FloatArray
    log_weight: FloatArray
    centre: int
    reach: float

    @classmethod
    def of(cls, angle: FloatArray, log_weight: FloatArray, reach: float) -> Rule:
        """From points of the location (a,) and their log weights; three Gauss-Hermite points of the load for each."""
        points, weights = np.polynomial.hermite_e.hermegauss(3)
        z1, z2 = (each.ravel()[:, None] for each in np.meshgrid(angle, points, indexing="ij"))
        total = (log_weight[:, None] + np.log(weights) + 0.5 * points**2).reshape(-1, 1)
        return cls(z1, z2, total, int(np.argmin(z1**2 + z2**2)), reach)


def _near() -> Rule:
    """Three Gauss-Hermite points of the location; and two farther out, which show whether that is enough."""
    points, weights = np.polynomial.hermite_e.hermegauss(3)
    rule = Rule.of(points, np.asarray(np.log(weights) + 0.5 * points**2, dtype=np.float64), HUMPS)
    nothing = np.full((2, 1), -np.inf)
    z1 = np.concatenate([rule.z1, [[-FAR_OUT], [FAR_OUT]]])
    z2 = np.concatenate([rule.z2, np.zeros((2, 1))])
    return Rule(z1, z2, np.concatenate([rule.log_weight, nothing]), rule.centre, HUMPS)


NEAR_RULE = _near()
WIDE_RULE = Rule.of(
    np.linspace(-WIDE * WIDE_STEP, WIDE * WIDE_STEP, 2 * WIDE + 1),
    np.full(2 * WIDE + 1, float(np.log(WIDE_STEP))),
    WIDE * WIDE_STEP,
)


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
    mode, reach : (g,) arrays
        Location (rad) that the integral is about, and how far from it another hump of the density is in the integral.
    """

    radius: FloatArray
    log_mass: FloatArray
    log_rise: FloatArray
    mean: FloatArray
    covariance: FloatArray
    mode: FloatArray
    reach: FloatArray


def nodes_of(
    touch: OneTouch,
    radius: FloatArray,
    log_prior: FloatArray,
    angle: FloatArray,
    load: FloatArray,
    *,
    tails: bool = True,
) -> Nodes:
    """Integrals over location and load for indenters R (g,), mm, with log prior masses (g,).

    `angle` (rad) and `load` (N/m), (g,), are where the search for the modes starts. Without `tails` three points of the
    location are used, also where it has a long tail.
    """
    (angle, load), curvature = _conditional_modes(touch, radius, log_prior, angle, load)
    c11, c12, c22 = curvature
    determinant = c11 * c22 - c12 * c12
    low, high, *_ = touch.ends
    exact = np.sqrt(c22 / determinant)
    l11, l21, l22 = np.minimum(exact, WIDEST * (high - low)), -c12 / (determinant * exact), 1 / np.sqrt(c22)
    place, root = (radius, log_prior, angle, load), (l11, l21, l22)
    nodes, log = _integrated(touch, place, root, NEAR_RULE)
    if not tails:
        return nodes
    mass = np.exp(nodes.log_mass - nodes.log_mass.max())
    # A tail as high as the mode is enough to know; the mode of an improbable indenter may be where there is no density.
    tail = np.exp(np.minimum(log[-2:] - np.maximum(log[NEAR_RULE.centre], -1e300), 0.0)).sum(axis=0)
    if float(tail @ mass) > TAIL * float(mass.sum()):
        nodes, _ = _integrated(touch, place, root, WIDE_RULE)
    return nodes


def _integrated(
    touch: OneTouch, place: tuple[FloatArray, ...], root: tuple[FloatArray, ...], rule: Rule
) -> tuple[Nodes, FloatArray]:
    """Integrals by a rule, and the log densities (n, g) at its points.

    `place` has R, log prior masses and modes of θ_c and P, and `root` the Cholesky factor 11, 21, 22 of their
    covariance; (g,) each.
    """
    (radius, log_prior, angle, load), (l11, l21, l22) = place, root
    n = len(rule.z1)
    angles, loads = angle + l11 * rule.z1, load + l21 * rule.z1 + l22 * rule.z2
    density = touch.log_density(np.tile(radius, n), angles.ravel(), loads.ravel()).reshape(n, -1)
    log = density + rule.log_weight
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
    rise = log_evidence - density[rule.centre] - np.log(2 * np.pi)
    log_mass = log_prior + log_evidence + np.log(l11 * l22)
    return Nodes(radius, log_mass, rise, mean, covariance, angle, rule.reach * l11), density


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
