"""Bonded annulus in plane strain, mode by mode: Chebyshev collocation of the displacement equations in r.

Displacements are ``u_r = U(r) cos kθ``, ``u_θ = V(r) sin kθ``; the strains, Hooke's law and equilibrium are written
down as matrices on the collocation points and solved with the boundary conditions in place of the end rows.
μ = 1 MPa throughout, lengths in mm.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

POINTS = 64


@dataclass(frozen=True)
class Annulus:
    """Core radius, outer radius (mm) and Poisson's ratio."""

    core: float = 9.4
    outer: float = 12.7
    poisson: float = 0.465


@dataclass(frozen=True, eq=False)
class Response:
    """Answer of the annulus to unit surface traction ``cos kθ`` (normal) or ``sin kθ`` (shear).

    `strain` (k, point) is ``e_rr(r)`` at the collocation radii `radius`, `surface` (k,) is ``u_r(r_b)`` and `slip` (k,)
    ``u_θ(r_b)``.
    """

    radius: np.ndarray
    strain: np.ndarray
    surface: np.ndarray
    slip: np.ndarray

    def strain_at(self, r: np.ndarray) -> np.ndarray:
        """Strain at radii `r` (n,), shape (k, n), by barycentric interpolation."""
        weights = (-1.0) ** np.arange(len(self.radius))
        weights[[0, -1]] /= 2
        with np.errstate(divide="ignore", invalid="ignore"):
            terms = weights / (r[:, None] - self.radius)
            lagrange = terms / terms.sum(axis=1, keepdims=True)
        hit = r[:, None] == self.radius
        lagrange = np.where(hit.any(axis=1)[:, None], hit, lagrange)
        return np.asarray(self.strain @ lagrange.T)


def chebyshev(points: int, low: float, high: float) -> tuple[np.ndarray, np.ndarray]:
    """Points from `high` down to `low` and the matrix that differentiates on them."""
    x = np.cos(np.pi * np.arange(points) / (points - 1))
    scale = np.ones(points)
    scale[[0, -1]] = 2
    scale = scale * (-1.0) ** np.arange(points)
    gap = x[:, None] - x[None, :] + np.eye(points)
    matrix = np.outer(scale, 1 / scale) / gap
    matrix -= np.diag(matrix.sum(axis=1))
    return low + (high - low) * (x + 1) / 2, matrix * 2 / (high - low)


def solve(body: Annulus, modes: np.ndarray, traction: str = "normal", points: int = POINTS) -> Response:
    """Collocate all `modes`; `traction` is "normal" (``τ_rr = cos kθ``) or "shear" (``τ_rθ = sin kθ``)."""
    r, d = chebyshev(points, body.core, body.outer)
    over_r = np.diag(1 / r)
    lame = 2 * body.poisson / (1 - 2 * body.poisson)
    zero = np.zeros((points, points))
    strain, ends = np.empty((len(modes), points)), np.empty((2, len(modes)))
    for row, k in enumerate(modes):
        # strains as matrices on (U, V)
        rr = np.hstack([d, zero])
        hoop = np.hstack([over_r, k * over_r])
        shear = np.hstack([-k * over_r, d - over_r])  # 2 ε_rθ
        s_rr, s_hoop = lame * (rr + hoop) + 2 * rr, lame * (rr + hoop) + 2 * hoop
        system = np.vstack(
            [
                d @ s_rr + over_r @ (s_rr - s_hoop) + k * over_r @ shear,
                d @ shear + 2 * over_r @ shear - k * over_r @ s_hoop,
            ]
        )
        right = np.zeros(2 * points)
        # the first point is the surface, the last the bond
        system[0], right[0] = s_rr[0], float(traction == "normal")
        system[points], right[points] = shear[0], float(traction == "shear")
        system[points - 1], system[-1] = 0, 0
        system[points - 1, points - 1] = system[-1, -1] = 1
        size = np.abs(system).max(axis=1)
        u = np.linalg.solve(system / size[:, None], right / size)
        strain[row], ends[:, row] = rr @ u, u[[0, points]]
    return Response(r, strain, *ends)
