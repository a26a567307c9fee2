"""Evidence of one touch for each of several indenters, with location, load and calibration unknown."""

from __future__ import annotations

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


def log_evidence(
    known: KnownFinger,
    readings: ArrayLike,
    radius_mm: ArrayLike,
    *,
    load: ArrayLike | None = None,
    samples: int = 1,
) -> FloatArray:
    """Log marginal likelihood of touches for each of several radii.

    For a given radius, location and load are approximately normal, so both are integrated by Laplace's method. Errors
    of the calibration are included in the covariance of the readings. Priors of location and load are flat and equal
    for all radii.

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
        angle, force = _start(known, data, float(radius), measured)
        touches = TouchPlaces(np.full(len(data), radius), angle, force)
        noise = np.broadcast_to(np.sqrt(known.noise_variance(samples)), data.shape)
        root = noise[:, :, None] * np.eye(known.n_elements)
        touches, _, _ = _fitted(known, data, touches, root, measured, load_sd)
        # The covariance of the calibration's errors changes slowly with the touch, so its value at this fit is used.
        root = np.asarray(np.linalg.cholesky(known.covariance(touches, samples)), dtype=np.float64)
        touches, cost, information = _fitted(known, data, touches, root, measured, load_sd)
        log_volume = 0.5 * np.linalg.slogdet(information)[1]
        log_root = np.log(np.einsum("tii->ti", root)).sum(axis=1)
        columns.append(-cost - log_root - log_volume)
    return np.stack(columns, axis=1)


def _start(
    known: KnownFinger, data: FloatArray, radius: float, measured: FloatArray | None
) -> tuple[FloatArray, FloatArray]:
    """Location (rad) and load of the best fit on a grid of locations."""
    place = known.chain.angle
    angles = np.arange(place.min() - MARGIN, place.max() + MARGIN, START_STEP)
    typical = known.typical_load
    template = known.chain.predict(np.full(len(angles), radius), angles, np.full(len(angles), typical)) / typical
    weights = 1 / known.noise_variance(1)
    cross, power = (weights * data) @ template.T, weights @ (template**2).T
    best = np.clip(cross / power, 0.02 * typical, 3 * typical) if measured is None else measured[:, None]
    k = (power * best**2 - 2 * cross * best).argmin(axis=1)
    return angles[k], np.broadcast_to(best, cross.shape)[np.arange(len(data)), k].copy()


def _fitted(
    known: KnownFinger,
    data: FloatArray,
    touches: TouchPlaces,
    root: FloatArray,
    measured: FloatArray | None,
    load_sd: float,
) -> tuple[TouchPlaces, FloatArray, FloatArray]:
    """Gauss-Newton fit of location and load: fitted touches, half the squared residuals, their Hessian (t, 2, 2)."""
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
    own = information[:, 0, 0]
    information[:, 0, 0] = np.maximum(own + (here * second_difference).sum(axis=1) / BEND_STEP**2, 0.2 * own)
    return TouchPlaces(radius, angle, load), cost, information
