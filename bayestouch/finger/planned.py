"""Planned touches on a calibrated finger: readings, and what the calibration does not know of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.linalg import block_diag

from bayestouch.array_types import FloatArray
from bayestouch.chain.neighbours import calibration_jacobian
from bayestouch.contact import composite_radius
from bayestouch.data.arrays import read_once
from bayestouch.data.averages import TouchMeans
from bayestouch.data.sensor import finger_of
from bayestouch.data.touches import Touches
from bayestouch.errors import InputError
from bayestouch.finger.calibration import finger_chain
from bayestouch.finger.chain_with_effects import ChainWithEffects
from bayestouch.finger.place.chain import FingerWithPlaces
from bayestouch.finger.place.posterior import PlacePosterior
from bayestouch.model.fitting import drift_basis, spread_over_elements
from bayestouch.model.observations import Observations, history_of
from bayestouch.model.planned import Group, PlannedReadings, PlannedTouches, with_load_error
from bayestouch.model.planned_table import one_row_each, planned_table
from bayestouch.results.objects import Calibration

# From composite radius (mm), location (rad) and load (N/m) of touches (t,) to readings (t, m).
Predict = Callable[[FloatArray, FloatArray, FloatArray], FloatArray]


def planned(calibration: Calibration, table: Touches) -> PlannedTouches:
    """Planned touches on a finger.

    Raises
    ------
    InputError
        The calibration has an identified E map, a touch has no indenter radius, or for the reasons of `planned_table`.
    """
    outer = finger_of(calibration.sensor).outer_radius_mm
    if calibration.has_identified_map:
        raise InputError("touches cannot be planned for a calibration with an identified E map")
    means = planned_table(table, calibration)
    if np.isnan(means.indenter_radius_mm).any():
        raise InputError("a planned touch needs its indenter", column="indenter_radius_mm")
    assert means.angle_deg is not None
    radius = np.asarray(composite_radius(means.indenter_radius_mm, outer))
    touch = radius, np.radians(means.angle_deg), means.load
    with_effects = calibration.has_effects
    predict, mean, columns, covariance, extra = (_with_effects if with_effects else _plain)(calibration, means, touch)
    alive = np.isfinite(means.readings)
    columns, slopes = (np.where(alive[:, :, None], each, 0.0) for each in (columns, touch_slopes(predict, *touch)))
    variance = calibration.noise.mean_variance(read_once(means.counts), mean)
    load_sd = calibration.noise.mean_load_sd(means.reads_of_load)
    # Without a force sensor a load is not known better than by its size.
    load_sd = np.where(np.isfinite(load_sd) & (load_sd > 0), load_sd, means.load)
    noise = with_load_error(variance, slopes[:, :, 2], load_sd) + extra
    # A tip is between edge and flat, and a place in the calibrated range: all that is known far from the elements.
    width = np.array([outer, float(np.radians(np.ptp(calibration.rows.location["theta_c"])))])
    precision = np.column_stack([np.tile(12 / np.maximum(width, 1e-3) ** 2, (len(radius), 1)), load_sd**-2.0])
    return PlannedTouches(
        readings=PlannedReadings(np.where(alive, mean, 0.0), columns, covariance, noise),
        parameters=_parameters(calibration, covariance.shape[0]),
        coordinates={"R": ("mm", 1.0), "theta_c": ("degree", 180 / np.pi), "P": ("N/m", 1.0)},
        slopes=slopes,
        precision=precision,
        asked=("R",),
    )


def touch_slopes(predict: Predict, radius_mm: FloatArray, angle: FloatArray, load: FloatArray) -> FloatArray:
    """Derivative of the readings over R (mm), θ_c (rad), P (N/m), (t, m, 3).

    The step in R covers a few knots of the contact table; at the knife edge the derivative is one-sided.
    """
    step = 0.05 * (radius_mm + 1.0)
    middle = np.maximum(radius_mm, step)
    by_radius = predict(middle + step, angle, load) - predict(middle - step, angle, load)
    turn, push = 1e-3, 1e-3 * load
    by_angle = predict(radius_mm, angle + turn, load) - predict(radius_mm, angle - turn, load)
    by_load = predict(radius_mm, angle, load + push) - predict(radius_mm, angle, load - push)
    return np.stack([by_radius / (2 * step)[:, None], by_angle / (2 * turn), by_load / (2 * push)[:, None]], axis=-1)


def _parameters(calibration: Calibration, d: int) -> tuple[Group, ...]:
    """σ, μ and the depths of the elements that have readings, as functions of d unknowns."""
    m = calibration.sensor.n_elements
    alive = np.flatnonzero(calibration.rows.responds)
    eye = np.eye(d)
    # The unknown is log μ.
    mu = float(calibration.mode["mu"]) * eye[3 * m + 1 : 3 * m + 2]
    return Group("sigma", "", eye[3 * m : 3 * m + 1]), Group("mu", "MPa", mu), Group("r_s", "mm", eye[m + alive])


def _plain(
    calibration: Calibration, means: TouchMeans, touch: tuple[FloatArray, FloatArray, FloatArray]
) -> tuple[Predict, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Prediction; readings, columns and covariance of the unknowns, further noise: without effects."""
    chain, places = finger_chain(calibration), PlacePosterior.from_arrays(calibration.extra)
    m, none = chain.n_elements, np.zeros((means.n_touches, chain.n_elements, chain.n_elements))
    if places is None:
        columns = _by_unknown(calibration_jacobian(chain, *touch))
        return chain.predict, chain.predict(*touch), columns, calibration.covariance, none
    with_places = FingerWithPlaces(chain, places)
    felt = with_places.effective_radius(touch[0], touch[1]), touch[1], touch[2]
    jacobian, _ = places.jacobian(calibration_jacobian(chain, *felt), chain, felt)
    # Given all parameters, the weights of an element's own functions vary by `own_covariance`.
    own = places.functions.own_columns(places.reference(chain), *felt)
    k = own.shape[2]
    further = np.zeros((means.n_touches, m, m * k))
    for e in range(m):
        further[:, e, e * k : (e + 1) * k] = own[:, e]
    covariance = block_diag(places.covariance, *places.own_covariance) if k else places.covariance
    columns = np.concatenate([_by_unknown(jacobian), further], axis=2)
    return with_places.predict, with_places.predict(*touch), columns, np.asarray(covariance), none


def _by_unknown(jacobian: FloatArray) -> FloatArray:
    """Derivatives (3 + s, t, m) over three parameters of each element and s shared ones, as (t, m, 3 m + s)."""
    _, t, m = jacobian.shape
    own = np.zeros((t, m, 3, m))
    index = np.arange(m)
    own[:, index, :, index] = np.moveaxis(jacobian[:3], 2, 0).swapaxes(1, 2)
    return np.concatenate([own.reshape(t, m, 3 * m), np.moveaxis(jacobian[3:], 0, -1)], axis=2)


def _with_effects(
    calibration: Calibration, means: TouchMeans, touch: tuple[FloatArray, FloatArray, FloatArray]
) -> tuple[Predict, FloatArray, FloatArray, FloatArray, FloatArray]:
    """As `_plain`, with effects. A drift of the planned touches is unknown: they are another session."""
    effects = ChainWithEffects.of(calibration)
    time = np.nan_to_num(means.time_s)
    table = one_row_each(means, time_s=time)
    span = float(time.min()), float(time.max())
    observed = Observations.of(table, time, np.zeros(len(time)), "s", history_of(table, time), span)
    model, vector = effects.model.observing(observed), effects.vector
    mean = model.predict(vector).touches
    jacobian = model.derivatives(vector)[0]
    scale = np.ones(len(vector))
    scale[: model.n_elements] = 1 / np.where(calibration.mode["response"] == 0, 1.0, calibration.mode["response"])
    noise = effects.listed.noise.covariance(mean, model.peak, means.counts)
    correction = effects.correction_table
    if correction is not None:
        jacobian = jacobian + correction.by_parameter(*touch)
        noise = noise + correction.covariance_at(*touch)
    columns = [np.moveaxis(jacobian * scale[:, None, None], 0, -1)]
    recording = replace(model.poses(vector), signal=mean)
    for drift in effects.listed.drifts:
        values = effects.values[drift.name]
        basis = drift_basis(drift, values, observed)
        raw = spread_over_elements(basis.T, drift.scale(recording), own=drift.own(values))
        columns.append(np.moveaxis(raw, 0, -1))
    d = sum(each.shape[2] for each in columns)
    covariance = np.eye(d)
    n = len(calibration.covariance)
    covariance[:n, :n] = calibration.covariance

    def predict(radius_mm: FloatArray, angle: FloatArray, load: FloatArray) -> FloatArray:
        return model.at(radius_mm, angle, load).predict(vector).touches

    return predict, mean, np.concatenate(columns, axis=2), covariance, noise
