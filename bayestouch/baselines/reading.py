"""Touches read by a regression: its inversion on a grid of locations and loads."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray
from bayestouch.baselines.regression import Regression, RegressionTouches
from bayestouch.errors import InputError
from bayestouch.model.touch_errors import COVERAGE
from bayestouch.pad.problem import UNSTATED_FORCE_NOISE

#: Nodes of the grid, by dimensions of the pad: locations along each axis without and with loads, and loads. In a plane
#: with loads they are fewer: a Gaussian process of thousands of touches takes minutes for the 200,000 of them.
LOCATIONS, LOCATIONS_WITH_LOADS, LOADS = {1: 601, 2: 121}, {1: 601, 2: 61}, {1: 161, 2: 61}
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
    dimensions = known.location.shape[1]
    nodes = (LOCATIONS if known.load is None else LOCATIONS_WITH_LOADS)[dimensions]
    axes = [_axis(column, nodes) for column in known.location.T]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))
    residual = held.readings - regression(held.inputs)[0]
    if known.load is None or held.load is None:
        weight = _weights(_log_likelihood(held.readings, *regression(places)))
        none = np.full(len(held.readings), np.nan)
        of_location = _of_location(weight, places, axes, held.location)
        return RegressionPosteriors(residual, *of_location, none, none, np.stack([none] * 2, 1))
    if np.ptp(known.load) == 0:
        raise InputError("all known touches have the same load: a regression on the load cannot be inverted")
    loads = _axis(known.load, LOADS[dimensions])
    count = len(loads)
    grid = np.column_stack([np.repeat(places, count, axis=0), np.tile(loads, len(places))])
    mean, sd = (each.reshape(len(places), count, -1) for each in regression(grid))
    force_sd = UNSTATED_FORCE_NOISE * float(known.load.mean()) if force_sd is None else force_sd
    reads = np.ones(len(held.load)) if held.reads_of_load is None else held.reads_of_load
    by_element = [np.ascontiguousarray(np.moveaxis(each, -1, 0)) for each in (mean, sd, np.log(sd))]
    of_places, of_loads = [], []
    for reading, load, error in zip(held.readings, held.load, force_sd / np.sqrt(reads), strict=True):
        # Far below the step of the grid: the load as it was read, its noise as that of readings.
        at = np.clip(np.interp(load, loads, np.arange(count)), 0, count - 1.001)
        low, share = int(at), at - int(at)
        here, spread = ((1 - share) * each[:, low] + share * each[:, low + 1] for each in (mean, sd))
        slope = (mean[:, low + 1] - mean[:, low]) / (loads[1] - loads[0])
        # The scatter about the regression has an error of the load, too. It is the same in all elements, and the
        # likelihood takes them as independent: without this term, measured touches are covered too seldom.
        of_places.append(_log_likelihood(reading[None], here, np.hypot(spread, slope * error))[0])
        of_loads.append(_at_any_place(reading, *by_element))
    weight, weight_of_load = _weights(np.array(of_places)), _weights(np.array(of_loads))
    load_mean = weight_of_load @ loads
    load_sd = np.sqrt(np.maximum(weight_of_load @ loads**2 - load_mean**2, 0.0))
    below = np.cumsum(weight_of_load, axis=1) - 0.5 * weight_of_load
    tail = (1 - COVERAGE) / 2
    interval = np.array([np.interp([tail, 1 - tail], each, loads) for each in below])
    of_location = _of_location(weight, places, axes, held.location)
    return RegressionPosteriors(residual, *of_location, load_mean, load_sd, interval)


def _axis(values: FloatArray, count: int) -> FloatArray:
    """Nodes of the grid; a single one where all values are the same."""
    margin = BEYOND * np.ptp(values)
    return np.linspace(values.min() - margin, values.max() + margin, count if margin > 0 else 1)


def _log_likelihood(readings: FloatArray, mean: FloatArray, sd: FloatArray) -> FloatArray:
    """Log density of readings (t, m) at grid points (k, m), shape (t, k).

    Readings that are missing say nothing, and neither do those of an element without a regression.
    """
    out = np.zeros((len(readings), len(mean)))
    for column, centre, spread in zip(readings.T, mean.T, sd.T, strict=True):
        seen = np.isfinite(column) & np.isfinite(spread[0])
        out[seen] -= 0.5 * ((column[seen, None] - centre) / spread) ** 2 + np.log(spread)
    return out


def _at_any_place(reading: FloatArray, mean: FloatArray, sd: FloatArray, log_sd: FloatArray) -> FloatArray:
    """Log density (l,) of a reading (m,) at each load, summed over the places; mean, sd and its logarithm (m, p, l)."""
    out = np.zeros(mean.shape[1:])
    for e in np.flatnonzero(np.isfinite(reading) & np.isfinite(sd[:, 0, 0])):
        out -= 0.5 * ((reading[e] - mean[e]) / sd[e]) ** 2 + log_sd[e]
    highest = out.max(axis=0)
    return np.asarray(highest + np.log(np.exp(out - highest).sum(axis=0)))


def _weights(log_density: FloatArray) -> FloatArray:
    weight = np.exp(log_density - log_density.max(axis=1, keepdims=True))
    return np.asarray(weight / weight.sum(axis=1, keepdims=True))


def _of_location(
    weight: FloatArray, places: FloatArray, axes: list[FloatArray], reference: FloatArray
) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Mean, standard deviation, and whether the reference is in the smallest region with 90 % of the posterior."""
    mean = weight @ places
    sd = np.sqrt(np.maximum(weight @ places**2 - mean**2, 0.0))
    steps = [
        np.clip(np.rint((x - axis[0]) / (axis[1] - axis[0] if len(axis) > 1 else 1.0)), 0, len(axis) - 1)
        for x, axis in zip(reference.T, axes, strict=True)
    ]
    node = np.ravel_multi_index(tuple(step.astype(int) for step in steps), tuple(len(axis) for axis in axes))
    own = weight[np.arange(len(weight)), node]
    above = np.where(weight > own[:, None], weight, 0.0).sum(axis=1)
    # A reference beyond the places of the prior is in no region.
    there = np.all([(x >= axis[0]) & (x <= axis[-1]) for x, axis in zip(reference.T, axes, strict=True)], axis=0)
    return mean, sd, there & (above + 0.5 * own <= COVERAGE)
