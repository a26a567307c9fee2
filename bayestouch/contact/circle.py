"""Frictionless contact of true circles: a rigid cylinder of radius r_c on the round finger.

Along the ray at angle θ the indenter's circle rises from the finger's circle with slope

    du_r/ds = sin θ g (g+1)/(w (g cos θ + w)),    w = √(1 - g² sin² θ),    g = r_b/R = 1 + r_b/r_c,

which is ``g θ`` for small angles: the parabola. The slope becomes infinite at the indenter's quarter circle,
``sin θ = 1/g``, so that the contact never extends beyond it, however soft the rubber is. Strain is assumed small
and radial; only the profile is exact.

The slope operator does not depend on the profile. Its inverse is tabulated over the half-angle once; the
half-angle for any load and radius is then the root of one increasing function.

A parabola is a good replacement if its κ gives the same second moment of the pressure
(`LayerContact.equivalent_kappa`). Largest error of ``q_k`` on the paper's finger, for k <= 30 (nearly all
that reaches an element) and for k <= 150:

    P/μ (mm)  r_c (mm)   a/r_c   same P R/μ       same half-width  same second moment
    2/3       0.5        0.60    8e-3    5e-2     4e-3    4e-2     4e-5    1e-2
    2/3       3.9        0.20    7e-3    1e-2     4e-3    7e-3     3e-4    4e-3
    2/3       ∞                  2e-3    2e-3     2e-3    2e-3     7e-4    1e-3
    4         0.5        0.95    2e-1    3e-1     6e-2    2e-1     2e-3    1e-1
    4         3.9        0.44    4e-2    4e-2     3e-2    3e-2     1e-2    2e-2
    4         ∞                  8e-3    8e-3     6e-3    6e-3     3e-3    3e-3
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray
from bayestouch.contact.chebyshev import shape_transforms
from bayestouch.contact.compliance import SurfaceCompliance
from bayestouch.contact.hertz import composite_radius
from bayestouch.contact.model import checked_body
from bayestouch.contact.table import collocation_places, half_angle_grid, spline, table_coordinate
from bayestouch.errors import InputError

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline


# Largest value of g sin θ. At 1, the indenter's quarter circle, the slope is infinite.
LARGEST_PART_OF_CIRCLE = 0.99


def circle_slope(theta: ArrayLike, radius_ratio: ArrayLike) -> FloatArray:
    """Slope ``du_r/ds`` under a circular indenter at angle θ (rad) from the contact's centre.

    `radius_ratio` is ``g = r_b/R``, 1 for a flat. Arguments broadcast; ``g |sin θ|`` must be below 1.
    """
    angle, g = np.asarray(theta, dtype=float), np.asarray(radius_ratio, dtype=float)
    sine = np.sin(angle)
    root = np.sqrt(1 - (g * sine) ** 2)
    return np.asarray(sine * g * (g + 1) / (root * (g * np.cos(angle) + root)))


@dataclass(frozen=True, eq=False)
class CircleContact:
    """Tabulated contact of true circles on one bonded annulus; build it with `for_body` or `LayerContact.circle`.

    Attributes
    ----------
    outer_radius_mm, poisson_ratio : float
        ``r_b`` in mm, σ.
    half_angles : (n,) array
        Half-angles β of the table in rad, from 0.
    inverses : (n, terms, terms) array
        Inverse of the slope operator at the collocation points, times ``2A/β``.
    """

    outer_radius_mm: float
    poisson_ratio: float
    half_angles: FloatArray
    inverses: FloatArray

    @classmethod
    def for_body(
        cls,
        core_radius_mm: float,
        outer_radius_mm: float,
        poisson_ratio: float,
        terms: int = 24,
        *,
        largest_half_angle: float = 1.0,
        knots: int = 96,
    ) -> CircleContact:
        """Return the table of the inverse slope operator for one body.

        Parameters are those of `LayerContact.for_body`. The default has more terms than for the parabola, because
        the slope of a circle is nearly singular if the contact reaches almost to the quarter circle.
        """
        checked_body(core_radius_mm, outer_radius_mm, poisson_ratio)
        compliance = SurfaceCompliance.for_body(core_radius_mm, outer_radius_mm, poisson_ratio)
        beta = half_angle_grid(largest_half_angle, knots)
        places = collocation_places(terms)
        scale = beta[:, np.newaxis, np.newaxis] / (2 * compliance.half_plane_mm)
        operator = compliance.slope(beta, places, terms) * scale
        line = np.cos((2 * np.arange(terms) + 1) * np.arccos(places)[:, np.newaxis])
        inverses = np.linalg.inv(np.concatenate([line[np.newaxis], operator]))
        return cls(outer_radius_mm, poisson_ratio, np.append(0.0, beta), inverses)

    def half_angle(self, load_over_modulus_mm: ArrayLike, indenter_radius_mm: ArrayLike) -> FloatArray:
        """Half-angle β of the contact in rad.

        Parameters
        ----------
        load_over_modulus_mm : array_like
            P/μ in mm (P in N/mm, μ in MPa).
        indenter_radius_mm : array_like
            ``r_c`` in mm, 0 (knife edge) to inf (flat), or a hollow, as in `composite_radius`; broadcast against the
            loads.

        Returns
        -------
        array of the broadcast shape
            Limited to ``sin β = 0.99/g``, close to the indenter's quarter circle.

        Raises
        ------
        InputError
            If a load is negative or not finite, a contact is beyond the table, or for the reasons of
            `composite_radius`.
        """
        load, ratio = self._checked(load_over_modulus_mm, indenter_radius_mm)
        end = self.half_angles[-1]
        quarter = np.arcsin(np.minimum(LARGEST_PART_OF_CIRCLE / ratio, np.sin(min(end, np.pi / 2))))
        if np.any((self._load(quarter, ratio) < load) & (quarter > end * (1 - 1e-12))):
            raise InputError(f"a contact is wider than the table's half-angle of {end:g} rad: too soft or too heavy")
        low, high = np.zeros_like(quarter), quarter
        for _ in range(50):  # bisection: to 1e-15 of the quarter circle
            middle = (low + high) / 2
            over = self._load(middle, ratio) > load
            low, high = np.where(over, low, middle), np.where(over, middle, high)
        return np.asarray((low + high) / 2)

    def half_width(self, load_over_modulus_mm: ArrayLike, indenter_radius_mm: ArrayLike) -> FloatArray:
        """Half-width a of the contact in mm along the finger's surface; parameters of `half_angle`."""
        return self.outer_radius_mm * self.half_angle(load_over_modulus_mm, indenter_radius_mm)

    def spectrum(self, load_over_modulus_mm: ArrayLike, indenter_radius_mm: ArrayLike, modes: ArrayLike) -> FloatArray:
        """Spectrum ``q_k``; parameters of `half_angle`, shape ``broadcast + (n_modes,)``."""
        beta, shape = self._shape(load_over_modulus_mm, indenter_radius_mm)
        transforms = shape_transforms(beta[..., np.newaxis] * np.asarray(modes, dtype=float), shape.shape[-1])
        return np.asarray((transforms @ shape[..., np.newaxis])[..., 0])

    def second_moment(self, load_over_modulus_mm: ArrayLike, indenter_radius_mm: ArrayLike) -> FloatArray:
        """Mean of ``(θ - θ_c)²`` weighted by the pressure, rad²; parameters of `half_angle`."""
        beta, shape = self._shape(load_over_modulus_mm, indenter_radius_mm)
        return np.asarray(beta**2 * (1 + shape[..., 1]) / 4)

    def _checked(self, load: ArrayLike, radius: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Loads P/μ and ratios ``g = r_b/R``, checked and broadcast."""
        loads, composite = np.broadcast_arrays(
            np.asarray(load, dtype=float), composite_radius(radius, self.outer_radius_mm)
        )
        if not np.all((loads >= 0) & (loads < np.inf)):
            raise InputError("load over shear modulus must be finite and not negative")
        # A knife edge is a circle of negligible radius.
        return loads, self.outer_radius_mm / np.maximum(composite, 1e-9 * self.outer_radius_mm)

    def _slopes(self, beta: FloatArray, ratio: FloatArray) -> FloatArray:
        places = collocation_places(self.inverses.shape[1])
        return circle_slope(beta[..., np.newaxis] * places, ratio[..., np.newaxis])

    def _load(self, beta: FloatArray, ratio: FloatArray) -> FloatArray:
        """P/μ in mm of contacts with half-angle β."""
        weights = self._load_spline(table_coordinate(beta))
        scale = np.pi * self.outer_radius_mm / (2 * (1 - self.poisson_ratio))
        return np.asarray(scale * beta * np.sum(weights * self._slopes(beta, ratio), axis=-1))

    def _shape(self, load: ArrayLike, radius: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Half-angle, and pressure coefficients with ``c_0 = 1``."""
        beta = self.half_angle(load, radius)
        ratio = np.broadcast_to(self._checked(load, radius)[1], beta.shape)
        # At zero load the limit is a Hertz pressure; every small half-angle has the same shape.
        safe = np.maximum(beta, 1e-12 / ratio)
        inverse = self._spline(table_coordinate(safe))
        coefficients = (inverse @ self._slopes(safe, ratio)[..., np.newaxis])[..., 0]
        return beta, np.asarray(coefficients / coefficients[..., :1])

    @cached_property
    def _spline(self) -> CubicSpline:
        return spline(table_coordinate(self.half_angles), self.inverses)

    @cached_property
    def _load_spline(self) -> CubicSpline:
        return spline(table_coordinate(self.half_angles), self.inverses[:, 0])
