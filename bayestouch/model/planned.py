"""Readings of touches that are planned, to first order in what a calibration or a fit does not know."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray, IntArray


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
        Unit of each coordinate of a touch, the load last, and the factor from the unit of `slopes` to it.
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
        covariance Σ of the readings for a known load and the prior precision Λ.
        """
        some = self.readings.select(touches)
        slopes, precision = self.slopes[touches], self.precision[touches]
        # The load is an unknown here: its error is no noise of the readings.
        of_load = slopes[:, :, -1] / np.sqrt(precision[:, -1:])
        given_load = some.total - of_load[:, :, None] * of_load[:, None]
        weighted: FloatArray = np.asarray(np.linalg.solve(given_load, slopes), dtype=np.float64)
        information = slopes.swapaxes(1, 2) @ weighted
        index = np.arange(slopes.shape[2])
        information[:, index, index] += precision
        weights = np.linalg.solve(information, weighted.swapaxes(1, 2))
        errors = weights @ some.columns
        return tuple(
            Group(name, unit, np.asarray(scale * errors[:, i]))
            for i, (name, (unit, scale)) in enumerate(self.coordinates.items())
            if name in (self.asked if names is None else names)
        )


def covariance_of_shared(shared: FloatArray) -> FloatArray:
    """Covariance (t, m, m) of readings by independent errors that change them by `shared` (q, t, m) each."""
    return np.asarray(np.einsum("qti,qtj->tij", shared, shared))


def with_load_error(variance: FloatArray, by_load: FloatArray, load_sd: FloatArray) -> FloatArray:
    """Covariance (t, m, m) of readings with independent variances (t, m) and an error of each load, (t,)."""
    shared = by_load * load_sd[:, None]
    return np.asarray(variance[:, :, None] * np.eye(variance.shape[1]) + shared[:, :, None] * shared[:, None])
