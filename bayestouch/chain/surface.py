"""The outer surface of a finger that is not round: its curvature, by the place touched."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.data.arrays import nearest_turn

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

# An indenter touches no hollow: 1/R is at least this share of that on a round surface.
LEAST_SHARE = 0.05
# Distance from the outermost knots to where the departure ends, in distances between knots.
FADING = 2.0


@dataclass(frozen=True, eq=False)
class Profile:
    """Departure of the surface's curvature from ``1/r_b``: cubic splines through values at equally spaced knots.

    Beyond the outermost knots the departure goes to zero within two distances between knots. It adds to the curvature
    of the indenter: ``1/R = 1/r_c + 1/r_b + departure``.

    Attributes
    ----------
    knots_deg : tuple of float
        Places of the k knots, increasing, degree.
    departure : (k,) array
        Departures at the knots, 1/mm; positive where the surface is more curved than a circle of radius ``r_b``.
    """

    knots_deg: tuple[float, ...]
    departure: FloatArray

    def at(self, angle: FloatArray) -> FloatArray:
        """Departure (...) of the curvature at places (...) in rad, 1/mm."""
        return np.asarray(self._spline(_within(self.knots_deg, angle)), dtype=np.float64)

    def effective_radius(self, radius_mm: FloatArray, angle: FloatArray) -> FloatArray:
        """Composite radius (...) in mm with this surface, of touches with composite radius R on a round one."""
        return np.asarray(radius_mm / np.maximum(1 + radius_mm * self.at(angle), LEAST_SHARE))

    def scaled(self, factor: float) -> Profile:
        """The profile with departures multiplied by a factor."""
        return replace(self, departure=factor * self.departure)

    @cached_property
    def _spline(self) -> CubicSpline:
        from scipy.interpolate import CubicSpline

        return CubicSpline(*_with_ends(self.knots_deg, self.departure), bc_type="clamped")

    def __getstate__(self) -> dict[str, object]:
        """State for a worker process, without the spline."""
        return {"knots_deg": self.knots_deg, "departure": self.departure}


def profile_basis(knots_deg: tuple[float, ...], angle: FloatArray) -> FloatArray:
    """Change (..., k) of the departure at places (...) in rad with the value at each knot."""
    return np.asarray(_unit_splines(knots_deg)(_within(knots_deg, angle)), dtype=np.float64)


@lru_cache(maxsize=8)
def _unit_splines(knots_deg: tuple[float, ...]) -> CubicSpline:
    from scipy.interpolate import CubicSpline

    return CubicSpline(*_with_ends(knots_deg, np.eye(len(knots_deg))), bc_type="clamped")


def _with_ends(knots_deg: tuple[float, ...], values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Knots and values (k, ...) with a zero before and after."""
    first, last = _ends(knots_deg)
    none = np.zeros((1, *values.shape[1:]))
    return np.array([first, *knots_deg, last]), np.concatenate([none, values, none])


def _ends(knots_deg: tuple[float, ...]) -> tuple[float, float]:
    room = FADING * (knots_deg[1] - knots_deg[0])
    return knots_deg[0] - room, knots_deg[-1] + room


def _within(knots_deg: tuple[float, ...], angle: FloatArray) -> FloatArray:
    """Places (...) in degree, not farther than the ends, from places in rad of any number of turns."""
    first, last = _ends(knots_deg)
    return np.clip(nearest_turn(np.degrees(angle), 0.5 * (first + last)), first, last)
