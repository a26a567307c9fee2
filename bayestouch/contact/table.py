"""Grids and splines over the half-angle, used by all tabulated contacts."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline


# Half-angle β_1 (rad) in the table coordinate log(1 + β/β_1): below it the knots are dense.
HALF_ANGLE_SCALE = 0.05


def collocation_places(terms: int) -> FloatArray:
    """Collocation points t of the slope equation: the positive zeros of ``T_2M``, shape (terms,)."""
    return np.asarray(np.cos((2 * np.arange(terms) + 1) * np.pi / (4 * terms)))


def table_coordinate(half_angle: ArrayLike) -> FloatArray:
    """Coordinate for the interpolation over the half-angle (rad), zero at zero half-angle."""
    return np.asarray(np.log1p(np.asarray(half_angle, dtype=float) / HALF_ANGLE_SCALE))


def half_angle_grid(largest_half_angle: float, knots: int) -> FloatArray:
    """Half-angles in rad above zero, equally spaced in `table_coordinate`, shape (knots,)."""
    last = float(table_coordinate(largest_half_angle))
    return np.asarray(HALF_ANGLE_SCALE * np.expm1(np.linspace(0, last, knots + 1)[1:]))


def spline(coordinates: FloatArray, values: FloatArray) -> CubicSpline:
    """Cubic spline through `values` (first axis) at `coordinates`."""
    from scipy.interpolate import CubicSpline  # imported here, because the import takes half a second

    return CubicSpline(coordinates, values)
