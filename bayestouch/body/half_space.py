"""Half-space under a unit load with Hertz pressure: closed forms for a disc and for a strip.

The stress is a combination of two transforms: ``G`` of ``exp(-ξz)``, the harmonic function whose surface value is the
pressure, and ``S = G - z ∂G/∂z`` of ``(1 + ξz) exp(-ξz)``, the normal stress. ``G`` is ``P1 Q1`` in oblate
spheroidal coordinates for a disc and the real part of a complex square root for a strip.

Source: K. L. Johnson, Contact Mechanics (1985), chapters 2 to 4 (Flamant, Boussinesq, McEwen), and M. T.
Huber, Annalen der Physik 14 (1904) 153. The formulas are written so that no digits are lost as the width goes to zero.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray, FloatOrArray
from bayestouch.body.layer_transfer import Quantity, check_layer, refuse_first


def half_space_kernel_2d(
    rho_mm: ArrayLike,
    depth_mm: FloatOrArray,
    indenter_radius_mm: FloatOrArray = 0.0,
    *,
    poisson_ratio: FloatOrArray = 0.5,
    quantity: Quantity = "normal_stress",
) -> FloatArray:
    """Response of a half-space to a unit load (1 N) with Hertz pressure over a disc.

    Parameters
    ----------
    rho_mm : array_like
        Distance from the axis of the load, mm.
    depth_mm : float or array
        Depth below the surface, mm, positive. It and the next two may be arrays that broadcast with the distance.
    indenter_radius_mm : float or array
        Radius of the loaded disc, mm; 0 is Boussinesq's point load, ``3 z³/(2π (ρ²+z²)^(5/2))``.
    poisson_ratio : float or array
        σ; the normal stress does not depend on it.
    quantity : {"normal_stress", "mean_stress", "normal_strain"}
        As in `bayestouch.body.layer.layer_transfer`; the strain at μ = 1 MPa.

    Returns
    -------
    array of the shape of `rho_mm`
        Compression positive, MPa per N (1/mm²).

    Raises
    ------
    InputError
        If depth, load radius or Poisson's ratio are out of range.
    """
    z, a = _check(depth_mm, indenter_radius_mm, poisson_ratio)
    rho = np.asarray(rho_mm, dtype=float)
    base = rho**2 + z**2 - a**2
    root = np.hypot(base, 2 * a * z)
    # u from the sum or from the product of the two roots of u² - base u - a² z² = 0, whichever loses no
    # digits.
    u = np.where(base >= 0, 0.5 * (root + base), 2 * a**2 * z**2 / (root + np.abs(base)))
    stress = 1.5 / np.pi * z**3 / (np.sqrt(u) * (u**2 + a**2 * z**2))
    if quantity == "normal_stress":
        return np.asarray(stress)
    ratio = np.sqrt(a**2 / u)
    safe = np.where(ratio < 0.02, 1.0, ratio)
    # (1 - atan(y)/y)/y²; its series is used for small y (next term y^6/9, 1e-11).
    flattening = np.where(ratio < 0.02, 1 / 3 - ratio**2 / 5 + ratio**4 / 7, (1 - np.arctan(safe) / safe) / safe**2)
    return _quantity(stress, 1.5 / np.pi * z * u**-1.5 * flattening, poisson_ratio, quantity)


def half_space_kernel_1d(
    x_mm: ArrayLike,
    depth_mm: FloatOrArray,
    indenter_radius_mm: FloatOrArray = 0.0,
    *,
    poisson_ratio: FloatOrArray = 0.5,
    quantity: Quantity = "normal_stress",
) -> FloatArray:
    """Response of a half-space to a unit line load (1 N/mm) with Hertz pressure over a strip, plane strain.

    As `half_space_kernel_2d`, with the half-width of the strip as `indenter_radius_mm`; 0 is Flamant's line
    load ``2 z³/(π (x²+z²)²)``. MPa per N/mm, i.e. 1/mm.
    """
    z, a = _check(depth_mm, indenter_radius_mm, poisson_ratio)
    x = np.asarray(x_mm, dtype=float)
    base = a**2 - x**2 + z**2
    root = np.hypot(base, 2 * x * z)
    # m² of Johnson; for base < 0 from m n = |x| z, to avoid cancellation far from the load.
    m_squared = np.where(base >= 0, 0.5 * (root + base), 2 * x**2 * z**2 / (root + np.abs(base)))
    m = np.sqrt(m_squared)
    stress = 2 / np.pi * m * m_squared / ((m_squared + x**2) * root)
    harmonic = 2 / np.pi * m_squared / ((m_squared + x**2) * (m + z))
    return _quantity(stress, harmonic, poisson_ratio, quantity)


def _quantity(stress: FloatArray, harmonic: FloatArray, poisson_ratio: FloatOrArray, quantity: Quantity) -> FloatArray:
    if quantity == "normal_stress":
        return np.asarray(stress)
    if quantity == "mean_stress":
        return np.asarray(2 * (1 + poisson_ratio) / 3 * harmonic)
    return np.asarray(0.5 * stress - poisson_ratio * harmonic)


def _check(
    depth_mm: FloatOrArray, load_radius_mm: FloatOrArray, poisson_ratio: FloatOrArray
) -> tuple[FloatOrArray, FloatOrArray]:
    fine = np.greater_equal(load_radius_mm, 0) & np.isfinite(load_radius_mm)
    refuse_first("radius of the loaded disc must be zero or larger, got {:g} mm", fine, load_radius_mm)
    return check_layer(np.inf, poisson_ratio, depth_mm), load_radius_mm
