"""The body of every finger. To use another E map, change the import that is marked below (`docs/add_a_body.md`)."""

from __future__ import annotations

from typing import Protocol

from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray

# The only line that says which body a finger has. Fits, gains, contact models and simulated readings all use it.
from bayestouch.body.annulus import solve_annulus as solve_body

__all__ = ["FingerBody", "radial_strain_response", "solve_body", "surface_displacement_response"]


class FingerBody(Protocol):
    """Solved modes of a finger's body under unit surface traction at μ = 1 MPa: what `solve_body` returns.

    `bayestouch.body.annulus.AnnulusModes` describes the attributes.
    """

    @property
    def modes(self) -> FloatArray: ...

    @property
    def core_radius_mm(self) -> float: ...

    @property
    def outer_radius_mm(self) -> float: ...

    @property
    def poisson_ratio(self) -> FloatArray: ...

    @property
    def surface_displacement_mm(self) -> FloatArray: ...

    def radial_strain(self, radius_mm: ArrayLike) -> FloatArray: ...


def radial_strain_response(
    modes: ArrayLike,
    radius_mm: ArrayLike,
    *,
    core_radius_mm: float,
    outer_radius_mm: float,
    poisson_ratio: ArrayLike,
) -> FloatArray:
    """Radial strain in the body per unit traction ``τ_rr = cos kθ`` at μ = 1 MPa: E map in Fourier space.

    Parameters
    ----------
    modes : (n_modes,) array_like of int
        Fourier modes ``k``.
    radius_mm : array_like
        Sensing radii in mm, core to surface. Its shape and that of `poisson_ratio` broadcast: with equal shapes
        they are paired; ``poisson_ratio[:, None]`` and a vector of radii give every combination.
    core_radius_mm, outer_radius_mm, poisson_ratio
        As in `bayestouch.body.annulus.solve_annulus`.

    Returns
    -------
    array of shape ``broadcast(poisson_ratio, radius_mm) + (n_modes,)``
        Amplitude of ``e_rr`` (extension positive) as a multiple of cos kθ; divide by μ in MPa. A pressure is a negative
        traction.
    """
    return solve_body(
        modes, core_radius_mm=core_radius_mm, outer_radius_mm=outer_radius_mm, poisson_ratio=poisson_ratio
    ).radial_strain(radius_mm)


def surface_displacement_response(
    modes: ArrayLike, *, core_radius_mm: float, outer_radius_mm: float, poisson_ratio: ArrayLike
) -> FloatArray:
    """Radial displacement ``u_r(r_b)`` in mm, positive away from the axis, per unit of ``τ_rr = cos kθ`` at μ = 1 MPa.

    Parameters are those of `radial_strain_response`; the shape is ``poisson_ratio.shape + (n_modes,)``.
    """
    return solve_body(
        modes, core_radius_mm=core_radius_mm, outer_radius_mm=outer_radius_mm, poisson_ratio=poisson_ratio
    ).surface_displacement_mm
