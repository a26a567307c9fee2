"""A calibrated pad as tables over location: sensitivity of each element, and its uncertainty."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.errors import InputError

# Coefficients that are gathered at a time: 2 MB, which stays in the cache.
_HELD = 1 << 18


@dataclass(frozen=True, eq=False)
class PadMap:
    """Tables of a pad on a regular grid, interpolated by cubic splines; m elements, D coordinates.

    reading_e = offset_e + P sensitivity_e(location). With `loads`, the sensitivity and its variance change with the
    load P as well: they are linear in ln P between these loads, and constant beyond. The variance of a reading due to
    the uncertainty of the calibration is ``offset_variance + 2 P covariance + P² variance``, which is independent of
    other elements. What the errors of elements have in common are `shared` and `by_effect`, whose variances come in
    addition.

    Attributes
    ----------
    origin, step : (D,) arrays
        First grid point and spacing, mm.
    low, high : (D,) arrays
        Calibrated region, mm; the grid extends some steps beyond it.
    offset, offset_variance : (m,) arrays
        Reading without touch, and its variance.
    sensitivity : (*grid, m) array
        Reading per unit load.
    variance, covariance : (*grid, m) arrays
        Variance of the sensitivity, and its covariance with the offset.
    shared : (*grid, c m) array, optional
        Change of the sensitivity by one standard deviation of each of c independent errors of the calibration that
        elements have in common at a place, see `bayestouch.pad.shared_errors`. Error by error.
    by_effect : (*grid, q m) array, optional
        Change of the sensitivity by one standard deviation of each of q independent causes: what the values of effects
        leave open, for which the readings of the calibration were corrected. Cause by cause.
    offset_by_effect : (q, m) array, optional
        The same for the reading without touch.
    loads : (L,) array, optional
        Loads at which `by_load` is given, ascending.
    by_load, variance_by_load : (*grid, L m) arrays, optional
        What is added to `sensitivity` and `variance` at each of these loads, load by load.
    """

    origin: FloatArray
    step: FloatArray
    low: FloatArray
    high: FloatArray
    offset: FloatArray
    offset_variance: FloatArray
    sensitivity: FloatArray
    variance: FloatArray
    covariance: FloatArray
    shared: FloatArray | None = None
    by_effect: FloatArray | None = None
    offset_by_effect: FloatArray | None = None
    loads: FloatArray | None = None
    by_load: FloatArray | None = None
    variance_by_load: FloatArray | None = None

    @property
    def n_elements(self) -> int:
        """Number of elements."""
        return len(self.offset)

    @property
    def dimensions(self) -> int:
        """Number of coordinates."""
        return len(self.origin)

    def exact(self, place_error: float = 0.0) -> PadMap:
        """Return the same map without the uncertainty of the calibration (plug-in).

        Parameters
        ----------
        place_error : float
            Standard deviation of the error of the place of a touch along each coordinate, mm. It is no uncertainty of
            the calibration, and stays in `shared`.
        """
        none = np.zeros_like(self.variance)
        exact = replace(self, offset_variance=0 * self.offset, variance=none, covariance=none)
        change = None if self.variance_by_load is None else np.zeros_like(self.variance_by_load)
        shared = self._displaced(place_error) if place_error else None
        return replace(exact, shared=shared, by_effect=None, offset_by_effect=None, variance_by_load=change)

    def _displaced(self, distance: float) -> FloatArray:
        """Change of `sensitivity` by a displacement of so many mm along each coordinate, (*grid, D m)."""
        grid = self.sensitivity.shape[:-1]
        points = self.origin + self.step * np.moveaxis(np.indices(grid), 0, -1)
        return distance * self.slopes(points)[1].reshape(*grid, -1)

    def inside(self, location: ArrayLike) -> NDArray[np.bool_]:
        """Return True for locations (..., D) in the calibrated region, (...)."""
        place = np.asarray(location)
        return np.asarray(((place >= self.low) & (place <= self.high)).all(axis=-1))

    def at(self, location: FloatArray, load: FloatArray | None = None) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Sensitivity, its variance and its covariance with the offset; three (..., m) arrays.

        Parameters
        ----------
        location : (..., D) array
            Locations, mm.
        load : (...) array, optional
            Loads; by default the one that `sensitivity` and `variance` are of.
        """
        m, index = self.n_elements, self._index(location)
        both = _interpolate(self._coefficients, index, (None,))[0]
        value, variance, covariance = both[..., :m], both[..., m : 2 * m], both[..., 2 * m :]
        if load is not None and self.loads is not None:
            cell, weight, _ = self._load_weights(load)
            change = _interpolate(self._coefficients_by_load, index, (None,), (cell, weight))[0]
            value, variance = value + change[..., :m], variance + change[..., m:]
            covariance = np.broadcast_to(covariance, value.shape)
        return value, np.maximum(variance, 0.0), covariance

    def _load_weights(self, load: FloatArray) -> tuple[IntArray, FloatArray, FloatArray]:
        """Place in `loads` of the load before each load (...), and weights (..., 2) of this one and of the next.

        Last the derivatives of the weights over the logarithm of the load.
        """
        assert self.loads is not None
        nodes = np.log(self.loads)
        at = np.log(np.clip(load, self.loads[0], self.loads[-1]))
        cell = np.clip(np.searchsorted(nodes, at, side="right") - 1, 0, len(nodes) - 2)
        width = nodes[cell + 1] - nodes[cell]
        share = (at - nodes[cell]) / width
        slope = np.where((load >= self.loads[0]) & (load <= self.loads[-1]), 1 / width, 0.0)
        return cell, np.stack([1 - share, share], axis=-1), np.stack([-slope, slope], axis=-1)

    @property
    def n_causes(self) -> int:
        """Number of independent causes q of `by_effect`."""
        return 0 if self.offset_by_effect is None else len(self.offset_by_effect)

    @property
    def n_shared(self) -> int:
        """Number of independent errors c of `shared`."""
        return 0 if self.shared is None else self.shared.shape[-1] // self.n_elements

    @cached_property
    def _changes(self) -> FloatArray:
        return np.concatenate([each for each in (self.shared, self.by_effect) if each is not None], axis=-1)

    def changes(self, location: FloatArray) -> FloatArray:
        """Change of the sensitivity (..., c + q, m) by one sd of each cause, at locations (..., D).

        First those of `shared`, then those of `by_effect`. Linear between grid points: an uncertainty need not be known
        as well as the map.
        """
        return self._between(self._changes, location)

    def _between(self, table: FloatArray, location: FloatArray) -> FloatArray:
        """Linear interpolation (..., k, m) of a table (*grid, k m) at locations (..., D)."""
        index = self._index(location)
        flat = index.reshape(-1, self.dimensions)
        grid = np.array(table.shape[:-1])
        cell = np.minimum(flat.astype(np.int64), grid - 2)
        share = flat - cell
        table, k = table.reshape(-1, table.shape[-1]), table.shape[-1] // self.n_elements
        strides = np.cumprod([1, *grid[:0:-1]])[::-1]
        corner, out = cell @ strides, np.zeros((len(flat), table.shape[1]))
        for taps in product((0, 1), repeat=self.dimensions):
            weight = np.where(taps, share, 1 - share).prod(axis=1)
            out += weight[:, None] * table[corner + int(np.dot(taps, strides))]
        return out.reshape(*index.shape[:-1], k, self.n_elements)

    def shared_at(self, location: FloatArray) -> FloatArray:
        """Those of `changes` that belong to `shared`, (..., c, m)."""
        if self.shared is None:
            return np.zeros((*np.shape(location)[:-1], 0, self.n_elements))
        return self._between(self.shared, location)

    def slopes(self, location: FloatArray, load: FloatArray | None = None) -> tuple[FloatArray, FloatArray]:
        """Derivatives of the signal at locations (..., D): over the load, and along each coordinate over the load.

        Parameters
        ----------
        location, load
            As of `at`.

        Returns
        -------
        (..., m) array, (..., D, m) array
            Derivative of the signal over the load, which is the sensitivity if that does not change with the load; and
            derivative of the sensitivity along each coordinate, per mm.
        """
        m, axes, index = self.n_elements, range(self.dimensions), self._index(location)
        parts = _interpolate(self._coefficients[..., :m], index, (None, *axes))
        marginal = parts[0]
        if load is not None and self.loads is not None:
            cell, weight, by_log = self._load_weights(load)
            changes = _interpolate(self._coefficients_by_load, index, (None, *axes), (cell, weight))
            parts = [part + change[..., :m] for part, change in zip(parts, changes, strict=True)]
            steeper = _interpolate(self._coefficients_by_load, index, (None,), (cell, by_log))[0]
            marginal = parts[0] + steeper[..., :m]
        return marginal, np.stack([parts[1 + axis] / self.step[axis] for axis in axes], axis=-2)

    def reading_variance(self, variance: FloatArray, covariance: FloatArray, load: FloatArray) -> FloatArray:
        """Variance of readings (..., m) under `load` (...) due to the calibration, from the results of `at`.

        That of errors that elements have in common is not part of it.
        """
        p = load[..., None]
        return np.asarray(np.maximum(self.offset_variance + p * (2 * covariance + p * variance), 0.0))

    def arrays(self) -> dict[str, FloatArray]:
        """Return all arrays by name, for a file."""
        names = (*_NAMES, *(name for name in _SOME if getattr(self, name) is not None))
        return {f"map_{name}": np.asarray(getattr(self, name)) for name in names}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, FloatArray]) -> PadMap:
        """Return the map from the result of `arrays`.

        Raises
        ------
        InputError
            An array is missing, as from a damaged file.
        """
        lost = next((name for name in _NAMES if f"map_{name}" not in arrays), None)
        if lost is not None:
            raise InputError("missing from the arrays of the calibration", column=f"map_{lost}")
        names = (*_NAMES, *(name for name in _SOME if f"map_{name}" in arrays))
        return cls(**{name: np.asarray(arrays[f"map_{name}"], dtype=float) for name in names})

    def _index(self, location: FloatArray) -> FloatArray:
        # Beyond the grid the last value is used: such locations are outside the prior, but must not raise an error.
        last = np.array(self.sensitivity.shape[:-1]) - 1
        return np.clip((np.asarray(location) - self.origin) / self.step, 0.0, last)

    @cached_property
    def _coefficients(self) -> FloatArray:
        """Spline coefficients (*grid + 3, 3 m) of the tables that do not change with the load, side by side."""
        return self._splines(np.concatenate([self.sensitivity, self.variance, self.covariance], axis=-1))

    @cached_property
    def _coefficients_by_load(self) -> FloatArray:
        """Spline coefficients (*grid + 3, L, 2 m) of `by_load` and `variance_by_load`."""
        assert self.loads is not None and self.by_load is not None and self.variance_by_load is not None
        shape = *self.by_load.shape[:-1], len(self.loads), self.n_elements
        return self._splines(np.concatenate([self.by_load.reshape(shape), self.variance_by_load.reshape(shape)], -1))

    def _splines(self, table: FloatArray) -> FloatArray:
        """Coefficients of cubic splines over the grid, with one more before and two more behind it on every axis."""
        from scipy.ndimage import spline_filter1d

        for axis in range(self.dimensions):
            table = spline_filter1d(table, order=3, axis=axis, mode="mirror")
        width = [(1, 2)] * self.dimensions + [(0, 0)] * (table.ndim - self.dimensions)
        return np.ascontiguousarray(np.pad(table, width, mode="reflect"))


_NAMES = (
    "origin",
    "step",
    "low",
    "high",
    "offset",
    "offset_variance",
    "sensitivity",
    "variance",
    "covariance",
)
# Of calibrations with errors that elements share; whose readings were corrected for effects; with a correction, of
# touches whose loads vary.
_SOME = ("shared", "by_effect", "offset_by_effect", "loads", "by_load", "variance_by_load")


def _interpolate(
    coefficients: FloatArray,
    index: FloatArray,
    derivatives: tuple[int | None, ...],
    loads: tuple[IntArray, FloatArray] | None = None,
) -> list[FloatArray]:
    """Cubic B-spline sums at grid positions (..., D), or their derivatives along one coordinate; (..., f) arrays.

    With `loads`, the last axis but one of the coefficients is that of loads, of which two that follow each other are
    summed: the place of the first (...), and the weights of both (..., 2).
    """
    dimensions = index.shape[-1]
    cells, of_loads = (np.zeros((), dtype=np.int64), np.ones(1)) if loads is None else loads
    shape = np.broadcast_shapes(index.shape[:-1], cells.shape)
    flat = np.broadcast_to(index, (*shape, dimensions)).reshape(-1, dimensions)
    first_load = np.broadcast_to(cells, shape).ravel()
    of_loads = np.broadcast_to(of_loads, (*shape, of_loads.shape[-1])).reshape(-1, of_loads.shape[-1])
    rows = 1 if loads is None else coefficients.shape[-2]
    table = coefficients.reshape(-1, coefficients.shape[-1])
    strides = rows * np.cumprod([1, *coefficients.shape[dimensions - 1 : 0 : -1]])[::-1]
    # With one extra coefficient in front, tap 0 is the coefficient before the cell. The last axis of taps is the load.
    taps = np.array(list(product(range(4), repeat=dimensions))) @ strides
    steps = (taps[:, None] + np.arange(of_loads.shape[1])).ravel()
    out = [np.empty((len(flat), table.shape[1])) for _ in derivatives]
    held = max(1, _HELD // (len(steps) * table.shape[1]))
    for first in range(0, len(flat), held):
        part = slice(first, first + held)
        # The fractions of a location that is NaN are NaN, and so are its sums; its cell is any.
        cell = np.nan_to_num(flat[part]).astype(np.int64)
        weights = _weights(flat[part] - cell)
        values = table.take((cell @ strides + first_load[part])[:, None] + steps, axis=0)
        for total, over in zip(out, derivatives, strict=True):
            weight = np.ones((len(cell), 1))
            for axis in range(dimensions):
                own = weights[1 if axis == over else 0][:, :, axis]
                weight = (weight[:, :, None] * own[:, None]).reshape(len(cell), -1)
            every = (weight[:, :, None] * of_loads[part, None]).reshape(len(cell), 1, -1)
            total[part] = (every @ values)[:, 0]
    return [total.reshape(*shape, -1) for total in out]


def _weights(t: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Weights (n, 4, D) of the four cubic B-splines at the fractions t (n, D) of a cell, and their derivatives."""
    s = 1 - t
    values = (s**3 / 6, (4 - 3 * t * t * (2 - t)) / 6, (4 - 3 * s * s * (2 - s)) / 6, t**3 / 6)
    slopes = (-s * s / 2, t * (1.5 * t - 2), s * (2 - 1.5 * s), t * t / 2)
    return np.stack(values, axis=1), np.stack(slopes, axis=1)
