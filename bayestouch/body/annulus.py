"""Bonded elastic annulus: strain inside and displacement of the surface for each Fourier mode.

A rubber annulus ``r_a <= r <= r_b`` in plane strain is bonded to a rigid core (``u = 0`` at ``r_a``).
A traction ``τ_rr = cos kθ`` (or ``τ_rθ = sin kθ``) acts on the outer surface, tension positive. With the
Kolosov-Muskhelishvili potentials of mode ``k >= 2``, ``ρ = r/r_b``, ``α = r_a/r_b``, ``κ = 3 - 4σ`` and
stresses in units of the traction,

    φ = a z^(k+1) + b α^k z^(1-k),    ψ = c z^(k-1) + d α^k z^(-k-1),

    2μ u_r/r_b = [(κ-k-1) a ρ - c/ρ] ρ^k + [(κ+k-1) b ρ - d/ρ] (α/ρ)^k        (times cos kθ)
    2μ u_θ/r_b = [(κ+k+1) a ρ + c/ρ] ρ^k + [(k-1-κ) b ρ - d/ρ] (α/ρ)^k        (times sin kθ)

Both powers are at most one inside the annulus, so that nothing overflows at any ``k``. The bond gives ``b`` and
``d`` in terms of ``a`` and ``c``, and the two tractions give a 2 x 2 system, solved in closed form in
`bayestouch.body.annulus_modes`. Mode 0 has two constants; mode 1 contains the net force and needs
``φ = β ln z, ψ = -κ β ln z``, the only logarithm whose displacement is single-valued.

Source: N. I. Muskhelishvili, Some Basic Problems of the Mathematical Theory of Elasticity, §32 and §59; the
same solution as Nicolson and Fearing (IROS 1993, pages 178-185) in Michell functions.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray
from bayestouch.body.annulus_modes import higher_modes, mode_one, mode_zero
from bayestouch.errors import InputError

Traction = Literal["normal", "tangential"]


@dataclass(frozen=True)
class AnnulusModes:
    """Solved modes of a bonded annulus under unit surface traction at μ = 1 MPa.

    Attributes
    ----------
    modes : (n_modes,) array
        Fourier modes ``k``.
    core_radius_mm, outer_radius_mm : float
        ``r_a`` and ``r_b`` in mm.
    poisson_ratio : (...) array
        σ.
    growing, decaying : pair of (..., n_modes) arrays
        Radial strain is ``(growing[0] + growing[1]/ρ²) ρ^k + (decaying[0] + decaying[1]/ρ²) (α/ρ)^k``.
    surface_displacement_mm : (..., n_modes) array
        ``u_r(r_b)`` in mm, positive away from the axis, times cos kθ.
    surface_slip_mm : (..., n_modes) array
        ``u_θ(r_b)`` in mm, towards larger θ, times sin kθ.
    """

    modes: FloatArray
    core_radius_mm: float
    outer_radius_mm: float
    poisson_ratio: FloatArray
    growing: tuple[FloatArray, FloatArray]
    decaying: tuple[FloatArray, FloatArray]
    surface_displacement_mm: FloatArray
    surface_slip_mm: FloatArray

    def radial_strain(self, radius_mm: ArrayLike) -> FloatArray:
        """Radial strain e_rr of each mode at some radii.

        Parameters
        ----------
        radius_mm : array_like
            Radii in mm between core and surface; they broadcast with `poisson_ratio`, the batch.

        Returns
        -------
        array of shape ``broadcast(batch, radius_mm.shape) + (n_modes,)``
            Amplitude of ``e_rr`` (extension positive) as a multiple of cos kθ.

        Raises
        ------
        InputError
            If a radius is not between core and outer radius.
        """
        radius = np.asarray(radius_mm, dtype=float)
        # The tolerance of 1e-9 accepts a radius that differs from r_a or r_b by a rounding error.
        inside = (radius >= self.core_radius_mm * (1 - 1e-9)) & (radius <= self.outer_radius_mm * (1 + 1e-9))
        if not np.all(inside):
            bad = radius[~inside].flat[0]
            raise InputError(
                f"sensing radius must lie in the rubber, from {self.core_radius_mm:g} "
                f"to {self.outer_radius_mm:g} mm; got {bad:g} mm"
            )
        rho = (radius / self.outer_radius_mm)[..., np.newaxis]
        inverse_square = rho**-2
        growth = np.exp(self.modes * np.log(rho))
        decay = np.exp(self.modes * np.log(self.core_radius_mm / self.outer_radius_mm / rho))
        return np.asarray(
            (self.growing[0] + self.growing[1] * inverse_square) * growth
            + (self.decaying[0] + self.decaying[1] * inverse_square) * decay
        )


def solve_annulus(
    modes: ArrayLike,
    *,
    core_radius_mm: float,
    outer_radius_mm: float,
    poisson_ratio: ArrayLike,
    traction: Traction = "normal",
) -> AnnulusModes:
    """Return the solution of the bonded annulus for a set of Fourier modes (μ = 1 MPa, unit traction).

    Parameters
    ----------
    modes : (n_modes,) array_like of int
        Fourier modes, zero or larger, in any order.
    core_radius_mm, outer_radius_mm : float
        Radius of the rigid core ``r_a`` and of the surface ``r_b``, mm.
    poisson_ratio : array_like
        Poisson's ratio σ, above -1 and at most 0.5. Its shape gives the first axes of the results.
    traction : {"normal", "tangential"}
        ``τ_rr(r_b) = cos kθ`` or ``τ_rθ(r_b) = sin kθ``, with the other traction zero.

    Returns
    -------
    AnnulusModes

    Raises
    ------
    InputError
        If a mode is negative, the radii are not ``0 < r_a < r_b``, or σ is out of range.
    """
    k = np.atleast_1d(np.asarray(modes, dtype=float))
    sigma = np.asarray(poisson_ratio, dtype=float)
    if k.ndim != 1 or not np.all(k >= 0):
        raise InputError("Fourier modes must be one-dimensional and not negative")
    if not 0 < core_radius_mm < outer_radius_mm < np.inf:
        raise InputError(
            f"expected 0 < core radius < outer radius, got {core_radius_mm:g} mm and {outer_radius_mm:g} mm"
        )
    if not np.all((sigma > -1) & (sigma <= 0.5)):
        raise InputError("Poisson's ratio must be above -1 and at most 0.5")
    alpha = core_radius_mm / outer_radius_mm
    kappa = (3 - 4 * sigma)[..., np.newaxis]
    load = (1.0, 0.0) if traction == "normal" else (0.0, 1.0)

    terms = list(higher_modes(np.where((k == 0) | (k == 1), 2.0, k), alpha, kappa, *load))
    for mode, solve in ((0, mode_zero), (1, mode_one)):
        if np.any(k == mode):
            terms = [
                np.where(k == mode, low, term) for low, term in zip(solve(alpha, kappa, *load), terms, strict=True)
            ]
    half = [0.5 * term for term in terms]  # 2μ = 2 MPa
    return AnnulusModes(
        modes=k,
        core_radius_mm=core_radius_mm,
        outer_radius_mm=outer_radius_mm,
        poisson_ratio=sigma,
        growing=(half[0], half[1]),
        decaying=(half[2], half[3]),
        surface_displacement_mm=outer_radius_mm * half[4],
        surface_slip_mm=outer_radius_mm * half[5],
    )
