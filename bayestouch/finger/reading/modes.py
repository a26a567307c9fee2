"""Modes of the posteriors of touches and the Hessians at the modes, for all touches at once."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray, IndexArray, IntArray
from bayestouch.data.arrays import nearest_turn
from bayestouch.finger.reading.reader import TURN, FingerPosterior
from bayestouch.sampling.laplace import damped_newton_steps

#: One of the `matches`: w, locations (a,), rad, best load (t, a), misfit (t, a), squares of the strongest touch (t,).
Match = tuple[float, FloatArray, FloatArray, FloatArray, FloatArray]

# Radii at which the location is searched, relative to the range from the sharpest indenter (an edge) to the bluntest.
START_SHARES = np.array([0.05, 0.35, 0.65, 0.93])
GRID_STEP = np.radians(1.0)
# Steps of central differences in w, rad and share of the load: large enough for a reading table that is linear between
# knots, small enough for a relative error of the derivative of 1e-3.
DIFFERENCES = np.array([3e-2, 3e-3, 3e-3])
# Number of starts that are optimised: the best of those at the start shares.
KEPT = 2
# Sum of squared residuals of a mode, over the number of elements, from which other locations are tried. It is about 1
# where the place is right, and a few where the calibration errs.
POOR = 4.0
MAX_ITERATIONS = 40
# Another place may be the right one if it leaves less than this share unexplained: of the squares of the readings, or
# of those of the strongest touch, since a touch beside the elements has hardly any readings. With three elements the
# other side of one leaves 2 % or less; with seven or more, 9° apart, at most one touch in 200 has such a place.
UNEXPLAINED = 0.05
# Number of other places that are looked at, and distance (rad) at which a place belongs to the one before: for another
# radius the same place is up to so far away. A minimum nearest to the mode and within `OWN` is that of the mode.
OTHERS, BESIDE, OWN = 3, np.radians(3.0), np.radians(6.0)
# Gain of log density that shows another mode: the search ends within less of the same one.
GAIN = 0.1


def find_modes(posterior: FingerPosterior, start: FloatArray | None = None) -> FloatArray:
    """Mode of the posterior of every touch in the coordinates ``(w, θ_c, P)``, (t, 3).

    A template search over location at a few radii gives starts. A damped Gauss-Newton method optimises them, all
    touches and starts together; the best result is returned.

    Parameters
    ----------
    posterior : FingerPosterior
        Posterior of the touches.
    start : (t, 3) array, optional
        Starting values instead of a search, e.g. modes for another covariance of the readings.
    """
    if start is not None:
        return _climb(posterior, start, np.arange(len(start)))[0]
    matched = list(matches(posterior))
    starts = _starts(posterior, matched)
    t = len(starts)
    s = KEPT
    order = posterior.log_density(starts, np.arange(t)).argsort(axis=1)[:, ::-1][:, :s]
    starts = np.take_along_axis(starts, order[..., None], axis=1)
    blocks = np.repeat(np.arange(t), s)
    x, value = _climb(posterior, starts.reshape(t * s, 3), blocks)
    best = np.arange(t) * s + value.reshape(t, s).argmax(axis=1)
    found = _at_other_places(posterior, x[best], value[best], other_places(posterior, x[best], matched))
    return _searched_again(posterior, *found)


def _at_other_places(
    posterior: FingerPosterior, mode: FloatArray, value: FloatArray, places: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Modes (t, 3) and log densities (t,), or better ones near other places (t, k, 3), NaN where there are none."""
    touch, which = np.nonzero(np.isfinite(places[..., 0]))
    mode, value = mode.copy(), value.copy()
    for k in range(places.shape[1]):
        rows = touch[which == k]
        if len(rows):
            x, found = _climb(posterior, places[rows, k], rows)
            better = found > value[rows] + GAIN
            mode[rows[better]], value[rows[better]] = x[better], found[better]
    return mode, value


def _searched_again(posterior: FingerPosterior, mode: FloatArray, value: FloatArray) -> FloatArray:
    """Modes (t, 3) with log densities (t,), or better ones where the readings fit badly and there are effects.

    The templates of `_starts` have no effects: a hard touch with readings that saturate looks like one far away.
    """
    if posterior.touches.context is None:
        return mode
    rest = posterior.residual(mode[:, None], np.arange(len(mode)))[:, 0]
    poor = np.flatnonzero((rest.astype(np.float64) ** 2).sum(axis=1) > POOR * np.maximum((rest != 0).sum(axis=1), 1))
    if not len(poor):
        return mode
    low, high = posterior.priors.location.support
    angles = np.clip(np.arange(low, high + GRID_STEP, GRID_STEP), low + 1e-6, high - 1e-6)
    shares, p = np.array(START_SHARES), len(poor)
    load = np.where(np.isfinite(posterior.touches.load[poor]), posterior.touches.load[poor], mode[poor, 2])
    low_load, high_load = posterior.priors.load.support
    load = np.clip(load, low_load + 1e-6, high_load - 1e-6)
    places = np.empty((p, len(shares), len(angles), 3))
    places[..., 0] = np.log(shares / (1 - shares))[:, None]
    places[..., 1] = angles
    places[..., 2] = load[:, None, None]
    density = posterior.log_density(places.reshape(p, -1, 3), poor).reshape(places.shape[:-1])
    starts = np.take_along_axis(places, density.argmax(axis=2)[:, :, None, None], axis=2)[:, :, 0]
    s = len(shares)
    x, found = _climb(posterior, starts.reshape(p * s, 3), np.repeat(poor, s))
    best = np.arange(p) * s + found.reshape(p, s).argmax(axis=1)
    better = found[best] > value[poor]
    out = mode.copy()
    out[poor[better]] = x[best[better]]
    return out


def hessian_at(posterior: FingerPosterior, mode: FloatArray) -> FloatArray:
    """Gauss-Newton Hessian of minus the log density of every touch at its mode (t, 3), (t, 3, 3)."""
    return _expansion(posterior.without_ends, mode, np.arange(len(mode)))[1]


def _starts(posterior: FingerPosterior, matched: Sequence[Match]) -> FloatArray:
    """Best location for each start radius, (t, starts, 3)."""
    low, high = posterior.priors.location.support
    out = np.empty((posterior.touches.n_touches, len(START_SHARES), 3))
    for i, (w, angles, load, misfit, _) in enumerate(matched):
        k = misfit.argmin(axis=1)
        out[:, i, 0] = w
        out[:, i, 1] = np.clip(angles[k], low + 1e-6, high - 1e-6)
        out[:, i, 2] = np.take_along_axis(load, k[:, None], axis=1)[:, 0]
    ends, typical = posterior.priors.load.support, float(posterior.priors.load.quantile(0.5))
    out[:, :, 2] = np.clip(out[:, :, 2], ends[0] + 1e-6 * typical, ends[1] - 1e-6 * typical)
    # The last digits of a matrix product depend on the number of touches. They are rounded off, so that the draws do
    # not depend on this number.
    return out.astype(np.float32).astype(np.float64)


def other_places(posterior: FingerPosterior, mode: FloatArray, matched: Sequence[Match]) -> FloatArray:
    """Places (w, θ_c, P) beside the mode (t, 3) of each touch at which its readings may fit, (t, `OTHERS`, 3).

    They are minima of the misfit over the location, at one of the start radii, that explain nearly all of the readings:
    to be climbed from, since the right radius and location are between those of the templates. The best comes first,
    and NaN where there is none.

    Parameters
    ----------
    posterior : FingerPosterior
        Posterior of the touches.
    mode : (t, 3) array
        Mode of each touch, whose own place is left out.
    matched : sequence of Match
        The `matches` of the posterior.
    """
    readings, diagonal = _weighed(posterior)
    squares = ((diagonal * readings) ** 2).sum(axis=1)
    found = []
    for w, angles, load, misfit, strongest in matched:
        bound = UNEXPLAINED * np.maximum(squares, strongest) - squares
        row, k = other_minima(misfit, bound, angles, mode[:, 1])
        found.append((row, np.stack([np.full(len(row), w), angles[k], load[row, k]], axis=1), misfit[row, k]))
    out = np.full((len(mode), OTHERS, 3), np.nan)
    row, place, misfit = (np.concatenate(parts) for parts in zip(*found, strict=True))
    order = np.lexsort((misfit, row))
    row, place = row[order], moved_inside(posterior, place[order])
    for i in range(OTHERS):
        best, first = np.unique(row, return_index=True)
        out[best, i] = place[first]
        beside = np.abs(place[:, 1] - out[row, i, 1]) > BESIDE
        row, place = row[beside], place[beside]
    return out


def other_minima(
    misfit: FloatArray, bound: FloatArray, angles: FloatArray, mode: FloatArray
) -> tuple[IndexArray, IndexArray]:
    """Minima of misfits (n, a) over locations (a,), rad, below bounds (n,) and beside modes at (n,): rows, columns."""
    low = misfit < bound[:, None]
    falls = misfit[:, 1:] < misfit[:, :-1]
    low[:, 1:] &= falls
    low[:, :-1] &= ~falls
    row, k = np.nonzero(low)
    off = np.abs(nearest_turn(angles[k] - mode[row], 0.0, TURN))
    nearest = np.full(len(misfit), OWN)
    np.minimum.at(nearest, row, off)
    beside = off > nearest[row]
    return row[beside], k[beside]


def moved_inside(posterior: FingerPosterior, place: FloatArray) -> FloatArray:
    """Places (..., 3) moved inside the priors of location and load.

    The last digits of a matrix product depend on the number of touches. They are rounded off, so that the draws do not
    depend on this number.
    """
    out = place.copy()
    (low, high), (lightest, hardest) = posterior.priors.location.support, posterior.priors.load.support
    out[..., 1] = np.clip(out[..., 1], low + 1e-6, high - 1e-6)
    out[..., 2] = np.clip(out[..., 2], lightest + 1e-6, hardest - 1e-6)
    return out.astype(np.float32).astype(np.float64)


def matches(posterior: FingerPosterior) -> Iterator[Match]:
    """For each start radius: w, locations (a,), rad, best load (t, a) and misfit (t, a) of each touch there.

    The misfit is the sum of squares of the whitened residuals, less that of the readings. Last comes the sum of squares
    (t,) of a touch with the measured load where the elements feel most; 0 where no load was measured.
    """
    chain, touches = posterior.chain, posterior.touches
    low, high = posterior.priors.location.support
    angles = np.arange(low, high + GRID_STEP, GRID_STEP)
    measured = np.isfinite(touches.load)
    typical = float(posterior.priors.load.quantile(0.5))
    readings, diagonal = _weighed(posterior)
    weights = diagonal**2
    for share in START_SHARES:
        w = float(np.log(share / (1 - share)))
        template = chain.predict(float(posterior.radius(np.array(w))), angles, np.full(len(angles), typical)) / typical
        # For each location: weighted scalar products of readings and template, which give the best load.
        cross = (weights * readings) @ template.T
        power = weights @ (template**2).T
        load = np.where(measured[:, None], touches.load[:, None], cross / np.maximum(power, 1e-300))
        load = np.clip(load, 1e-3 * typical, None)
        strongest = np.where(measured, power.max(axis=1) * touches.load**2, 0.0)
        yield w, angles, load, power * load**2 - 2 * cross * load, strongest


def _weighed(posterior: FingerPosterior) -> tuple[FloatArray, FloatArray]:
    """Readings (t, m), 0 where missing, and the diagonal (t, m) of their whitener, for the coarse search."""
    diagonal = posterior.whitener if posterior.whitener.ndim == 2 else _row_norm(posterior.whitener)
    return np.where(diagonal > 0, posterior.touches.readings, 0.0), diagonal


def _row_norm(whitener: FloatArray) -> FloatArray:
    """Diagonal approximation of a full whitener for the coarse search, (t, m)."""
    return np.asarray(np.sqrt(np.einsum("tij,tij->tj", whitener, whitener)))


def _climb(posterior: FingerPosterior, start: FloatArray, blocks: IntArray) -> tuple[FloatArray, FloatArray]:
    """Damped Gauss-Newton from starts (n, 3) of the touches `blocks` (n,): mode and log density.

    On a full ring the search goes on beyond the ends of the prior, which are one location.
    """
    x, priors, posterior = start.copy(), posterior.priors, posterior.without_ends
    value = posterior.log_density(x[:, None], blocks)[:, 0]
    damping = np.full(len(x), 1e-2)
    active = np.arange(len(x))
    for _ in range(MAX_ITERATIONS):
        gradient, hess = _expansion(posterior, x[active], blocks[active])
        step = damped_newton_steps(gradient, hess, damping[active])
        step[:, 0] = np.clip(step[:, 0], -2.0, 2.0)
        tried = x[active] + step
        tried_value = posterior.log_density(tried[:, None], blocks[active])[:, 0]
        better: NDArray[np.bool_] = np.asarray(tried_value > value[active])
        # The density of a start may be zero, and that of a step from it too.
        gain = np.subtract(tried_value, value[active], out=np.full(len(active), np.inf), where=better)
        rows = active[better]
        x[rows], value[rows] = tried[better], tried_value[better]
        damping[active] = np.clip(damping[active] * np.where(better, 0.2, 8.0), 1e-9, 1e9)
        going = (gain > 1e-4) & np.asarray(damping[active] < 1e6)
        if not going.any():
            break
        active = active[going]
    x[:, 1] = priors.in_turn(x[:, 1])
    return x, value


def difference_steps(x: FloatArray) -> FloatArray:
    """Steps of central differences about points x (n, 3) of w, angle in rad and load, (n, 3)."""
    return np.asarray(DIFFERENCES * np.stack([np.ones(len(x)), np.ones(len(x)), np.maximum(x[:, 2], 1e-3)], axis=-1))


def _expansion(posterior: FingerPosterior, x: FloatArray, blocks: IntArray) -> tuple[FloatArray, FloatArray]:
    """Gradient of the log density and minus its (Gauss-Newton) Hessian, (n, 3) and (n, 3, 3)."""
    steps = difference_steps(x)
    # Centre, and both neighbours along each coordinate: 7 points in one call.
    moves = np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)])
    places = x[:, None] + moves * steps[:, None]
    z = posterior.residual(places, blocks)
    jacobian = (z[:, 1:4] - z[:, 4:7]) / (2 * steps[..., None])
    prior = posterior.log_factor(places, blocks)
    finite: NDArray[np.bool_] = np.all(np.isfinite(prior), axis=1, keepdims=True)
    prior = np.where(finite, prior, 0.0)
    slope = (prior[:, 1:4] - prior[:, 4:7]) / (2 * steps)
    gradient = slope - (jacobian @ z[:, 0, :, None])[..., 0]
    hessian = np.asarray(jacobian @ jacobian.swapaxes(1, 2), dtype=np.float64)
    # The prior is a product, so its curvature is diagonal. A negative curvature would make the step invalid and is set
    # to zero.
    curvature = -(prior[:, 1:4] - 2 * prior[:, :1] + prior[:, 4:7]) / steps**2
    share = 1 / (1 + np.exp(-x[:, 0]))
    curvature[:, 0] = np.maximum(curvature[:, 0], 0.2 * share * (1 - share) + 1e-3)
    curvature[:, 1:] = np.maximum(curvature[:, 1:], 0.0)
    index = np.arange(3)
    hessian[:, index, index] += curvature
    # A minimum of information avoids a singular matrix: an undetermined location or load has the width of its prior.
    low, high = posterior.priors.location.support
    hessian[:, 1, 1] += 1 / (high - low) ** 2
    hessian[:, 2, 2] += 1e-6 / np.maximum(x[:, 2], 1e-3) ** 2
    return gradient, hessian


def with_whitener(posterior: FingerPosterior, whitener: FloatArray) -> FingerPosterior:
    """The posterior of the same touches with another covariance of the readings."""
    return replace(posterior, whitener=whitener)
