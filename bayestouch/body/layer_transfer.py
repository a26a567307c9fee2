"""Transfer functions of a bonded flat layer: stress, strain and displacement per unit surface pressure.

A layer ``0 <= z <= h`` (depth z from the free surface) is bonded to a rigid base at ``z = h`` and pressed by
a normal pressure without shear. For one spatial frequency ξ let ``s = ξ z``, ``H = ξ h``, ``D = d/ds`` and
the Airy stress function be ``f(s) cos(ξx)/ξ²``. Per unit surface pressure

    σ_zz = -f,  σ_xx = D²f,  σ_xz = Df (sin ξx)
    2μξ u_x = (1-σ) D²f + σ f  (sin ξx),   2μξ u_z = (1-σ) D³f - (2-σ) Df

``f(0) = 1, Df(0) = 0`` and ``u(H) = 0`` give

    f = (1 + s) e^-s + A s sinh s + B (s cosh s - sinh s),

the half-space plus the reflection at the base. A pressure that varies in the plane is a sum of such waves in
all directions; each is in plane strain along its own wave vector, so that **the transfer functions of a line
of elements (Fourier) and of elements in the plane (Hankel) are the same function of ξ**.

Compression is positive throughout. Derived here; the half-space part is in I. N. Sneddon, Fourier Transforms
(1951), chapters 9 and 10.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import j1

from bayestouch.array_types import BoolArray, FloatArray, FloatOrArray
from bayestouch.errors import InputError

Quantity = Literal["normal_stress", "mean_stress", "normal_strain"]


def layer_transfer(
    frequency: ArrayLike,
    *,
    thickness_mm: float,
    poisson_ratio: float,
    depth_mm: float | None = None,
    quantity: Quantity = "normal_stress",
) -> FloatArray:
    """Stress or strain at a depth per unit surface pressure ``cos ξx`` (or ``J0(ξρ)``).

    Parameters
    ----------
    frequency : array_like
        Spatial frequency ξ in rad/mm, not negative.
    thickness_mm : float
        Layer thickness h, mm; ``inf`` is the half-space, which needs a depth.
    poisson_ratio : float
        σ, above -1 and at most 0.5.
    depth_mm : float, optional
        Depth below the free surface, mm; the bonded base by default.
    quantity : {"normal_stress", "mean_stress", "normal_strain"}
        ``-σ_zz``; ``-(σ_xx + σ_yy + σ_zz)/3``, which a pressure sensor embedded in rubber measures; or ``-e_zz``
        at μ = 1 MPa. At the base ``e_xx = e_yy = 0``, so that the three are proportional there: mean stress
        is ``(1+σ)/(3(1-σ))`` and strain ``(1-2σ)/(2(1-σ))`` of the normal stress. Above the base they differ.

    Returns
    -------
    array of the shape of `frequency`
        Compression positive; the normal stress is 1 at ξ = 0 (load balance).

    Raises
    ------
    InputError
        If thickness, depth or Poisson's ratio are out of range.
    """
    depth = check_layer(thickness_mm, poisson_ratio, depth_mm)
    xi = np.asarray(frequency, dtype=float)
    s = xi * depth
    decay = np.exp(-s)
    f, curvature = reflected_stress(xi, thickness_mm, depth, poisson_ratio)
    return combine(f + (1 + s) * decay, curvature + (s - 1) * decay, poisson_ratio, quantity)


def layer_surface_compliance(frequency: ArrayLike, *, thickness_mm: float, poisson_ratio: float) -> FloatArray:
    """Displacement of the surface into the layer, mm, per MPa of pressure ``cos ξx`` (or ``J0(ξρ)``) at μ = 1 MPa.

    ``(1-σ)/ξ [(3-4σ) sinh H cosh H - H] / [(3-4σ) cosh² H + (1-2σ)² + H²]``, ``H = ξ h > 0``; the fraction
    tends to 1 on a half-space. At ξ = 0 it is ``h (1-2σ)/(2(1-σ))``, one-dimensional compression (infinite
    without a base).
    """
    xi = np.asarray(frequency, dtype=float)
    check_layer(thickness_mm, poisson_ratio, 0.5 * min(thickness_mm, 1.0))
    kappa, n = 3 - 4 * poisson_ratio, 1 - 2 * poisson_ratio
    if np.isinf(thickness_mm):
        return np.asarray((1 - poisson_ratio) / xi)
    tiny = xi * thickness_mm < 1e-8  # the fraction loses all digits; the limit is exact to 1e-16
    h = np.where(tiny, 1.0, np.minimum(xi * thickness_mm, 300.0))  # e^600 does not overflow
    fraction = (kappa * np.sinh(h) * np.cosh(h) - h) / (kappa * np.cosh(h) ** 2 + n**2 + h**2)
    wave = (1 - poisson_ratio) * fraction / np.where(tiny, 1.0, xi)
    return np.asarray(np.where(tiny, thickness_mm * n / (2 * (1 - poisson_ratio)), wave))


def combine(f: FloatArray, curvature: FloatArray, poisson_ratio: FloatOrArray, quantity: Quantity) -> FloatArray:
    """Quantity that an element measures, from the stress function ``f`` and its second derivative ``D²f``."""
    if quantity == "normal_stress":
        return np.asarray(f)
    if quantity == "mean_stress":
        return np.asarray((1 + poisson_ratio) / 3 * (f - curvature))
    return np.asarray(((1 - poisson_ratio) * f + poisson_ratio * curvature) / 2)


def reflected_stress(
    frequency: FloatArray, thickness_mm: float, depth_mm: FloatOrArray, poisson_ratio: FloatOrArray
) -> tuple[FloatArray, FloatArray]:
    """Contribution of the base to ``f`` and ``D²f``; zero without a base."""
    if np.isinf(thickness_mm):
        return np.zeros_like(frequency), np.zeros_like(frequency)
    s, base = frequency * depth_mm, frequency * thickness_mm
    m, n = 2 * (1 - poisson_ratio), 1 - 2 * poisson_ratio
    # Hyperbolic functions divided by e^H at the base and by e^s at depth, so that no exponent below is positive.
    cosh_base, sinh_base = _scaled_hyperbolic(base)
    cosh_s, sinh_s = _scaled_hyperbolic(s)
    determinant = (m * cosh_base) ** 2 - (n * sinh_base) ** 2 + (base * np.exp(-base)) ** 2
    # Minus the displacement of the half-space at the base, along and across, divided by e^-H.
    along, across = n - base, -(m + base)
    a = along * (m * cosh_base - base * sinh_base) - across * (base * cosh_base + n * sinh_base)
    b = across * (m * cosh_base + base * sinh_base) - along * (n * sinh_base - base * cosh_base)
    scale = np.exp(s - 2 * base) / determinant
    return (
        scale * (a * s * sinh_s + b * (s * cosh_s - sinh_s)),
        scale * (a * (2 * cosh_s + s * sinh_s) + b * (sinh_s + s * cosh_s)),
    )


def _scaled_hyperbolic(x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """cosh(x) e^-x and sinh(x) e^-x."""
    return 0.5 * (1 + np.exp(-2 * x)), -0.5 * np.expm1(-2 * x)


def hertz_spectrum(argument: ArrayLike, dimensions: int) -> FloatArray:
    """Fourier (1) or Hankel (2 dimensions) transform of a unit Hertz pressure, at ξ times its half-width.

    ``2 J1(x)/x`` for the semi-ellipse of a line contact and ``3 (sin x - x cos x)/x³`` for the ellipsoid.
    """
    x = np.asarray(argument, dtype=float)
    if dimensions == 1:
        safe = np.where(x < 1e-8, 1.0, x)  # it is 1 - O(x²)
        return np.where(x < 1e-8, 1.0, 2 * j1(safe) / safe)
    # The closed form loses its digits at small x, where the series to x⁸ is exact to rounding.
    small, square = x < 0.1, x**2
    safe = np.where(small, 1.0, x)
    series = 1 - square / 10 * (1 - square / 28 * (1 - square / 54 * (1 - square / 88)))
    return np.asarray(np.where(small, series, 3 * (np.sin(safe) / safe - np.cos(safe)) / safe**2))


def check_layer(thickness_mm: FloatOrArray, poisson_ratio: FloatOrArray, depth_mm: FloatOrArray | None) -> FloatOrArray:
    """Return the depth (by default that of the base) after a check of all three values; raises `InputError`.

    Each is a number, or an array (n,) with the values of n layers.
    """
    refuse_first("layer thickness must be above zero, got {:g} mm", np.greater(thickness_mm, 0), thickness_mm)
    fine = np.greater(poisson_ratio, -1) & np.less_equal(poisson_ratio, 0.5)
    refuse_first("Poisson's ratio must be above -1 and at most 0.5, got {:g}", fine, poisson_ratio)
    depth = thickness_mm if depth_mm is None else depth_mm
    # The tolerance of 1e-9 accepts a depth that exceeds the thickness by a rounding error.
    fine = np.greater(depth, 0) & np.less_equal(depth, np.multiply(thickness_mm, 1 + 1e-9)) & np.isfinite(depth)
    refuse_first("depth must lie in the layer, above 0 and up to {:g} mm; got {:g} mm", fine, thickness_mm, depth)
    return np.minimum(depth, thickness_mm)


def refuse_first(message: str, fine: BoolArray | np.bool_, *values: FloatOrArray) -> None:
    """Raise `InputError` if not all are fine, with the values of the first that is not in the message."""
    if not fine.all():
        first = np.argmin(np.atleast_1d(fine))
        raise InputError(
            message.format(*(np.broadcast_to(value, np.atleast_1d(fine).shape)[first] for value in values))
        )
