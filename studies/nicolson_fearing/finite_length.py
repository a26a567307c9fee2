"""Indenters and elements of finite length along the axis: how far from plane strain.

A line load of length L along the axis, read by a strip of the same length under it, is a sum of waves along the axis
too. For a flat layer the transfer functions depend on the length of the wave vector alone
(`bayestouch.body.layer_transfer`), so that with ``ξ² = ξ_x² + ξ_z²`` the mean over the strip of the response to a
uniform load is

    T_L(ξ_x) = (L/2π) ∫ T(ξ) [sin(ξ_z L/2)/(ξ_z L/2)]² dξ_z,

and ``T_L/T`` says what a mode of the annulus loses or gains: at low frequency rubber escapes along the axis, at high
frequency part of the load is not below the strip. The annulus is taken as a flat layer for this ratio alone.

Source: derived here from Parseval's theorem along the axis.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray
from bayestouch.body.layer_transfer import layer_surface_compliance, layer_transfer
from bayestouch.errors import InputError

SMALLEST_FREQUENCY = 1e-9  # rad/mm, for mode 0


def length_ratio_of_strain(
    modes: ArrayLike,
    length_mm: float,
    *,
    sensing_radius_mm: float,
    core_radius_mm: float,
    outer_radius_mm: float,
    poisson_ratio: float,
) -> FloatArray:
    """Radial strain of each mode under an indenter of finite length over that of an infinite one.

    Parameters
    ----------
    modes : (n_modes,) array_like
        Fourier modes k.
    length_mm : float
        Length L of the indenter and of the elements along the axis, mm; inf gives ones.
    sensing_radius_mm, core_radius_mm, outer_radius_mm, poisson_ratio : float
        ``r_s``, ``r_a``, ``r_b`` in mm; σ.

    Returns
    -------
    (n_modes,) array
    """

    def strain(frequency: FloatArray) -> FloatArray:
        return layer_transfer(
            frequency,
            thickness_mm=outer_radius_mm - core_radius_mm,
            poisson_ratio=poisson_ratio,
            depth_mm=outer_radius_mm - sensing_radius_mm,
            quantity="normal_strain",
        )

    return _ratio(strain, modes, length_mm, outer_radius_mm)


def length_ratio_of_compliance(
    modes: ArrayLike, length_mm: float, *, core_radius_mm: float, outer_radius_mm: float, poisson_ratio: float
) -> FloatArray:
    """Mean surface displacement along an indenter of finite length over that of an infinite one; (n_modes,)."""

    def displacement(frequency: FloatArray) -> FloatArray:
        return layer_surface_compliance(
            frequency, thickness_mm=outer_radius_mm - core_radius_mm, poisson_ratio=poisson_ratio
        )

    return _ratio(displacement, modes, length_mm, outer_radius_mm)


def _ratio(
    transfer: Callable[[FloatArray], FloatArray], modes: ArrayLike, length_mm: float, outer_radius_mm: float
) -> FloatArray:
    from scipy.integrate import trapezoid

    along = np.maximum(np.asarray(modes, dtype=float) / outer_radius_mm, SMALLEST_FREQUENCY)
    if not length_mm > 0:
        raise InputError(f"length along the axis must be above zero, got {length_mm:g} mm")
    if np.isinf(length_mm):
        return np.ones_like(along)
    # Fine where the square of the sine wave is large, then by ratios; the tail beyond holds 1e-4 of the load.
    lobes = 2 * np.pi / length_mm
    across = np.concatenate([np.linspace(0, 8 * lobes, 2001), np.geomspace(8 * lobes, 4000 * lobes, 1500)[1:]])
    weight = np.sinc(across * length_mm / (2 * np.pi)) ** 2 * length_mm / np.pi
    mean = trapezoid(transfer(np.hypot(along[:, None], across)) * weight, across, axis=1)
    return np.asarray(mean / trapezoid(weight, across) / transfer(along))
