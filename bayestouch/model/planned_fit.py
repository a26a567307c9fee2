"""Planned touches as a fit predicts them, with its drifts and with functions of place if it has any."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.data.averages import TouchMeans
from bayestouch.data.touches import touches_from
from bayestouch.model.correction import Correction
from bayestouch.model.fitting import Fitted, drift_columns
from bayestouch.model.linear import conditioned
from bayestouch.model.observations import Observations
from bayestouch.model.planned import PlannedReadings, with_load_error


def planned_readings(fitted: Fitted, touches: TouchMeans, correction: Correction | None = None) -> PlannedReadings:
    """Readings of planned touches by a fit.

    The touches follow those of the fit: `TouchMeans.time_s` is the time after the end of the data set, in its unit, and
    counts as 0 where it is not stated. Drifts go on from what they were at the end.

    Parameters
    ----------
    fitted : Fitted
        The fit.
    touches : TouchMeans
        The touches, from `bayestouch.model.planned.planned_table`.
    correction : Correction, optional
        Functions of place that are added to the fit.
    """
    known = fitted.model.known
    time = known.span[1] + np.maximum(np.nan_to_num(touches.time_s), 0.0)
    sessions = known.sessions or (known.span,)
    sessions = (*sessions[:-1], (sessions[-1][0], float(time.max())))
    observed = _observed(touches, time, known, sessions)
    there, here = (fitted.model.observing(each) for each in (observed, replace(known, sessions=sessions)))
    vector, linear = fitted.vector, fitted.linear
    functions = [drift_columns(each, vector, fitted.drifts) for each in (here, there)]
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
    scale = np.sqrt(np.diag(information))
    covariance = np.linalg.inv(conditioned(information / np.outer(scale, scale))) / np.outer(scale, scale)
    jacobian = there.derivatives(vector)[0]
    if linear.held is not None:
        jacobian = np.where(linear.held[:, None, None], 0.0, jacobian)
    alive = np.isfinite(touches.readings)
    total = np.moveaxis(np.concatenate([jacobian, functions[1]]), 0, -1) * alive[:, :, None]
    mean = there.predict(vector).touches
    return PlannedReadings(
        np.where(alive, mean + total @ (covariance @ slope), 0.0),
        total,
        np.asarray(covariance),
        _noise(fitted, touches, mean, there.by_load(vector)),
    )


def _observed(
    touches: TouchMeans, time: FloatArray, known: Observations, sessions: tuple[tuple[float, float], ...]
) -> Observations:
    """The touches on the clock of the observations `known`, after their history."""
    places = {name: getattr(touches, name) for name in ("angle_deg", "x_mm", "y_mm")}
    table = touches_from(
        touches.touch,
        touches.readings,
        time_s=time,
        indenter_radius_mm=touches.indenter_radius_mm,
        load=touches.load,
        contact=1.0,
        reads=touches.counts.max(axis=1),
        **places,
    )
    return Observations.of(table, time, np.zeros(len(time)), known.unit, known.history, known.span, sessions)


def _noise(fitted: Fitted, touches: TouchMeans, mean: FloatArray, by_load: FloatArray) -> FloatArray:
    """Covariance (t, m, m) of the readings of each touch for known parameters."""
    noise = fitted.noise
    reads = np.maximum(touches.counts.max(axis=1), 1).astype(float)
    variance = noise.mean_variance(mean, np.maximum(touches.counts, 1))
    shared = noise.shared_sd(reads)
    load_sd = np.full(len(reads), float(np.median(noise.load_sd)))
    alive = np.isfinite(touches.readings)
    by_load, shared = np.where(alive, by_load, 0.0), np.where(alive, shared, 0.0)
    return with_load_error(variance, by_load, load_sd) + shared[:, :, None] * shared[:, None]
