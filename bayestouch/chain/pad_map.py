"""A calibrated pad as tables over location: sensitivity of each element, and its uncertainty."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bayestouch.array_types import FloatArray

# Number of locations interpolated at a time: 2^15 with three tables of eight elements take 6 MB, which fits the cache.
_CHUNK = 1 << 15


@dataclass(frozen=True, eq=False)
class PadMap:
    """Tables of a pad on a regular grid, interpolated by cubic splines; m elements, D coordinates.

    reading_e = offset_e + P sensitivity_e(location). Its variance due to the uncertainty of the calibration is
    ``offset_variance + 2 P covariance + P² variance``. Elements are assumed independent (only the few common
    parameters of the kernel correlate them).

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
    by_effect : (*grid, q m) array, optional
        Change of the sensitivity by one standard deviation of each of q independent causes: what the values of effects
        leave open, for which the readings of the calibration were corrected. Cause by cause.
    offset_by_effect : (q, m) array, optional
        The same for the reading without touch.
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
    by_effect: FloatArray | None = None
    offset_by_effect: FloatArray | None = None

    @property
    def n_elements(self) -> int:
        """Number of elements."""
        return len(self.offset)

    @property
    def dimensions(self) -> int:
        """Number of coordinates."""
        return len(self.origin)

    def exact(self) -> PadMap:
        """Return the same map without uncertainty (plug-in)."""
        none = np.zeros_like(self.variance)
        exact = replace(self, offset_variance=0 * self.offset, variance=none, covariance=none)
        return replace(exact, by_effect=None, offset_by_effect=None)

    def inside(self, location: ArrayLike) -> NDArray[np.bool_]:
        """Return True for locations (..., D) in the calibrated region, (...)."""
        place = np.asarray(location)
        return np.asarray(((place >= self.low) & (place <= self.high)).all(axis=-1))

    def at(self, location: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Sensitivity, its variance and its covariance with the offset at locations (..., D); three (..., m) arrays."""
        m = self.n_elements
        both = _interpolate(self._coefficients, self._index(location), (None,))[0]
        return both[..., :m], np.maximum(both[..., m : 2 * m], 0.0), both[..., 2 * m :]

    @property
    def n_causes(self) -> int:
        """Number of independent causes q of `by_effect`."""
        return 0 if self.offset_by_effect is None else len(self.offset_by_effect)

    def changes(self, location: FloatArray) -> FloatArray:
        """Change of the sensitivity (..., q, m) by one sd of each cause of `by_effect`, at locations (..., D).

        Linear between grid points: an uncertainty need not be known as well as the map.
        """
        assert self.by_effect is not None
        index = self._index(location)
        flat = index.reshape(-1, self.dimensions)
        grid = np.array(self.by_effect.shape[:-1])
        cell = np.minimum(flat.astype(np.int64), grid - 2)
        share = flat - cell
        table = self.by_effect.reshape(-1, self.by_effect.shape[-1])
        strides = np.cumprod([1, *grid[:0:-1]])[::-1]
        corner, out = cell @ strides, np.zeros((len(flat), table.shape[1]))
        for taps in product((0, 1), repeat=self.dimensions):
            weight = np.where(taps, share, 1 - share).prod(axis=1)
            out += weight[:, None] * table[corner + int(np.dot(taps, strides))]
        return out.reshape(*index.shape[:-1], self.n_causes, self.n_elements)

    def slopes(self, location: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Sensitivity (..., m) and its derivative along each coordinate (..., D, m), per mm, at locations (..., D)."""
        m, axes = self.n_elements, range(self.dimensions)
        parts = _interpolate(self._coefficients[..., :m], self._index(location), (None, *axes))
        return parts[0], np.stack([parts[1 + axis] / self.step[axis] for axis in axes], axis=-2)

    def reading_variance(self, variance: FloatArray, covariance: FloatArray, load: FloatArray) -> FloatArray:
        """Variance of readings (..., m) under `load` (...) due to the calibration, from the results of `at`."""
        p = load[..., None]
        return np.asarray(np.maximum(self.offset_variance + p * (2 * covariance + p * variance), 0.0))

    def arrays(self) -> dict[str, FloatArray]:
        """Return all arrays by name, for a file."""
        names = _NAMES if self.by_effect is None else (*_NAMES, *_BY_EFFECT)
        return {f"map_{name}": np.asarray(getattr(self, name)) for name in names}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, FloatArray]) -> PadMap:
        """Return the map from the result of `arrays`."""
        names = (*_NAMES, *(name for name in _BY_EFFECT if f"map_{name}" in arrays))
        return cls(**{name: np.asarray(arrays[f"map_{name}"], dtype=float) for name in names})

    def _index(self, location: FloatArray) -> FloatArray:
        # Beyond the grid the last value is used: such locations are outside the prior, but must not raise an error.
        last = np.array(self.sensitivity.shape[:-1]) - 1
        return np.clip((np.asarray(location) - self.origin) / self.step, 0.0, last)

    @cached_property
    def _coefficients(self) -> FloatArray:
        """Spline coefficients of the three tables side by side, with one more than the grid on every side."""
        from scipy.ndimage import spline_filter1d

        table = np.concatenate([self.sensitivity, self.variance, self.covariance], axis=-1)
        for axis in range(self.dimensions):
            table = spline_filter1d(table, order=3, axis=axis, mode="mirror")
        width = [(1, 2)] * self.dimensions + [(0, 0)]
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
# Of calibrations whose readings were corrected for effects.
_BY_EFFECT = ("by_effect", "offset_by_effect")


def _interpolate(coefficients: FloatArray, index: FloatArray, derivatives: tuple[int | None, ...]) -> list[FloatArray]:
    """Cubic B-spline sums at grid positions (..., D), or their derivatives along one coordinate; (..., f) arrays."""
    shape, dimensions = index.shape[:-1], index.shape[-1]
    flat = index.reshape(-1, dimensions)
    table = coefficients.reshape(-1, coefficients.shape[-1])
    strides = np.cumprod([1, *coefficients.shape[-2:0:-1]])[::-1]
    out = [np.zeros((len(flat), table.shape[1])) for _ in derivatives]
    for first in range(0, len(flat), _CHUNK):
        part = slice(first, first + _CHUNK)
        cell = flat[part].astype(np.int64)
        weights = _weights(flat[part] - cell)
        corner = cell @ strides
        for taps in product(range(4), repeat=dimensions):
            # With one extra coefficient in front, tap 0 is the coefficient before the cell.
            values = table[corner + int(np.dot(taps, strides))]
            for total, over in zip(out, derivatives, strict=True):
                weight = np.ones(len(cell))
                for axis, tap in enumerate(taps):
                    weight = weight * weights[1 if axis == over else 0][tap][:, axis]
                total[part] += weight[:, None] * values
    return [total.reshape(*shape, -1) for total in out]


def _weights(t: FloatArray) -> tuple[tuple[FloatArray, ...], tuple[FloatArray, ...]]:
    """Weights of the four cubic B-splines at the fraction t of a cell, and their derivatives."""
    s = 1 - t
    values = (s**3 / 6, (4 - 3 * t * t * (2 - t)) / 6, (4 - 3 * s * s * (2 - s)) / 6, t**3 / 6)
    slopes = (-s * s / 2, t * (1.5 * t - 2), s * (2 - 1.5 * s), t * t / 2)
    return values, slopes
