"""Slope of a bonded layer under contact pressures: the kernel of the S map, summed without truncation.

A pressure with normalised spectrum ``q_k`` and load P on the bonded annulus gives the surface slope

    du_r/ds = P/(π r_b² μ) Σ k U_k q_k sin kθ,                       s = r_b θ,

with ``U_k = u_r(r_b)`` under ``τ_rr = cos kθ`` at μ = 1 MPa. The series converges slowly, because the pressure
ends in square roots and ``k U_k → A + B/k + O(1/k²)`` with

    A = (1-σ) r_b,    B = -(1-2σ) r_b/2                              (the values of the elastic disc).

So A and B are summed in closed form, ``Σ sin kx = ½ cot(x/2)`` and ``Σ sin(kx)/k = (π sign x - x)/2``, and
only the remainder, which decreases fast, is summed mode by mode. The half-plane is the part ``1/x`` of ``½
cot(x/2)``; the rest is smooth.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import itj0y0

from bayestouch.array_types import FloatArray
from bayestouch.body.finger import surface_displacement_response
from bayestouch.contact.chebyshev import pressure_shapes, shape_transforms

# Largest size (numbers) of a table that is cached for use with many bodies.
LARGEST_KEPT = 2_000_000


@dataclass(frozen=True, eq=False)
class SurfaceCompliance:
    """Slope compliance of the bonded annulus at μ = 1 MPa, split for contact problems.

    Attributes
    ----------
    outer_radius_mm : float
        Surface radius ``r_b``, mm.
    half_plane_mm, curvature_mm : float
        A and B of the module description, mm.
    remainder_mm : (n_modes,) array
        ``k U_k - A - B/k`` for k = 1 … n_modes, mm.
    """

    outer_radius_mm: float
    half_plane_mm: float
    curvature_mm: float
    remainder_mm: FloatArray

    @classmethod
    def for_body(
        cls, core_radius_mm: float, outer_radius_mm: float, poisson_ratio: float, modes: int | None = None
    ) -> SurfaceCompliance:
        """Compliance of the annulus ``core_radius_mm`` to ``outer_radius_mm`` (mm) with Poisson's ratio σ.

        `modes` is the number of modes summed directly: by default at least 400, and more for thin layers. The
        bond changes mode k by ``(r_a/r_b)^(2k)``, which is e^-40 at the last one.
        """
        if modes is None:
            modes = max(400, int(np.ceil(-20 / np.log(core_radius_mm / outer_radius_mm))))
        k = np.arange(1, modes + 1)
        displacement = surface_displacement_response(
            k, core_radius_mm=core_radius_mm, outer_radius_mm=outer_radius_mm, poisson_ratio=poisson_ratio
        )
        half_plane = (1 - poisson_ratio) * outer_radius_mm
        curvature = -(1 - 2 * poisson_ratio) * outer_radius_mm / 2
        return cls(outer_radius_mm, half_plane, curvature, k * displacement - half_plane - curvature / k)

    def scaled(self, ratio: ArrayLike) -> SurfaceCompliance:
        """Return the compliance with the displacement of each mode multiplied by a ratio (n_modes,) that tends to 1."""
        k = np.arange(1, self.remainder_mm.size + 1)
        closed = self.half_plane_mm + self.curvature_mm / k
        return replace(self, remainder_mm=np.asarray(ratio) * (self.remainder_mm + closed) - closed)

    def slope(self, half_angle: ArrayLike, t: ArrayLike, terms: int) -> FloatArray:
        """Slope under each pressure shape, in units of ``P/(π r_b² μ)`` per unit coefficient.

        Parameters
        ----------
        half_angle : (n,) array_like
            Half-angle β of the contact, rad, above zero.
        t : (n_t,) array_like
            Positions in the contact, θ/β, -1 to 1.
        terms : int
            Number of pressure shapes (`pressure_shapes`).

        Returns
        -------
        (n, n_t, terms) array, mm
        """
        beta, place = (np.ascontiguousarray(values, dtype=float) for values in (half_angle, t))
        modes = self.remainder_mm.size
        # Cached, because a fit solves many bodies on the same grid, and these parts are the same for all.
        small = beta.size * max(place.size, terms) * modes < LARGEST_KEPT
        parts = _kept_slope_parts if small else _slope_parts
        half_plane, curvature, waves, shapes = parts(beta.tobytes(), place.tobytes(), terms, modes)
        closed_form = self.half_plane_mm * half_plane + self.curvature_mm * curvature
        return np.asarray(closed_form + waves @ (self.remainder_mm[:, np.newaxis] * shapes))

    def wedge_slope(self, half_angle: ArrayLike, t: ArrayLike) -> FloatArray:
        """Slope under the wedge pressure ``arccosh(1/|t|)/π`` (load 1), without its half-plane part.

        That part is ``A (π/2β) sign t``. Parameters and unit as in `slope`; shape (n, n_t).
        """
        beta = np.asarray(half_angle, dtype=float)[:, np.newaxis, np.newaxis]
        place = np.asarray(t, dtype=float)
        # The wedge pressure is a sum of flat punches of all widths u < 1, each exact by a Gauss-Chebyshev
        # rule.
        width, width_weight = np.polynomial.legendre.leggauss(16)
        places = ((width[:, np.newaxis] + 1) / 2 * np.cos((np.arange(24) + 0.5) * np.pi / 24)).ravel()
        weights = np.repeat(width_weight / 2 / 24, 24)
        round_part = _cotangent_remainder(beta * (place[:, np.newaxis] - places)) @ weights
        inside = np.where(place == 0, 1.0, np.abs(place))
        primitive = place * np.arccosh(1 / inside) + np.arcsin(place)
        step = primitive - beta[..., 0] * place / 2
        modes = np.arange(1, self.remainder_mm.size + 1)
        spectrum = wedge_transform(modes * beta[..., 0])
        waves = np.sin(modes * (beta[..., 0] * place)[..., np.newaxis])
        rest = (waves @ (self.remainder_mm * spectrum)[..., np.newaxis])[..., 0]
        return np.asarray(self.half_plane_mm * round_part + self.curvature_mm * step + rest)


def wedge_transform(z: ArrayLike) -> FloatArray:
    """Fourier transform ``∫_0^1 J_0(zb) db`` of the wedge pressure ``arccosh(1/|t|)/π``; 1 at ``z = 0``."""
    argument = np.asarray(z, dtype=float)
    safe = np.where(argument < 1e-8, 1.0, argument)
    return np.asarray(np.where(argument < 1e-8, 1.0, itj0y0(safe)[0] / safe))


def _cotangent_remainder(x: FloatArray) -> FloatArray:
    """``½ cot(x/2) - 1/x``, analytic at zero."""
    safe = np.where(np.abs(x) < 1e-2, 1.0, x)
    return np.asarray(np.where(np.abs(x) < 1e-2, -x / 12 - x**3 / 720, 0.5 / np.tan(safe / 2) - 1 / safe))


def _slope_parts(
    half_angle: bytes, t: bytes, terms: int, n_modes: int
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Parts of the slope that do not depend on the body: the sums multiplied by A and by B, waves and mode shapes."""
    beta = np.frombuffer(half_angle)[:, np.newaxis, np.newaxis]
    place = np.frombuffer(t)
    phi = np.arccos(np.clip(place, -1, 1))[:, np.newaxis]
    order = 2 * np.arange(terms) + 1
    line = 2 / beta * np.cos(order * phi)
    # Gauss-Chebyshev rule of the second kind: the cotangent minus 1/x is analytic up to |x| = 2π.
    parts = terms + 24
    nodes = np.arange(1, parts) * np.pi / parts
    weights = pressure_shapes(np.cos(nodes), terms) * (np.sin(nodes) * np.pi / parts)[:, np.newaxis]
    round_part = _cotangent_remainder(beta * (place[:, np.newaxis] - np.cos(nodes))) @ weights
    # 2 ∫_0^t √(1-t²) U_2m, and the -x/2 of (π sign x - x)/2, to which only the load (shape 0)
    # contributes.
    even = 2 * np.arange(1, terms)
    primitive = np.sin((order + 1) * phi) / (order + 1)
    primitive[:, 1:] -= np.sin(even * phi) / even
    primitive[:, :1] += np.pi / 2 - phi
    step = np.broadcast_to(primitive, line.shape).copy()
    step[..., 0] -= beta[..., 0] * place / 2
    modes = np.arange(1, n_modes + 1)
    waves = np.sin(modes * (beta * place[:, np.newaxis]))
    return line + round_part, step, waves, shape_transforms(modes * beta[..., 0], terms)


_kept_slope_parts = lru_cache(maxsize=2)(_slope_parts)
