"""Evidence of one touch for each of several indenters, with location, load and calibration unknown."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray
from bayestouch.errors import InputError
from bayestouch.reliability.known_finger import KnownFinger, TouchPlaces
from bayestouch.sampling.laplace import damped_newton_steps

# The search for the location starts from the best of a grid with this step; a strain profile is about 20° wide.
START_STEP = np.radians(1.0)
MARGIN = np.radians(10.0)
STEP_ANGLE, STEP_LOAD, BEND_STEP = 1e-3, 1e-3, 5e-3
ITERATIONS = 6
# The integral over the location reaches REACH standard deviations beyond the fits, with NODES about each. Readings are
# nearly linear in the load, so that LOAD_STEPS steps with one slope find the load at each node.
REACH, NODES, LOAD_STEPS = 6.0, 16, 2
# Half a difference of squared residuals, as a log likelihood: exp(-20) is 2e-9.
NEGLIGIBLE = 20.0


def log_evidence(
    known: KnownFinger,
    readings: ArrayLike,
    radius_mm: ArrayLike,
    *,
    load: ArrayLike | None = None,
    samples: int = 1,
) -> FloatArray:
    """Log marginal likelihood of touches for each of several radii.

    For a given radius and location the load is approximately normal, so it is integrated by Laplace's method. The
    location is integrated by quadrature about the two best fits, because a touch that one element reads almost alone
    may be on either side of it. Errors of the calibration are included in the covariance of the readings. Priors of
    location and load are flat and equal for all radii.

    Parameters
    ----------
    known : KnownFinger
        The calibrated finger.
    readings : (t, m) array_like
        Mean readings of each touch, rest reading subtracted.
    radius_mm : (k,) array_like
        Composite radii R.
    load : (t,) array_like, optional
        Measured loads, N/m; if missing, the load is unknown.
    samples : int
        Number of samples in each mean.

    Returns
    -------
    (t, k) array
        Log marginal likelihood, up to a constant for each touch.
    """
    data = np.atleast_2d(np.asarray(readings, dtype=float))
    if data.shape[1] != known.n_elements or not np.all(np.isfinite(data)):
        raise InputError(f"expected finite readings of {known.n_elements} elements, got shape {data.shape}")
    radii = np.atleast_1d(np.asarray(radius_mm, dtype=float))
    measured = None if load is None else np.asarray(load, dtype=float)
    load_sd = known.load_sd(samples, measured is not None)
    columns = []
    for radius in radii:
        first, second = _starts(known, data, float(radius), measured)
        noise = np.broadcast_to(np.sqrt(known.noise_variance(samples)), data.shape)
        root = noise[:, :, None] * np.eye(known.n_elements)
        fit = _fitted(known, data, first, root, measured, load_sd)
        # The covariance of the calibration's errors changes slowly with the touch, so its value at this fit is used.
        root = np.asarray(np.linalg.cholesky(known.covariance(fit.touches, samples)), dtype=np.float64)
        one, other = (_fitted(known, data, each, root, measured, load_sd) for each in (fit.touches, second))
        log_root = np.log(np.einsum("tii->ti", root)).sum(axis=1)
        columns.append(_log_integral(known, data, (one, other), root, measured, load_sd) - log_root)
    return np.stack(columns, axis=1)


def _starts(
    known: KnownFinger, data: FloatArray, radius: float, measured: FloatArray | None
) -> tuple[TouchPlaces, TouchPlaces]:
    """Best fits on a grid of locations: the best, and the best of the other minima (or again the best)."""
    place = known.chain.angle
    angles = np.arange(place.min() - MARGIN, place.max() + MARGIN, START_STEP)
    typical = known.typical_load
    template = known.chain.predict(np.full(len(angles), radius), angles, np.full(len(angles), typical)) / typical
    weights = 1 / known.noise_variance(1)
    cross, power = (weights * data) @ template.T, weights @ (template**2).T
    best = np.clip(cross / power, 0.02 * typical, 3 * typical) if measured is None else measured[:, None]
    cost = power * best**2 - 2 * cross * best
    load, rows = np.broadcast_to(best, cost.shape), np.arange(len(data))
    k = cost.argmin(axis=1)
    higher = np.pad(np.diff(cost, axis=1) > 0, ((0, 0), (1, 1)), constant_values=((0, 0), (False, True)))
    minimum = higher[:, 1:] & ~higher[:, :-1]
    minimum[rows, k] = False
    other = np.where(minimum.any(axis=1), np.where(minimum, cost, np.inf).argmin(axis=1), k)
    first, second = (TouchPlaces(np.full(len(data), radius), angles[i], load[rows, i].copy()) for i in (k, other))
    return first, second


@dataclass(frozen=True, eq=False)
class _Fit:
    """Fitted touches (t), half the squared residuals, and the standard deviation of each location, rad; (t,) each."""

    touches: TouchPlaces
    cost: FloatArray
    angle_sd: FloatArray


def _fitted(
    known: KnownFinger,
    data: FloatArray,
    touches: TouchPlaces,
    root: FloatArray,
    measured: FloatArray | None,
    load_sd: float,
) -> _Fit:
    """Gauss-Newton fit of location and load."""
    angle, load = touches.angle.copy(), touches.load.copy()
    predict, radius = known.chain.predict, touches.radius_mm
    whitener = np.linalg.inv(root)

    def residuals(angle: FloatArray, load: FloatArray) -> FloatArray:
        row = (whitener @ (predict(radius, angle, load) - data)[..., None])[..., 0]
        if measured is None:
            return np.asarray(row)
        return np.concatenate([row, ((load - measured) / load_sd)[:, None]], axis=1)

    here = residuals(angle, load)
    cost = 0.5 * (here**2).sum(axis=1)
    damping = np.full(len(data), 1e-3)
    for _ in range(ITERATIONS):
        push = STEP_LOAD * load
        by_angle = (residuals(angle + STEP_ANGLE, load) - residuals(angle - STEP_ANGLE, load)) / (2 * STEP_ANGLE)
        by_load = (residuals(angle, load + push) - residuals(angle, load - push)) / (2 * push)[:, None]
        jacobian = np.stack([by_angle, by_load], axis=-1)
        information = jacobian.swapaxes(1, 2) @ jacobian
        gradient = (jacobian.swapaxes(1, 2) @ here[..., None])[..., 0]
        step = damped_newton_steps(-gradient, information, damping)
        tried = angle + np.clip(step[:, 0], -0.1, 0.1), np.maximum(load + step[:, 1], 0.1 * load)
        there = residuals(*tried)
        lower = 0.5 * (there**2).sum(axis=1)
        better = lower < cost
        angle, load = (np.where(better, new, old) for new, old in zip(tried, (angle, load), strict=True))
        here = np.where(better[:, None], there, here)
        gained = np.where(better, cost - lower, 0.0)
        cost = np.where(better, lower, cost)
        damping = np.where(better, 0.1 * damping, 10 * damping)
        if gained.max() < 1e-5:
            break
    # Add the second derivative of the residuals with respect to the location. That with respect to the load is
    # negligible (readings are nearly linear in it), and so is the mixed one (the gradient is zero at the fit).
    second_difference = residuals(angle + BEND_STEP, load) + residuals(angle - BEND_STEP, load) - 2 * here
    bend = (here * second_difference).sum(axis=1) / BEND_STEP**2
    # About the location alone: what is left after the load is fitted.
    own = information[:, 0, 0] - information[:, 0, 1] ** 2 / information[:, 1, 1]
    angle_sd = np.maximum(own + bend, np.maximum(0.2 * own, MARGIN**-2)) ** -0.5
    return _Fit(TouchPlaces(radius, angle, load), cost, angle_sd)


def _log_integral(
    known: KnownFinger,
    data: FloatArray,
    fits: tuple[_Fit, _Fit],
    root: FloatArray,
    measured: FloatArray | None,
    load_sd: float,
) -> FloatArray:
    """Log of the integral of the likelihood over location and load, (t,); two fits, which may be the same."""
    first, second = fits
    # A second fit that is this much worse has no part in the integral, and its nodes help about the first.
    worse = second.cost > first.cost + NEGLIGIBLE
    angle, load, sd = (
        np.stack([one, np.where(worse, one, two)])
        for one, two in (
            (first.touches.angle, second.touches.angle),
            (first.touches.load, second.touches.load),
            (first.angle_sd, second.angle_sd),
        )
    )
    by_angle = np.argsort(angle, axis=0)
    angle, load, sd = (np.take_along_axis(each, by_angle, axis=0) for each in (angle, load, sd))
    middle = angle.mean(axis=0)
    low = angle[0] - REACH * sd[0], np.maximum(angle[1] - REACH * sd[1], middle)
    high = np.minimum(angle[0] + REACH * sd[0], middle), angle[1] + REACH * sd[1]
    node, weight = np.polynomial.legendre.leggauss(NODES)
    half = 0.5 * (np.stack(high) - np.stack(low))[..., None]
    at = np.concatenate(list(np.stack(low)[..., None] + half * (1 + node)), axis=1)  # (t, 2 NODES)
    log_weight = np.log(np.maximum(np.concatenate(list(half * weight), axis=1), 1e-300))
    whitener = np.linalg.inv(root)
    radius = np.repeat(first.touches.radius_mm, at.shape[1])

    def white(push: FloatArray) -> FloatArray:
        readings = known.chain.predict(radius, at.ravel(), push.ravel()).reshape(*at.shape, -1)
        row = (readings - data[:, None]) @ whitener.swapaxes(1, 2)
        if measured is None:
            return np.asarray(row)
        return np.concatenate([row, ((push - measured[:, None]) / load_sd)[..., None]], axis=-1)

    push = np.repeat(load.T, NODES, axis=1)
    row = white(push)
    slope = (white(push * (1 + STEP_LOAD)) - row) / (STEP_LOAD * push)[..., None]
    information = (slope**2).sum(axis=-1)
    for _ in range(LOAD_STEPS):
        push = np.clip(push - (slope * row).sum(axis=-1) / information, 0.1 * push, known.largest_load)
        row = white(push)
    log = log_weight - 0.5 * (row**2).sum(axis=-1) - 0.5 * np.log(information)
    top = log.max(axis=1)
    return np.asarray(top + np.log(np.exp(log - top[:, None]).sum(axis=1)))
