"""Finite-strain contact of a rigid tip with the bonded annulus, by finite elements (scikit-fem).

Plane strain, total Lagrangian, neo-Hookean ``W = μ/2 (F:F - 3) - μ ln J + λ/2 (ln J)²`` with μ = 1 and λ = 2σ/(1-2σ),
so that loads come out as P/μ. Quadratic quadrilaterals on a rectangle of (θ, r), half of the annulus by symmetry,
with the metric of polar coordinates in the weak form: its circles are exact. Unknowns are Cartesian displacements; x
points from the core's centre to the tip. Contact is by a penalty on the depth to which surface points enter the tip;
it is frictionless, or what has touched sticks to where it touched. The tip moves in steps; each is solved by Newton's
method from the extrapolated last two.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from _rigid_tip import Tip
from scipy.sparse import coo_matrix, csc_matrix, csr_matrix
from scipy.sparse.linalg import splu
from skfem import Basis, ElementQuad2, FacetBasis, MeshQuad

PENALTY = 3000.0  # MPa/mm at μ = 1 MPa: pressures of order μ enter by a third of a micrometre
TOLERANCE = 1e-8


@dataclass(frozen=True)
class Step:
    """One position of the tip: load P/μ (mm), how far the surface touches (rad, undeformed), displacements (n, 2)."""

    depth: float
    load: float
    reach: float
    displacement: np.ndarray


@dataclass(frozen=True, eq=False)
class Annulus:
    """Half of the annulus on mesh lines ``theta`` (rad, 0 to π) and ``radius`` (mm, core to surface)."""

    theta: np.ndarray
    radius: np.ndarray
    poisson_ratio: float

    @cached_property
    def lame(self) -> float:
        return 2 * self.poisson_ratio / (1 - 2 * self.poisson_ratio)

    @cached_property
    def basis(self) -> Basis:
        return Basis(MeshQuad.init_tensor(self.theta, self.radius), ElementQuad2(), intorder=5)

    @cached_property
    def surface(self) -> FacetBasis:
        mesh, outer = self.basis.mesh, self.radius[-1]
        top = mesh.facets_satisfying(lambda x: np.isclose(x[1], outer))
        return FacetBasis(mesh, ElementQuad2(), facets=top, intorder=7)

    @cached_property
    def dofs(self) -> np.ndarray:
        """Unknowns of each element, (elements, 18): node times two plus component."""
        nodes = self.basis.element_dofs.T
        return (2 * nodes[..., None] + np.arange(2)).reshape(len(nodes), -1)

    @cached_property
    def gradients(self) -> tuple[np.ndarray, np.ndarray]:
        """Cartesian gradients of the shape functions (elements, points, 9, 2), and areas (elements, points)."""
        theta, r = np.asarray(self.basis.global_coordinates())
        local = np.stack([shape[0].grad for shape in self.basis.basis])  # (9, 2, elements, points)
        by_theta, by_r = local[:, 0] / r, local[:, 1]
        cos, sin = np.cos(theta), np.sin(theta)
        cartesian = np.stack([cos * by_r - sin * by_theta, sin * by_r + cos * by_theta])
        return np.ascontiguousarray(cartesian.transpose(2, 3, 1, 0)), self.basis.dx * r

    @cached_property
    def free(self) -> np.ndarray:
        theta, r = self.basis.doflocs
        held = np.zeros((self.basis.N, 2), bool)
        held[np.isclose(r, self.radius[0])] = True
        held[np.isclose(theta, 0) | np.isclose(theta, np.pi), 1] = True
        return np.flatnonzero(~held.ravel())

    @cached_property
    def touching(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Surface: points (2, f, q), lengths (f, q), shape functions (f, q, 9), unknowns (f, 18)."""
        theta, r = np.asarray(self.surface.global_coordinates())
        shapes = np.stack([shape[0].value for shape in self.surface.basis]).transpose(1, 2, 0)
        return (
            np.stack([r * np.cos(theta), r * np.sin(theta)]),
            self.surface.dx * r,
            shapes,
            (2 * self.surface.element_dofs.T[..., None] + np.arange(2)).reshape(len(theta), -1),
        )

    def elastic(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        """Forces (elements, 18) and stiffness (elements, 18, 18); None where rubber would be turned inside out."""
        shape, area = self.gradients
        f = np.einsum("eqnj,eni->eqij", shape, u[self.basis.element_dofs.T]) + np.eye(2)
        det = f[..., 0, 0] * f[..., 1, 1] - f[..., 0, 1] * f[..., 1, 0]
        if det.min() <= 0.02:
            return None
        inverse = np.empty_like(f)  # F^-T
        inverse[..., 0, 0], inverse[..., 1, 1] = f[..., 1, 1] / det, f[..., 0, 0] / det
        inverse[..., 0, 1], inverse[..., 1, 0] = -f[..., 1, 0] / det, -f[..., 0, 1] / det
        pressure = self.lame * np.log(det)
        stress = f + (pressure - 1)[..., None, None] * inverse
        force = np.einsum("eqnj,eqij->eni", shape, stress * area[..., None, None])
        # dP = dF + (1 - λ ln J) F^-T dF^T F^-T + λ (F^-T : dF) F^-T
        pushed = np.einsum("eqnj,eqij->eqni", shape, inverse)
        flat = pushed.reshape(*area.shape, 18)
        stiff = np.einsum("eqa,eqb->eab", flat * (self.lame * area)[..., None], flat, optimize=True)
        stiff = stiff.reshape(-1, 9, 2, 9, 2)
        weight = ((1 - pressure) * area)[..., None, None]
        stiff += np.einsum("eqmi,eqnk->enimk", pushed * weight, pushed, optimize=True)
        plain = np.einsum("eqnj,eqmj->enm", shape * area[..., None, None], shape, optimize=True)
        stiff[:, :, 0, :, 0] += plain
        stiff[:, :, 1, :, 1] += plain
        return force.reshape(-1, 18), stiff.reshape(-1, 18, 18)

    def surface_points(self, u: np.ndarray) -> np.ndarray:
        """Where the surface's quadrature points are, (2, f, q)."""
        points, _, shapes, _ = self.touching
        return np.asarray(points + np.einsum("fqn,fni->ifq", shapes, u[self.surface.element_dofs.T]))

    def contact(
        self, u: np.ndarray, tip: Tip, nose: float, anchors: np.ndarray | None
    ) -> tuple[np.ndarray, np.ndarray, float, float]:
        """Forces (f, 18), stiffness (f, 18, 18), load P (both halves) and reach (rad) of the contact.

        `anchors` (f, q) are the places on the tip to which points stick, NaN where they do not.
        """
        points, length, shapes, _ = self.touching
        place = self.surface_points(u)
        gap, normal, curvature = tip.gap(place.reshape(2, -1), nose)
        gap, curvature, normal = (
            gap.reshape(length.shape),
            curvature.reshape(length.shape),
            normal.reshape(points.shape),
        )
        push = PENALTY * np.maximum(-gap, 0.0) * length
        forces = np.einsum("fq,ifq,fqn->fni", -push, normal, shapes)
        outer = np.einsum("ifq,jfq->fqij", normal, normal)
        block = (PENALTY * length * (gap < 0))[..., None, None] * outer
        block -= (push * curvature)[..., None, None] * (np.eye(2) - outer)
        if anchors is not None:
            along = np.stack([normal[1], -normal[0]])
            slip = tip.arc(place.reshape(2, -1), nose).reshape(length.shape) - anchors
            held = PENALTY * np.where((gap < 0) & np.isfinite(slip), 1.0, 0.0) * length
            drag = held * np.nan_to_num(slip)
            forces += np.einsum("fq,ifq,fqn->fni", drag, along, shapes)
            block += held[..., None, None] * np.einsum("ifq,jfq->fqij", along, along)
        stiff = np.einsum("fqij,fqn,fqm->fnimj", block, shapes, shapes, optimize=True)
        reach = np.arctan2(points[1], points[0])[gap < 0].max(initial=0.0)
        load = float(2 * (push * -normal[0]).sum())
        return forces.reshape(len(length), 18), stiff.reshape(len(length), 18, 18), load, float(reach)

    def press(self, tip: Tip, depths: np.ndarray, stick: bool = False) -> Iterator[Step]:
        """Push the tip in to each depth (mm, growing), as far as Newton's method follows."""
        anchors = np.full(self.touching[1].shape, np.nan) if stick else None
        last = before = np.zeros((self.basis.N, 2))
        at, earlier = 0.0, -1.0
        for depth in depths:
            guess = last + (last - before) * ((depth - at) / (at - earlier))
            solved = self._solve(guess, tip, depth, anchors) or self._solve(last, tip, depth, anchors)
            if solved is None:
                return
            u, load, reach = solved
            before, last, earlier, at = last, u, at, float(depth)
            if anchors is not None:
                anchors = self._anchored(u, tip, self.radius[-1] - depth, anchors)
            yield Step(float(depth), load, reach, u)

    def _anchored(self, u: np.ndarray, tip: Tip, nose: float, anchors: np.ndarray) -> np.ndarray:
        """What touches for the first time sticks; what has left is free."""
        place = self.surface_points(u).reshape(2, -1)
        touches = (tip.gap(place, nose)[0] < 0).reshape(anchors.shape)
        here = tip.arc(place, nose).reshape(anchors.shape)
        return np.where(touches, np.where(np.isnan(anchors), here, anchors), np.nan)

    def _assembled(
        self, u: np.ndarray, tip: Tip, depth: float, anchors: np.ndarray | None
    ) -> tuple[np.ndarray, csc_matrix, float, float] | None:
        inside = self.elastic(u)
        if inside is None:
            return None
        on_surface = self.contact(u, tip, self.radius[-1] - depth, anchors)
        n = 2 * self.basis.N
        rows = self.touching[3]
        residual = np.bincount(self.dofs.ravel(), inside[0].ravel(), n)
        residual += np.bincount(rows.ravel(), on_surface[0].ravel(), n)
        blocks = [(self.dofs, inside[1]), (rows, on_surface[1])]
        i, j, values = (
            np.concatenate(parts)
            for parts in zip(
                *((np.repeat(d, 18, axis=1).ravel(), np.tile(d, (1, 18)).ravel(), k.ravel()) for d, k in blocks),
                strict=True,
            )
        )
        stiffness = coo_matrix((values, (i, j)), shape=(n, n)).tocsr()[self.free][:, self.free].tocsc()
        return residual[self.free], stiffness, on_surface[2], on_surface[3]

    def _solve(
        self, u: np.ndarray, tip: Tip, depth: float, anchors: np.ndarray | None
    ) -> tuple[np.ndarray, float, float] | None:
        state = self._assembled(u, tip, depth, anchors)
        if state is None:
            return None
        for _ in range(40):
            residual, stiffness, load, reach = state
            size = np.linalg.norm(residual)
            if size < TOLERANCE * max(load, 1e-3):
                return u, load, reach
            step = splu(stiffness, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}).solve(-residual)
            share = 1.0
            while True:
                moved = u.ravel().copy()
                moved[self.free] += share * step
                state = self._assembled(moved.reshape(-1, 2), tip, depth, anchors)
                if state is not None and (np.linalg.norm(state[0]) < size * (1 - 0.1 * share) or share < 0.1):
                    break
                share /= 2
                if share < 1e-3:
                    return None
            u = moved.reshape(-1, 2)
        return None

    def radial_slope(self, theta: np.ndarray, radius: float) -> csr_matrix:
        """Matrix that takes nodal values to derivatives along r at (θ, radius) of the undeformed body."""
        points = np.stack([theta, np.full_like(theta, radius)])
        cells = self.basis.mesh.element_finder()(*points)
        local = self.basis.mapping.invF(points[:, :, None], tind=cells)
        rows = np.arange(len(theta))
        shapes = [self.basis.elem.gbasis(self.basis.mapping, local, i, tind=cells)[0] for i in range(self.basis.Nbfun)]
        values = np.concatenate([shape.grad[1, :, 0] for shape in shapes])
        columns = self.basis.element_dofs[:, cells].ravel()
        return csr_matrix((values, (np.tile(rows, len(shapes)), columns)), shape=(len(theta), self.basis.N))


def radial_strains(theta: np.ndarray, slope: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Projected strain ``e_r·F e_r - 1`` and stretch ``|F e_r| - 1`` from the radial slope (points, 2) at θ."""
    radial = np.stack([np.cos(theta), np.sin(theta)], axis=1)
    return (slope * radial).sum(axis=1), np.hypot(*(radial + slope).T) - 1


def graded(length: float, first: float, ratio: float, largest: float) -> np.ndarray:
    """Mesh lines from 0 to `length`: from `first` up to `largest` apart, each `ratio` times the last."""
    steps = [first]
    while sum(steps) < length:
        steps.append(min(steps[-1] * ratio, largest))
    lines = np.concatenate([[0.0], np.cumsum(steps)])
    return lines * (length / lines[-1])


def annulus(size: float, core: float, outer: float, poisson_ratio: float) -> Annulus:
    """A mesh: 0.02 mm times `size` below the tip, growing to 0.1 mm along the contact and 0.14 mm beneath it."""
    near = graded(3.6, 0.02 * size, 1 + 0.1 * size, 0.1 * size) / outer
    far = near[-1] + graded(np.pi - near[-1], 0.12 * size / outer, 1 + 0.15 * size, 0.14 * size)
    middle = 0.35 * outer + 0.65 * core
    down = outer - graded(outer - middle, 0.03 * size, 1 + 0.15 * size, 0.14 * size)
    up = core + graded(middle - core, 0.03 * size, 1 + 0.3 * size, 0.12 * size)
    return Annulus(np.concatenate([near, far[1:]]), np.concatenate([up, down[-2::-1]]), poisson_ratio)
