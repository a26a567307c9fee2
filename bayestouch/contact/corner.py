"""Frictionless contact of a rigid corner (a wedge, tip first) with the bonded layer, at small strain.

The pressure of a wedge with faces of slope m on a half-plane is proportional to ``arccosh(a/|x|)``, infinite at
the tip. On the
finger's circle, and with the bonded core, the slope equation is

    du_r/ds = m sign(s) + s/r_b.

The wedge pressure solves the half-plane part of the first term exactly; the rest is smooth enough for the
Chebyshev terms of `bayestouch.contact.layer`. A 90° corner has m = 1, so that strains near its tip are not
small: the width is the least reliable result of the linear theory, and has little influence (0.18 mm at
P/μ = 2/3 mm).

Source: K. L. Johnson, Contact Mechanics (1985), §5.2: ``P = 2 μ m a/(1-σ)`` for a wedge
on a half-plane.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray
from bayestouch.contact.chebyshev import shape_transforms
from bayestouch.contact.compliance import SurfaceCompliance, wedge_transform
from bayestouch.contact.model import checked_body
from bayestouch.contact.table import collocation_places, half_angle_grid, spline, table_coordinate
from bayestouch.errors import InputError

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline


def half_plane_half_width(
    load_over_modulus_mm: ArrayLike, *, face_slope: float, outer_radius_mm: float, poisson_ratio: float
) -> FloatArray:
    """Half-width a in mm of a corner on a round finger taken as a half-plane.

    At a given width the loads due to the wedge and to the finger curvature add:
    ``P/μ = (2 m a + π a²/(2 r_b))/(1-σ)``.

    Parameters
    ----------
    load_over_modulus_mm : array_like
        P/μ in mm.
    face_slope : float
        m, rise of the faces over run; 1 for a right-angled corner.
    outer_radius_mm, poisson_ratio : float
        ``r_b`` in mm, σ.
    """
    load = (1 - poisson_ratio) * _checked_load(load_over_modulus_mm)
    # This form of the root of the quadratic has no cancellation at small loads.
    return np.asarray(load / (face_slope + np.sqrt(face_slope**2 + np.pi * load / (2 * outer_radius_mm))))


@dataclass(frozen=True, eq=False)
class CornerContact:
    """Tabulated contact of one corner on one bonded annulus; build it with `for_body`.

    Attributes
    ----------
    outer_radius_mm, poisson_ratio, face_slope : float
        ``r_b`` in mm, σ, and m.
    half_angles : (n,) array
        Half-angles β in rad, from 0.
    loads_mm : (n,) array
        P/μ at these half-angles, mm.
    shares : (n, 1 + terms) array
        Coefficients of the wedge pressure and of the Chebyshev terms at load 1 (terms after the first have no load).
    """

    outer_radius_mm: float
    poisson_ratio: float
    face_slope: float
    half_angles: FloatArray
    loads_mm: FloatArray
    shares: FloatArray

    @classmethod
    def for_body(
        cls,
        core_radius_mm: float,
        outer_radius_mm: float,
        poisson_ratio: float,
        face_slope: float = 1.0,
        terms: int = 16,
        *,
        largest_half_angle: float = 1.0,
        knots: int = 96,
    ) -> CornerContact:
        """Return the tabulated contact; `face_slope` is m, 1 for a right angle.

        The other parameters are those of `LayerContact.for_body`.

        With 16 terms the relative error of the width is 1e-6 and that of the slope 1e-4. It is largest at the tip,
        where it falls only like 1/M: the curvature term of the compliance has a ``t log t`` there.
        """
        checked_body(core_radius_mm, outer_radius_mm, poisson_ratio)
        if not 0 < face_slope < np.inf:
            raise InputError(f"slope of the corner's faces must be above zero, got {face_slope:g}")
        compliance = SurfaceCompliance.for_body(core_radius_mm, outer_radius_mm, poisson_ratio)
        beta = half_angle_grid(largest_half_angle, knots)
        places = collocation_places(terms)
        wedge = 2 * beta * face_slope / (np.pi * compliance.half_plane_mm)
        wanted = beta[:, np.newaxis] * places - wedge[:, np.newaxis] * compliance.wedge_slope(beta, places)
        rest = np.linalg.solve(compliance.slope(beta, places, terms), wanted[..., np.newaxis])[..., 0]
        load = wedge + rest[:, 0]
        shares = np.column_stack([wedge, rest]) / load[:, np.newaxis]
        return cls(
            outer_radius_mm,
            poisson_ratio,
            face_slope,
            np.append(0.0, beta),
            np.append(0.0, np.pi * outer_radius_mm**2 * load),
            np.vstack([np.eye(1, terms + 1), shares]),
        )

    def half_angle(self, load_over_modulus_mm: ArrayLike) -> FloatArray:
        """Half-angle β in rad, shape of the loads P/μ (mm). Raises `InputError` beyond the table."""
        load = _checked_load(load_over_modulus_mm)
        if np.any(load > self.loads_mm[-1]):
            largest = self.loads_mm[-1]
            raise InputError(f"load over modulus is {np.max(load):g} mm, more than the table's {largest:g} mm")
        half_plane = self._half_plane_angle(load)
        return np.asarray(half_plane * self._angle_spline(table_coordinate(half_plane)))

    def half_width(self, load_over_modulus_mm: ArrayLike) -> FloatArray:
        """Half-width a in mm, shape of the loads P/μ (mm)."""
        return self.outer_radius_mm * self.half_angle(load_over_modulus_mm)

    def spectrum(self, load_over_modulus_mm: ArrayLike, modes: ArrayLike) -> FloatArray:
        """Spectrum ``q_k``, shape ``load.shape + (n_modes,)``."""
        load = _checked_load(load_over_modulus_mm)
        z = self.half_angle(load)[..., np.newaxis] * np.asarray(modes, dtype=float)
        shares = np.asarray(self._share_spline(table_coordinate(self._half_plane_angle(load))))
        smooth = (shape_transforms(z, shares.shape[-1] - 1) @ shares[..., 1:, np.newaxis])[..., 0]
        return np.asarray(shares[..., :1] * wedge_transform(z) + smooth)

    def _half_plane_angle(self, load: FloatArray) -> FloatArray:
        """Half-angle on a half-plane, the argument of the table."""
        width = half_plane_half_width(
            load,
            face_slope=self.face_slope,
            outer_radius_mm=self.outer_radius_mm,
            poisson_ratio=self.poisson_ratio,
        )
        return width / self.outer_radius_mm

    @cached_property
    def _angle_spline(self) -> CubicSpline:
        half_plane = self._half_plane_angle(self.loads_mm)
        ratio = np.append(1.0, self.half_angles[1:] / half_plane[1:])
        return spline(table_coordinate(half_plane), ratio)

    @cached_property
    def _share_spline(self) -> CubicSpline:
        return spline(table_coordinate(self._half_plane_angle(self.loads_mm)), self.shares)


def _checked_load(load_over_modulus_mm: ArrayLike) -> FloatArray:
    load = np.asarray(load_over_modulus_mm, dtype=float)
    if not np.all((load >= 0) & (load < np.inf)):
        raise InputError("load over shear modulus must be finite and not negative")
    return load
