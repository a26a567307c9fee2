"""Touches read by a regression: its inversion on a grid of locations and loads."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from bayestouch.array_types import BoolArray, FloatArray
from bayestouch.baselines.regression import Regression, RegressionTouches
from bayestouch.errors import InputError
from bayestouch.model.touch_errors import COVERAGE
from bayestouch.pad.problem import UNSTATED_FORCE_NOISE

#: Nodes at which the regression is asked, by dimensions of the pad: locations along each axis, and loads. More take
#: minutes: a Gaussian process of thousands of touches is slow, and readings change smoothly from node to node.
LOCATIONS, LOADS_ASKED = {1: 601, 2: 121}, {1: 41, 2: 13}
#: Posteriors are narrower than those steps. They are taken at so many times more locations along each axis, and at so
#: many loads; between nodes the regression is a cubic spline.
FINER, LOADS = 2, {1: 161, 2: 61}
#: Touches whose posteriors are in memory at once: about 20 MB in a plane.
CHUNK = 40
#: Smallest standard deviation of a reading over the peak; squares over a smaller one are lost in rounding.
LEAST_SD = 1e-6
#: How far the grid goes beyond the known touches at each end, over their range.
BEYOND = 0.05


@dataclass(frozen=True, eq=False)
class RegressionPosteriors:
    """Posteriors of touches that a regression reads; t touches, m elements, D dimensions.

    Attributes
    ----------
    residual : (t, m) array
        Reading minus prediction at the reference, over the peak; NaN missing.
    location, location_sd : (t, D) arrays
        Posterior mean and standard deviation, mm, with the load given where it was measured.
    location_inside : (t,) bool array
        Whether the smallest region with 90 % of the posterior has the reference.
    load, load_sd : (t,) arrays
        The same of the load inferred from readings alone, N; NaN if loads were not measured.
    load_interval : (t, 2) array
        Central 90 % interval of the load, N.
    """

    residual: FloatArray
    location: FloatArray
    location_sd: FloatArray
    location_inside: BoolArray
    load: FloatArray
    load_sd: FloatArray
    load_interval: FloatArray


def read_by_regression(
    regression: Regression, known: RegressionTouches, held: RegressionTouches, force_sd: float | None = None
) -> RegressionPosteriors:
    """Read touches by a regression of known touches; prior uniform over the region and the loads of these.

    The regression is asked at `LOCATIONS` along each axis and at `LOADS_ASKED`. Between these its means and the
    logarithms of its standard deviations are cubic splines. Posteriors are taken on a grid `FINER` times finer along
    each axis, that of the location at the measured load itself, that of the load at `LOADS`.

    Parameters
    ----------
    regression : Regression
        The regression.
    known, held : RegressionTouches
        Touches that it was fitted to, and the touches to be read. Both have loads, or neither.
    force_sd : float, optional
        Noise of one reading of the force sensor, N; by default a share of the mean load.

    Raises
    ------
    InputError
        The loads of all known touches are the same: a regression on the load cannot be inverted.
    """
    if known.load is not None and np.ptp(known.load) == 0:
        raise InputError("all known touches have the same load: a regression on the load cannot be inverted")
    dimensions = known.location.shape[1]
    asked = [_axis(column, LOCATIONS[dimensions]) for column in known.location.T]
    axes = [_finer(axis) for axis in asked]
    predicted, spread = regression(held.inputs)
    residual = held.readings - predicted
    if known.load is None or held.load is None:
        mean, log_sd = (_at_finer(each, asked, axes) for each in _asked(regression, asked))
        own = _own_log_likelihood(residual, spread)
        found = _locations(held, own, mean[0], np.exp(log_sd[0]), axes)
        none = np.full(len(own), np.nan)
        return RegressionPosteriors(residual, *found, none, none, np.stack([none] * 2, 1))
    at = _axis(known.load, LOADS_ASKED[dimensions])
    mean, log_sd = (_at_finer(each, asked, axes) for each in _asked(regression, asked, at))
    force_sd = UNSTATED_FORCE_NOISE * float(known.load.mean()) if force_sd is None else force_sd
    reads = np.ones(len(held.load)) if held.reads_of_load is None else held.reads_of_load
    errors = force_sd / np.sqrt(reads)
    step = at[1] - at[0]
    more = np.column_stack([held.location, held.load + 0.5 * step])
    less = np.column_stack([held.location, held.load - 0.5 * step])
    slope = (regression(more)[0] - regression(less)[0]) / step
    own = _own_log_likelihood(residual, np.hypot(spread, slope * errors[:, None]))
    found = _locations_at_loads(held, own, held.load, errors, at, mean, log_sd, axes)
    return RegressionPosteriors(
        residual, *found, *_loads(held.readings, at, mean, log_sd, _axis(known.load, LOADS[dimensions]))
    )


def _locations(
    held: RegressionTouches, own: FloatArray, mean: FloatArray, sd: FloatArray, axes: list[FloatArray]
) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Posteriors of locations as `_of_location`, from means and standard deviations (k, m) without a load."""
    places, parts = _points(axes), []
    for i in range(0, len(own), CHUNK):
        some = slice(i, i + CHUNK)
        density = _log_likelihood(held.readings[some], mean, sd)
        parts.append(_of_location(density, own[some], places, axes, held.location[some]))
    return _joined(parts)


def _locations_at_loads(
    held: RegressionTouches,
    own: FloatArray,
    measured: FloatArray,
    errors: FloatArray,
    at: FloatArray,
    mean: FloatArray,
    log_sd: FloatArray,
    axes: list[FloatArray],
) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Posteriors of locations as `_of_location`, each touch with its `measured` load, whose standard error is given.

    Means and logarithms of standard deviations are those at loads `at` (l,), (l, k, m).
    """
    places, between, parts = _points(axes), CubicSpline(at, np.eye(len(at))), []
    for i, error in enumerate(errors):
        # Far below the step of the grid: the load as it was read, its noise as that of readings.
        load = np.clip(measured[i], at[0], at[-1])
        # The scatter about the regression has an error of the load, too. It is the same in all elements, and the
        # likelihood takes them as independent: without this term, measured touches are covered too seldom.
        from_load = error * np.tensordot(between(load, 1), mean, 1)
        sd = np.hypot(np.exp(np.tensordot(between(load), log_sd, 1)), from_load)
        density = _log_likelihood(held.readings[i : i + 1], np.tensordot(between(load), mean, 1), sd)
        parts.append(_of_location(density, own[i : i + 1], places, axes, held.location[i : i + 1]))
    return _joined(parts)


def _loads(
    readings: FloatArray, at: FloatArray, mean: FloatArray, log_sd: FloatArray, loads: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Mean and standard deviation (t,) and central interval (t, 2) of the load, from readings (t, m) alone.

    The posterior is taken at `loads`; means and logarithms of standard deviations as in `_locations_at_loads`.
    """
    between, of_loads = CubicSpline(at, np.eye(len(at))), np.empty((len(readings), len(loads)))
    for column, share in enumerate(between(loads)):
        here, sd = np.tensordot(share, mean, 1), np.exp(np.tensordot(share, log_sd, 1))
        for i in range(0, len(of_loads), CHUNK):
            of_loads[i : i + CHUNK, column] = _log_sum(_log_likelihood(readings[i : i + CHUNK], here, sd))
    weight = _weights(of_loads)
    load_mean = weight @ loads
    load_sd = np.sqrt(np.maximum(weight @ loads**2 - load_mean**2, 0.0))
    below = np.cumsum(weight, axis=1) - 0.5 * weight
    tail = (1 - COVERAGE) / 2
    interval = np.array([np.interp([tail, 1 - tail], each, loads) for each in below])
    return load_mean, load_sd, interval


def _axis(values: FloatArray, count: int) -> FloatArray:
    """Nodes of the grid; a single one where all values are the same."""
    margin = BEYOND * np.ptp(values)
    return np.linspace(values.min() - margin, values.max() + margin, count if margin > 0 else 1)


def _finer(axis: FloatArray) -> FloatArray:
    return np.linspace(axis[0], axis[-1], FINER * (len(axis) - 1) + 1)


def _points(axes: list[FloatArray]) -> FloatArray:
    """All points (k, D) of a grid, the last axis fastest."""
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))


def _asked(
    regression: Regression, axes: list[FloatArray], loads: FloatArray | None = None
) -> tuple[FloatArray, FloatArray]:
    """Means and logarithms of standard deviations at the nodes, (loads, each axis, m)."""
    given = [] if loads is None else [loads]
    points = np.roll(_points([*given, *axes]), -len(given), axis=1)
    shape = (1 if loads is None else len(loads), *(len(axis) for axis in axes), -1)
    mean, sd = regression(points)
    return mean.reshape(shape), np.log(np.maximum(sd, LEAST_SD)).reshape(shape)


def _at_finer(values: FloatArray, asked: list[FloatArray], axes: list[FloatArray]) -> FloatArray:
    """Values (loads, each axis, m) at the places of a finer grid, (loads, k, m), by cubic splines along each axis."""
    for number, (coarse, fine) in enumerate(zip(asked, axes, strict=True), start=1):
        if len(coarse) > 1:
            share = CubicSpline(coarse, np.eye(len(coarse)))(fine)
            values = np.moveaxis(np.tensordot(share, values, (1, number)), 0, number)
    return np.ascontiguousarray(values).reshape(len(values), -1, values.shape[-1])


def _log_likelihood(readings: FloatArray, mean: FloatArray, sd: FloatArray) -> FloatArray:
    """Log density of readings (t, m) at grid points (k, m), shape (t, k).

    Readings that are missing say nothing, and neither do those of an element without a regression.
    """
    known = np.isfinite(sd[0])
    readings, mean, sd = readings[:, known], mean[:, known], sd[:, known]
    seen = np.isfinite(readings)
    read, precision = np.where(seen, readings, 0.0), 1 / sd**2
    of_touches = np.concatenate([read, -0.5 * read**2, -1.0 * seen], axis=1)
    of_places = np.concatenate([precision * mean, precision, 0.5 * precision * mean**2 + np.log(sd)], axis=1)
    return np.asarray(of_touches @ of_places.T)


def _own_log_likelihood(residual: FloatArray, sd: FloatArray) -> FloatArray:
    """Log density (t,) of readings at the references, from residuals and standard deviations (t, m) there."""
    sd = np.maximum(sd, LEAST_SD)
    return np.asarray(-np.nansum(0.5 * (residual / sd) ** 2 + np.where(np.isfinite(residual), np.log(sd), 0.0), axis=1))


def _log_sum(log_density: FloatArray) -> FloatArray:
    """Logarithm of the sum over the columns of a density, (t,)."""
    highest = log_density.max(axis=1)
    density = log_density - highest[:, None]
    return np.asarray(highest + np.log(np.exp(density, out=density).sum(axis=1)))


def _weights(log_density: FloatArray) -> FloatArray:
    weight = np.exp(log_density - log_density.max(axis=1, keepdims=True))
    return np.asarray(weight / weight.sum(axis=1, keepdims=True))


def _of_location(
    log_density: FloatArray, own: FloatArray, places: FloatArray, axes: list[FloatArray], reference: FloatArray
) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Mean, standard deviation, and whether the reference is in the smallest region with 90 % of the posterior.

    Log densities are those of places (t, k) and of the references (t,): the node next to a reference may be far less
    probable than the reference itself.
    """
    weight = _weights(log_density)
    mean = weight @ places
    sd = np.sqrt(np.maximum(weight @ places**2 - mean**2, 0.0))
    above = np.where(log_density > own[:, None], weight, 0.0).sum(axis=1)
    # A reference beyond the places of the prior is in no region.
    there = np.all([(x >= axis[0]) & (x <= axis[-1]) for x, axis in zip(reference.T, axes, strict=True)], axis=0)
    return mean, sd, there & (above <= COVERAGE)


def _joined(parts: list[tuple[FloatArray, FloatArray, BoolArray]]) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Posteriors of locations of all touches, from those of some at a time."""
    mean, sd, inside = (np.concatenate(each) for each in zip(*parts, strict=True))
    return mean, sd, inside
