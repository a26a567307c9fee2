"""Frequency response of the annulus to a line load, as in the paper's Figure 2, and its cut-offs."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray
from bayestouch.body.finger import solve_body
from bayestouch.errors import InputError

#: Level of a cut-off where no other is given, dB: that of the paper, one in a hundred.
CUT_OFF_DB = -40.0


def frequency_response_db(
    modes: ArrayLike,
    *,
    core_radius_mm: float,
    outer_radius_mm: float,
    poisson_ratio: float,
    sensing_radius_mm: float | None = None,
) -> FloatArray:
    """Response to a line load, in decibels relative to its maximum.

    Parameters
    ----------
    modes : (n_modes,) array_like
        Fourier modes ``k``; fractions are allowed from 2 (cycles per radian are ``k/2π``).
    core_radius_mm, outer_radius_mm : float
        ``r_a`` and ``r_b``, mm.
    poisson_ratio : float
        σ.
    sensing_radius_mm : float, optional
        Radius at which radial strain is sensed, mm. By default the response is the normal displacement of the
        surface.

    Returns
    -------
    (n_modes,) array
        ``20 log10(|response| / max_k |response|)``. The maximum is taken over integer modes.
    """
    k = np.atleast_1d(np.asarray(modes, dtype=float))

    def response(wanted: FloatArray) -> FloatArray:
        solution = solve_body(
            wanted,
            core_radius_mm=core_radius_mm,
            outer_radius_mm=outer_radius_mm,
            poisson_ratio=poisson_ratio,
        )
        if sensing_radius_mm is None:
            return np.abs(solution.surface_displacement_mm)
        return np.abs(solution.radial_strain(sensing_radius_mm))

    largest = response(_modes_with_largest(core_radius_mm, outer_radius_mm)).max()
    if largest < 1e-12:
        raise InputError("there is no strain to sense at the core of an incompressible rubber")
    with np.errstate(divide="ignore"):  # at high k the strain underflows and the level is minus infinity
        return np.asarray(20 * np.log10(response(k) / largest))


def _modes_with_largest(core_radius_mm: float, outer_radius_mm: float) -> FloatArray:
    """Integer modes from 0, of which one has the largest response."""
    # The response is largest at a wavelength of about the layer thickness: k of order r_b/(r_b - r_a).
    return np.arange(20 + int(20 * outer_radius_mm / (outer_radius_mm - core_radius_mm)), dtype=float)


def cut_off(
    *,
    core_radius_mm: float,
    outer_radius_mm: float,
    poisson_ratio: float,
    sensing_radius_mm: float | None = None,
    level_db: float = CUT_OFF_DB,
) -> float:
    """Spatial frequency in cycles per radian (``k/2π``) above which the response stays below `level_db`.

    Parameters as in `frequency_response_db`.

    Raises
    ------
    InputError
        If the level is not below zero, or the response is above it up to mode 100,000 (strain at the surface).
    """
    from scipy.optimize import brentq

    if not level_db < 0:
        raise InputError(f"cut-off level must be below 0 dB, got {level_db:g} dB")

    def level(modes: ArrayLike) -> FloatArray:
        return frequency_response_db(
            modes,
            core_radius_mm=core_radius_mm,
            outer_radius_mm=outer_radius_mm,
            poisson_ratio=poisson_ratio,
            sensing_radius_mm=sensing_radius_mm,
        )

    def excess(k: float) -> float:
        return max(float(level([k])[0]), -1e4) - level_db

    # Under a thin layer of incompressible rubber the response is below the level at low modes too.
    modes = _modes_with_largest(core_radius_mm, outer_radius_mm)
    least, high = max(2.0, float(modes[level(modes).argmax()])), 4.0
    while high < least or excess(high) > 0 or excess(2 * high) > 0:
        high *= 2
        if high > 1e5:
            raise InputError(f"the response does not fall to {level_db:g} dB by mode 100,000")
    low = high
    while low > least and excess(low) <= 0:
        low = max(least, low / 1.1)
    if excess(low) <= 0:
        raise InputError(f"the response is below {level_db:g} dB from mode 2 on")
    return float(brentq(excess, low, high, xtol=1e-9)) / (2 * np.pi)


def sensing_radius_for_cut_off(
    cycles_per_radian: float,
    *,
    core_radius_mm: float,
    outer_radius_mm: float,
    poisson_ratio: float,
) -> float:
    """Sensing radius in mm at which radial strain has a given cut-off (cycles per radian, see `cut_off`).

    If there are several, the result is the one closest to the surface. For the paper's 4.5 and 25 cycles/radian, with
    α = 0.70 and 0.90, the result is 0.056 and 0.054 r_b above the core (σ = 0.46).

    Raises
    ------
    InputError
        If no radius in the rubber has this cut-off; the message gives the possible range.
    """
    from scipy.optimize import brentq

    def miss(radius: float) -> float:
        found = cut_off(
            core_radius_mm=core_radius_mm,
            outer_radius_mm=outer_radius_mm,
            poisson_ratio=poisson_ratio,
            sensing_radius_mm=radius,
        )
        return found - cycles_per_radian

    # The cut-off falls with depth, but rises again near the core if the rubber is almost incompressible.
    fractions = np.linspace(0.98, 0.001, 50)
    radii = core_radius_mm + (outer_radius_mm - core_radius_mm) * fractions
    excess = [miss(radius) for radius in radii]
    below = np.flatnonzero(np.array(excess) < 0)
    if below.size == 0 or below[0] == 0:
        raise InputError(
            f"no sensing radius has a cut-off of {cycles_per_radian:g} cycles/radian at {CUT_OFF_DB:g} dB; from core "
            f"to surface it goes from {min(excess) + cycles_per_radian:.3g} to {excess[0] + cycles_per_radian:.3g}"
        )
    return float(brentq(miss, radii[below[0]], radii[below[0] - 1], xtol=1e-9))
