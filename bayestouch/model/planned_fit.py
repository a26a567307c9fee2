"""Planned touches as a fit predicts them, with its drifts and with functions of place if it has any."""

from __future__ import annotations

from functools import partial

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.smooth import PlaceBasis, SmoothBasis
from bayestouch.data.arrays import read_once
from bayestouch.data.averages import TouchMeans
from bayestouch.effects.effect import Values
from bayestouch.effects.random import RandomEffect
from bayestouch.model.correction import Correction
from bayestouch.model.fitting import Fitted, drift_columns
from bayestouch.model.left_over import force_noise
from bayestouch.model.linear import covariance_of
from bayestouch.model.observations import Observations
from bayestouch.model.planned import PlannedReadings, covariance_of_shared, with_load_error
from bayestouch.model.planned_table import one_row_each

# Largest number of distinct times of planned touches at which a drift is exact; smallest distance from the end of the
# fit, in correlation lengths, at which a time counts as another one.
MOST_TIMES, NEAR = 20, 1e-3


def planned_readings(fitted: Fitted, touches: TouchMeans, correction: Correction | None = None) -> PlannedReadings:
    """Readings of planned touches by a fit.

    The touches follow those of the fit: `TouchMeans.time_s` is the time after the end of the data set, in its unit, and
    counts as 0 where it is not stated. Drifts go on from what they were at the end.

    Parameters
    ----------
    fitted : Fitted
        The fit.
    touches : TouchMeans
        The touches, from `bayestouch.model.planned_table.planned_table`.
    correction : Correction, optional
        Functions of place that are added to the fit.
    """
    known = fitted.model.known
    time = known.span[1] + np.maximum(np.nan_to_num(touches.time_s), 0.0)
    here = fitted.model
    there = here.observing(_observed(touches, time, known))
    vector, linear = fitted.vector, fitted.linear
    basis_of = partial(_going_on, sessions=known.sessions or (known.span,), later=time)
    functions = [drift_columns(each, vector, fitted.drifts, basis_of) for each in (here, there)]
    if correction is not None:
        more = [correction.columns(*each.correction_inputs(vector)) for each in (here, there)]
        functions = [np.concatenate(pair) for pair in zip(functions, more, strict=True)]
    # Parameters of the model and weights of the functions together, given the touches of the fit.
    white = fitted.whitening.columns(functions[0]).dense()
    columns = np.concatenate([linear.jacobian, white], axis=1)
    d = linear.jacobian.shape[1]
    information, slope = columns.T @ columns, columns.T @ linear.residual.ravel()
    if linear.deviation_jacobian is not None:
        information[:d, :d] += linear.deviation_jacobian.T @ linear.deviation_jacobian
        slope[:d] += linear.deviation_jacobian.T @ linear.deviation.ravel()
    information[np.diag_indices_from(information)] += np.append(linear.precision, np.ones(len(slope) - d))
    slope[:d] += linear.precision * linear.pull
    covariance = covariance_of(information)
    jacobian = there.derivatives(vector)[0]
    if linear.held is not None:
        jacobian = np.where(linear.held[:, None, None], 0.0, jacobian)
    alive = np.isfinite(touches.readings)
    total = np.moveaxis(np.concatenate([jacobian, functions[1]]), 0, -1) * alive[:, :, None]
    mean = there.predict(vector).touches
    return PlannedReadings(
        np.where(alive, mean + total @ (covariance @ slope), 0.0),
        total,
        covariance,
        _noise(fitted, touches, mean, there.by_load(vector)),
    )


def _going_on(
    drift: RandomEffect,
    values: Values,
    observed: Observations,
    *,
    sessions: tuple[tuple[float, float], ...],
    later: FloatArray,
) -> FloatArray:
    """Basis (t, k) of a drift at the times of touches, which goes on after the last session.

    The process is defined by its values at the knots of the fit, and at the times `later` of planned touches.
    """
    time, out = observed.touch_time_s, []
    for low, high in sessions:
        inside = (time >= low) & (time <= high)
        fit = SmoothBasis.of(low, high, values[1], knots=drift.knots)
        knots = fit.knots
        if high == sessions[-1][1]:
            inside = time >= low
            times = np.unique(later[later > high + NEAR * fit.length])
            if len(times) > MOST_TIMES:
                times = np.quantile(times, np.linspace(0, 1, MOST_TIMES))
            knots = np.append(knots, times)
        process = PlaceBasis.at(knots[:, None], fit.length)
        out.append(np.where(inside[:, None], values[0] * process(time[:, None]), 0.0))
    return np.concatenate(out, axis=1)


def _observed(touches: TouchMeans, time: FloatArray, known: Observations) -> Observations:
    """The touches on the clock of the observations `known`, after their history."""
    table = one_row_each(touches, time_s=time)
    return Observations.of(table, time, np.zeros(len(time)), known.unit, known.history, known.span)


def _noise(fitted: Fitted, touches: TouchMeans, mean: FloatArray, by_load: FloatArray) -> FloatArray:
    """Covariance (t, m, m) of the readings of each touch for known parameters."""
    noise = fitted.noise
    variance = noise.mean_variance(mean, read_once(touches.counts))
    shared = noise.shared_errors(touches.counts)
    # An error of loads that were not measured is no noise of a force sensor: reading it more often changes nothing.
    measured = np.isfinite(fitted.model.known.load).any()
    one_load = force_noise(fitted) if measured else float(np.median(noise.load_sd))
    load_sd = one_load / np.sqrt(touches.reads_of_load if measured else np.ones(touches.n_touches))
    alive = np.isfinite(touches.readings)
    by_load, shared = np.where(alive, by_load, 0.0), np.where(alive, shared, 0.0)
    return np.asarray(with_load_error(variance, by_load, load_sd) + covariance_of_shared(shared))
