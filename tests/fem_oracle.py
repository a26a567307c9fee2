"""Finite elements for the tests: bonded annulus, pad, frictionless contact. No code shared with bayestouch.

Quadratic quadrilaterals on a rectangle of (lateral, normal) coordinates. The annulus is solved *in* polar
coordinates, with polar displacement components and the metric in the weak form, so that its geometry is
exact. μ = 1 throughout; symmetric about the lateral coordinate 0, so that only half of a body is meshed.
Displacements along the coordinates.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import chain, pairwise
from typing import Literal

import numpy as np
from numpy.polynomial import Chebyshev
from scipy.interpolate import PchipInterpolator
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import splu
from skfem import Basis, BilinearForm, ElementQuad2, ElementVector, FacetBasis, LinearForm, MeshQuad

Kind = Literal["annulus", "plane", "axisymmetric"]
Profile = Callable[[np.ndarray], np.ndarray]


def graded(length: float, first: float, ratio: float, largest: float) -> np.ndarray:
    """Mesh lines from 0 to `length`: from `first` up to `largest` apart, each `ratio` times the last."""
    steps = [first]
    while sum(steps) < length:
        steps.append(min(steps[-1] * ratio, largest))
    lines = np.concatenate([[0.0], np.cumsum(steps)])
    return lines * (length / lines[-1])


def through_gauss_points(first: float, last: float, spacing: float, points: list[float]) -> np.ndarray:
    """Mesh lines about `spacing` apart, with every one of `points` at a Gauss point of its interval.

    At (1 ± 1/√3)/2 of the interval the derivative of a quadratic interpolant is one order more accurate.
    """
    offset = 0.5 - 1 / np.sqrt(12)
    ends = ([p - offset * spacing, p + (1 - offset) * spacing] for p in points)
    marks = [first, *chain.from_iterable(ends), last]
    pieces = [
        np.linspace(start, end, 1 if i % 2 else max(1, round((end - start) / spacing)), endpoint=False)
        for i, (start, end) in enumerate(pairwise(marks))
    ]
    return np.append(np.concatenate(pieces), last)


@dataclass(frozen=True)
class Body:
    """A body on ``lateral`` x ``normal`` mesh lines: bonded at the lowest normal line, loaded on the highest.

    ``annulus``: lateral = θ in radians from 0 to π, normal = r. ``plane``: plane strain, lateral = x, normal
    = height. ``axisymmetric``: lateral = ρ. The far side is a symmetry line of the annulus, and free for a
    pad.
    """

    kind: Kind
    lateral: np.ndarray
    normal: np.ndarray
    poisson_ratio: float

    @cached_property
    def basis(self) -> Basis:
        mesh = MeshQuad.init_tensor(np.sort(self.lateral), np.sort(self.normal))
        return Basis(mesh, ElementVector(ElementQuad2()), intorder=5)

    @cached_property
    def surface(self) -> FacetBasis:
        top = self.basis.mesh.facets_satisfying(lambda x: np.isclose(x[1], self.normal.max()))
        return FacetBasis(self.basis.mesh, self.basis.elem, facets=top, intorder=8)

    @property
    def surface_stretch(self) -> float:
        """Length along the surface per unit of the lateral coordinate."""
        return float(self.normal.max()) if self.kind == "annulus" else 1.0

    @cached_property
    def stiffness(self) -> csr_matrix:
        kind, lame = self.kind, 2 * self.poisson_ratio / (1 - 2 * self.poisson_ratio)

        def strains(u, w):  # type: ignore[no-untyped-def]
            across, along = w.x
            (xx, xy), (yx, yy) = u.grad
            if kind == "annulus":
                return (u[1] + xx) / along, yy, 0.0 * yy, yx / along + xy - u[0] / along
            return xx, yy, (u[0] / across if kind == "axisymmetric" else 0.0 * yy), yx + xy

        @BilinearForm
        def energy(u, v, w):  # type: ignore[no-untyped-def]
            a, b = strains(u, w), strains(v, w)
            direct = sum(x * y for x, y in zip(a[:3], b[:3], strict=True))
            density = lame * sum(a[:3]) * sum(b[:3]) + 2 * direct + a[3] * b[3]
            return density * {"annulus": w.x[1], "plane": 1.0, "axisymmetric": 2 * np.pi * w.x[0]}[kind]

        return energy.assemble(self.basis).tocsr()

    @cached_property
    def free(self) -> np.ndarray:
        """Degrees of freedom that neither the bond nor symmetry holds."""
        x = self.basis.doflocs
        bonded = np.isclose(x[1], self.normal.min())
        symmetric = np.isclose(x[0], 0) | (np.isclose(x[0], self.lateral.max()) & (self.kind == "annulus"))
        sideways = np.zeros(self.basis.N, bool)
        sideways[self.basis.split_indices()[0]] = True
        return np.flatnonzero(~(bonded | (symmetric & sideways)))

    def solve(self, load: np.ndarray) -> np.ndarray:
        """Displacement under a load vector."""
        u = np.zeros_like(load)
        u[self.free] = splu(self.stiffness[self.free][:, self.free].tocsc()).solve(load[self.free])
        return u

    def surface_reaction(self, reach: float, profiles: list[Profile]) -> np.ndarray:
        """Inward force that holds the surface out to lateral coordinate `reach` at an outward displacement.

        Without friction: sideways the surface is free. One force per profile, on this half of the body.
        """
        x = self.basis.doflocs
        normal = np.zeros(self.basis.N, bool)
        normal[self.basis.split_indices()[1]] = True
        held = np.flatnonzero(normal & np.isclose(x[1], self.normal.max()) & (x[0] <= reach * (1 + 1e-9)))
        other = np.setdiff1d(self.free, held)
        given = np.column_stack([profile(x[0, held]) for profile in profiles])
        across = self.stiffness[held][:, other]
        rest = splu(self.stiffness[other][:, other].tocsc()).solve(-(across.T @ given))
        return -(across @ rest + self.stiffness[held][:, held] @ given).sum(axis=0)

    def line_load(self) -> np.ndarray:
        """Load vector of a unit inward line load at lateral coordinate 0; half of it acts on this half."""
        load = np.zeros(self.basis.N)
        lateral, normal = self.basis.mesh.p
        corner = np.flatnonzero(np.isclose(lateral, 0) & np.isclose(normal, self.normal.max()))
        load[self.basis.nodal_dofs[1, corner]] = -0.5
        return load

    def pressure_load(self, pressure: Profile) -> np.ndarray:
        """Load vector of an inward pressure given as a function of the lateral coordinate."""
        stretch, axisymmetric = self.surface_stretch, self.kind == "axisymmetric"

        @LinearForm
        def work(v, w):  # type: ignore[no-untyped-def]
            return -pressure(w.x[0]) * v[1] * (2 * np.pi * w.x[0] if axisymmetric else stretch)

        return work.assemble(self.surface)

    def normal_strain(self, u: np.ndarray, lateral: np.ndarray, normal: float) -> np.ndarray:
        """Strain along the normal coordinate, evaluated in the elements that hold the points."""
        return self._at(u, lateral, normal)[1]

    def normal_stress(self, u: np.ndarray, lateral: np.ndarray, normal: float) -> np.ndarray:
        """Stress along the normal coordinate of a pad (tension positive, μ = 1)."""
        value, strain, across = self._at(u, lateral, normal)
        hoop = value / lateral if self.kind == "axisymmetric" else 0.0
        return 2 * strain + 2 * self.poisson_ratio / (1 - 2 * self.poisson_ratio) * (strain + across + hoop)

    def _at(self, u: np.ndarray, lateral: np.ndarray, normal: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Lateral displacement, normal strain and lateral derivative of lateral displacement at points."""
        points = np.array([lateral, np.full_like(lateral, normal)])
        cells = self.basis.mesh.element_finder()(*points)
        local = self.basis.mapping.invF(points[:, :, None], tind=cells)
        value, strain, stretch = np.zeros((3, lateral.size))
        for i in range(self.basis.Nbfun):
            phi = self.basis.elem.gbasis(self.basis.mapping, local, i, tind=cells)[0]
            weight = u[self.basis.element_dofs[i, cells]]
            value += weight * phi[0, :, 0]
            strain += weight * phi.grad[1, 1, :, 0]
            stretch += weight * phi.grad[0, 0, :, 0]
        return value, strain, stretch

    def surface_displacement(self, u: np.ndarray, lateral: np.ndarray) -> np.ndarray:
        """Displacement along the normal coordinate at the surface."""
        probes = self.basis.probes(np.array([lateral, np.full_like(lateral, self.normal.max())]))
        return (probes @ u)[lateral.size :]


@dataclass(frozen=True)
class ContactCurve:
    """Half-width of the frictionless contact of a rigid parabola on a bonded annulus, by finite elements.

    Barber's theorem: at a fixed approach δ the load is greatest at the true contact area (J. R. Barber,
    Journal of Strain Analysis 9 (1974) 230, doi:10.1243/03093247V094230). With a contact held at half-width
    a, ``P/μ = δ k1(a) + k2(a)/R``: forces that displace the surface inward by 1 and outward by ``s²/2``. Then

        dP/da = 0   gives   δ R = -k2'/k1'   and   P R/μ = k2 - k1 k2'/k1'.

    Both forces are global and smooth in a on a family of meshes that scale with a, so that a polynomial
    through a few half-widths differentiates them. No pressure near the edge is needed, and no active set.
    """

    half_widths: np.ndarray
    load_times_radius_over_modulus: np.ndarray

    @classmethod
    def for_annulus(
        cls,
        core_radius: float,
        outer_radius: float,
        poisson_ratio: float,
        *,
        range_mm: tuple[float, float],
        edge_spacing: float = 1e-3,
        ratio: float = 1.4,
        samples: int = 12,
    ) -> ContactCurve:
        """Solve `samples` half-widths on elements ``edge_spacing * a`` wide at the edge, then growing."""
        low, high = np.log(range_mm)
        nodes = low + (high - low) * (1 - np.cos(np.pi * (np.arange(samples) + 0.5) / samples)) / 2
        forces = []
        for a in np.exp(nodes):
            inside = a - graded(a, edge_spacing * a, ratio, a / 6)
            outside = a + graded(np.pi * outer_radius - a, edge_spacing * a, ratio, 0.8)
            lateral = np.union1d(inside, outside) / outer_radius
            lateral[0] = 0.0  # not the rounding error of a - a
            normal = outer_radius - graded(outer_radius - core_radius, edge_spacing * a, ratio, 0.25)
            body = Body("annulus", lateral, normal, poisson_ratio)
            profiles = [lambda x: -np.ones_like(x), lambda x: 0.5 * (outer_radius * x) ** 2]
            forces.append(2 * body.surface_reaction(a / outer_radius, profiles))
        # Logarithms, because k1 and -k2 span decades: k2'/k1' = k2 (log -k2)' / k1'.
        k1 = Chebyshev.fit(nodes, np.array(forces)[:, 0], samples - 1)
        k2 = Chebyshev.fit(nodes, np.log(-np.array(forces)[:, 1]), samples - 1)
        fine = np.linspace(low, high, 400)
        outward = -np.exp(k2(fine))
        return cls(np.exp(fine), outward - k1(fine) * outward * k2.deriv()(fine) / k1.deriv()(fine))

    def half_width(self, load_over_modulus: float, composite_radius: float) -> float:
        """Half-width in mm for a load P/μ in mm and a composite radius in mm."""
        wanted = load_over_modulus * composite_radius
        if not self.load_times_radius_over_modulus[0] <= wanted <= self.load_times_radius_over_modulus[-1]:
            raise ValueError(f"P R/μ = {wanted:g} mm² is outside the half-widths solved")
        logarithms = np.log(self.load_times_radius_over_modulus), np.log(self.half_widths)
        return float(np.exp(PchipInterpolator(*logarithms)(np.log(wanted))))
