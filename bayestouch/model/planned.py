"""Readings of touches that are planned, to first order in what a calibration or a fit does not know."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.data.arrays import responding
from bayestouch.data.averages import TouchMeans
from bayestouch.data.touches import Touches, touches_from
from bayestouch.errors import InputError
from bayestouch.results.objects import Calibration

# Columns of places, of all bodies.
PLACES = ("angle_deg", "x_mm", "y_mm")


@dataclass(frozen=True, eq=False)
class PlannedReadings:
    """Mean readings of planned touches, linear in d unknowns; t touches, m elements.

    The unknowns are the parameters of a calibration or a fit, and the weights of its random functions.

    Attributes
    ----------
    mean : (t, m) array
        Expected readings.
    columns : (t, m, d) array
        Derivative of the readings over the unknowns; zero for an element without readings.
    covariance : (d, d) array
        Posterior covariance of the unknowns.
    noise : (t, m, m) array
        Covariance of the readings of each touch for known unknowns: noise, discrepancy, error of the load.
    """

    mean: FloatArray
    columns: FloatArray
    covariance: FloatArray
    noise: FloatArray

    def select(self, index: IntArray) -> PlannedReadings:
        """Some of the touches."""
        return PlannedReadings(self.mean[index], self.columns[index], self.covariance, self.noise[index])

    @property
    def total(self) -> FloatArray:
        """Covariance of the readings of each touch, unknowns included, (t, m, m)."""
        return np.asarray(self.columns @ self.covariance @ self.columns.swapaxes(1, 2) + self.noise)


@dataclass(frozen=True, eq=False)
class Group:
    """Quantities of one kind that touches are to determine; k quantities, d unknowns.

    Attributes
    ----------
    name, unit : str
        Name and unit of the kind.
    rows : (k, d) array
        Derivative of each quantity over the unknowns, in this unit.
    """

    name: str
    unit: str
    rows: FloatArray


@dataclass(frozen=True, eq=False)
class PlannedTouches:
    """Planned touches on a calibrated sensor; t touches, m elements, q coordinates of a touch.

    Attributes
    ----------
    readings : PlannedReadings
        Their readings.
    parameters : tuple of Group
        Parameters of the calibration.
    coordinates : mapping of str to (str, float)
        Unit of each coordinate of a touch, and the factor from the unit of `slopes` to it.
    slopes : (t, m, q) array
        Derivative of the readings over the coordinates of the touch.
    precision : (t, q) array
        What is known of the coordinates of a touch before its elements are read: inverse variances.
    asked : tuple of str
        Coordinates whose errors matter if none are named.
    """

    readings: PlannedReadings
    parameters: tuple[Group, ...]
    coordinates: Mapping[str, tuple[str, float]]
    slopes: FloatArray
    precision: FloatArray
    asked: tuple[str, ...]

    def biases(self, touches: IntArray, names: Sequence[str] | None = None) -> tuple[Group, ...]:
        """Errors of coordinates (`asked`, or those with `names`) of some touches by what the calibration leaves open.

        Readings are weighted as they are when touches are read: ``(Jᵀ Σ⁻¹ J + Λ)⁻¹ Jᵀ Σ⁻¹``, with the slopes J, the
        covariance Σ of the readings and the prior precision Λ.
        """
        some = self.readings.select(touches)
        slopes = self.slopes[touches]
        weighted: FloatArray = np.asarray(np.linalg.solve(some.total, slopes), dtype=np.float64)
        information = slopes.swapaxes(1, 2) @ weighted
        index = np.arange(slopes.shape[2])
        information[:, index, index] += self.precision[touches]
        weights = np.linalg.solve(information, weighted.swapaxes(1, 2))
        errors = weights @ some.columns
        return tuple(
            Group(name, unit, np.asarray(scale * errors[:, i]))
            for i, (name, (unit, scale)) in enumerate(self.coordinates.items())
            if name in (self.asked if names is None else names)
        )


def planned_table(table: Touches, calibration: Calibration) -> TouchMeans:
    """Planned touches, one row each; the readings of the table are not used.

    The number of samples of a touch is that of its rows, each with its `reads`. A load that is not stated is the mean
    load of the calibration. Readings are zero, and NaN for an element without readings in the calibration.

    Raises
    ------
    InputError
        The table has no touch in contact, touches of another sensor, a touch without location, or a load below zero.
    """
    body, rows = calibration.sensor.body, calibration.rows
    if table.n_elements != calibration.sensor.n_elements:
        raise InputError(f"expected touches of {calibration.sensor.n_elements} elements, got {table.n_elements}")
    for column in body.location_columns:
        values = getattr(table, column)
        if values is None or np.isnan(values).any():
            raise InputError("a planned touch needs its location", column=column)
    if (table.load < 0).any():
        raise InputError("expected loads above zero", column=body.load_column)
    alive = responding(rows.observed)
    readings = np.tile(np.where(alive, 0.0, np.nan), (table.n_rows, 1))
    means = table.with_(readings=readings, readings_sd=None).averaged()
    if means.n_touches == 0:
        raise InputError("no touch to choose from: give touches in contact")
    usual = float(np.nanmean(rows.load)) if np.isfinite(rows.load).any() else 1.0
    others = dict.fromkeys(set(PLACES) - set(body.location_columns))
    load = np.where(np.isnan(means.load), usual, means.load)
    return one_row_each(means, touch=np.arange(means.n_touches), load=load, **others).averaged()


def one_row_each(means: TouchMeans, **changed: Any) -> Touches:
    """Table with one row for each touch; `changed` columns of `Touches` replace those of the means."""
    columns: dict[str, Any] = {
        "touch": means.touch,
        "readings": means.readings,
        "time_s": means.time_s,
        "indenter_radius_mm": means.indenter_radius_mm,
        "load": means.load,
        "reads": means.counts.max(axis=1),
        **{name: getattr(means, name) for name in PLACES},
    }
    return touches_from(contact=1.0, **(columns | changed))


def with_load_error(variance: FloatArray, by_load: FloatArray, load_sd: FloatArray) -> FloatArray:
    """Covariance (t, m, m) of readings with independent variances (t, m) and an error of each load, (t,)."""
    shared = by_load * load_sd[:, None]
    return np.asarray(variance[:, :, None] * np.eye(variance.shape[1]) + shared[:, :, None] * shared[:, None])
