"""Hertz contact of a cylinder with the finger as a half-plane: appendix A of Nicolson and Fearing (1995).

Equation (8) is printed with ``(1/r_b + 1/r_c)`` under the root where its inverse, the composite radius R,
belongs:

    θ_w = (2/r_b) √(2 P (1-σ) R/(π μ)).
    (8, corrected)

As printed, the argument of the root has no consistent unit, and the integral of the pressure (7) is not P.
Equations (7) and (9) are correct as printed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import j1

from bayestouch.array_types import FloatArray
from bayestouch.contact.model import checked_kappa, checked_poisson_ratio
from bayestouch.errors import InputError


def composite_radius(indenter_radius_mm: ArrayLike, outer_radius_mm: float) -> FloatArray:
    """Composite radius R, ``1/R = 1/r_b + 1/r_c``.

    Parameters
    ----------
    indenter_radius_mm : array_like
        ``r_c`` in mm: 0 is a knife edge, inf a flat, below ``-r_b`` a hollow with a larger radius than the finger.
    outer_radius_mm : float
        ``r_b`` in mm.

    Returns
    -------
    array, mm, shape of `indenter_radius_mm`

    Raises
    ------
    InputError
        If a radius is NaN, or a hollow is too narrow for the finger to touch its bottom.
    """
    radius = np.asarray(indenter_radius_mm, dtype=float)
    if not np.all((radius >= 0) | (radius < -outer_radius_mm)):
        raise InputError("indenter radius must not be negative (except for a hollow wider than the finger)")
    sharp = radius == 0
    inverse = 1 / outer_radius_mm + 1 / np.where(sharp, 1.0, radius)
    # The inverse of an inverse is not always the same number: a flat would get a radius of curvature of 1e16 mm.
    return np.asarray(np.where(sharp, 0.0, np.where(np.isinf(radius), outer_radius_mm, 1 / inverse)))


def indenter_radius(composite_radius_mm: ArrayLike, outer_radius_mm: float) -> FloatArray:
    """Indenter radius ``r_c = 1/(1/R - 1/r_b)``, the inverse of `composite_radius`.

    ``R = r_b`` is a flat (inf); R above ``r_b`` is a hollow (negative). Shape and unit (mm) as given.

    Raises
    ------
    InputError
        If a composite radius is negative or NaN.
    """
    radius = np.asarray(composite_radius_mm, dtype=float)
    if not np.all(radius >= 0):
        raise InputError("composite radius must not be negative")
    with np.errstate(divide="ignore"):  # knife edge and flat divide by zero; the result is correct
        return np.asarray(1 / (1 / radius - 1 / outer_radius_mm))


def half_width(kappa: ArrayLike, poisson_ratio: ArrayLike) -> FloatArray:
    """Half-width ``a = √(2 κ (1-σ)/π)`` in mm of a Hertz contact, ``κ = P R/μ`` in mm²; broadcasts."""
    return np.asarray(np.sqrt(2 * checked_kappa(kappa) * (1 - np.asarray(poisson_ratio, dtype=float)) / np.pi))


def elliptic_spectrum(half_angle: ArrayLike, modes: ArrayLike) -> FloatArray:
    """Spectrum ``q_k = 2 J_1(kβ)/(kβ)`` of an elliptic pressure on ``|θ - θ_c| <= β``: equation (9) over ``2 p_0``.

    Parameters
    ----------
    half_angle : array_like
        β in rad; zero is a line load (all ``q_k = 1``).
    modes : (n_modes,) array_like
        Fourier modes k.

    Returns
    -------
    array of shape ``half_angle.shape + (n_modes,)``
    """
    z = np.asarray(half_angle, dtype=float)[..., np.newaxis] * np.asarray(modes, dtype=float)
    safe = np.where(z < 1e-8, 1.0, z)
    return np.asarray(np.where(z < 1e-8, 1.0, 2 * j1(safe) / safe))


def pressure(
    theta: ArrayLike,
    *,
    arc_rad: float,
    indenter_radius_mm: float,
    outer_radius_mm: float,
    shear_modulus_MPa: float,
    poisson_ratio: float,
) -> FloatArray:
    """Pressure in MPa, compression positive, at angle θ (rad) from the contact's centre: equation (7).

    `arc_rad` is the arc of contact θ_w, the full width 2 a over r_b (`half_width`); outside it the pressure is zero.

    Raises
    ------
    InputError
        If the indenter is a knife edge (a line load has no finite pressure), or for the reasons of `composite_radius`.
    """
    inside = np.maximum((arc_rad / 2) ** 2 - np.asarray(theta, dtype=float) ** 2, 0)
    curvature = _relative_curvature(indenter_radius_mm, outer_radius_mm)
    return np.asarray(shear_modulus_MPa / (1 - poisson_ratio) * curvature * np.sqrt(inside))


def _relative_curvature(indenter_radius_mm: float, outer_radius_mm: float) -> float:
    """``r_b/R = 1 + r_b/r_c`` of an indenter that is not a knife edge."""
    radius = float(composite_radius(indenter_radius_mm, outer_radius_mm))
    if radius == 0:
        raise InputError("a knife edge has no finite pressure; the indenter radius must not be zero")
    return outer_radius_mm / radius


@dataclass(frozen=True)
class HertzContact:
    """Hertz contact: the layer taken as a half-plane. A `ContactModel`.

    Attributes
    ----------
    outer_radius_mm : float
        Surface radius ``r_b``, mm.
    poisson_ratio : float
        Poisson's ratio σ.
    """

    outer_radius_mm: float
    poisson_ratio: float
    name: str = "hertz"

    def __post_init__(self) -> None:
        if not 0 < self.outer_radius_mm < np.inf:
            raise InputError(f"outer radius must be above zero, got {self.outer_radius_mm:g} mm")
        checked_poisson_ratio(self.poisson_ratio)

    def half_width(self, kappa: ArrayLike) -> FloatArray:
        """Half-width in mm, shape of `kappa` (mm²)."""
        return half_width(kappa, self.poisson_ratio)

    def spectrum(self, kappa: ArrayLike, modes: ArrayLike) -> FloatArray:
        """Spectrum ``q_k``, shape ``kappa.shape + (n_modes,)``."""
        return elliptic_spectrum(self.half_width(kappa) / self.outer_radius_mm, modes)
