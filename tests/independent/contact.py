"""Frictionless contact of a rigid parabola with the annulus: piecewise linear pressure on graded nodes.

For a contact that reaches from -a to a the displacements of all nodes are set equal to ``D - s²/(2R)``; the unknowns
are the pressures of the inner nodes and the depth D, and the pressure at the edges is zero. What a piecewise linear
pressure does to the surface is a sum of second differences of the twice integrated influence function: the half-plane's
logarithm and its next order in closed form, what is left summed over Fourier modes. μ = 1 MPa.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from scipy.interpolate import CubicSpline

from .body import Annulus, solve

INTERVALS = 96
BODY_MODES = 200
GAUSS_PLACES, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(3)


@dataclass(frozen=True, eq=False)
class Influence:
    """Twice integrated influence function of the surface: ``half_plane`` (mm) and ``next_order`` scale its
    singular parts, `rest` are the Fourier coefficients of what remains, from mode 0.
    """

    half_plane: float
    next_order: float
    rest: np.ndarray

    @classmethod
    def of(cls, body: Annulus) -> Influence:
        modes = np.arange(BODY_MODES + 1)
        surface = solve(body, modes).surface
        half_plane = (1 - body.poisson) * body.outer
        k = modes[60:].astype(float)
        # C_k = A/k + B/k² + C/k³ + ... ; only B is needed to see the rest fall as k^-3
        powers = np.stack([k**-2, k**-3, k**-4], axis=1)
        tail = np.linalg.lstsq(powers * k[:, None] ** 2, (surface[60:] - half_plane / k) * k**2, rcond=None)[0]
        rest = surface.copy()
        rest[1:] -= half_plane / modes[1:] + tail[0] / modes[1:] ** 2
        return cls(half_plane, float(tail[0]), rest)

    def __call__(self, x: np.ndarray) -> np.ndarray:
        """Twice integrated displacement at angle `x` (rad, below 1) from a unit line load, up to linear terms."""
        x2 = x * x
        with np.errstate(divide="ignore"):
            log = np.where(x == 0, 0.0, np.log(np.abs(np.where(x == 0, 1.0, x))))
        # minus the double integral of ln|2 sin(x/2)| = ln|x| - x²/24 - x⁴/2880 - x⁶/181440 - ...
        singular = -(x2 / 2 * log - 0.75 * x2 - x2**2 / 288 - x2**3 / 86400 - x2**4 / 10160640)
        # double integral of Σ cos(kx)/k² = π²/6 - π|x|/2 + x²/4
        kink = np.pi**2 / 12 * x2 - np.pi / 12 * np.abs(x) ** 3 + x2**2 / 48
        waves = self._waves(np.abs(x))
        total = self.rest[0] * x2 / 2 + 2 * (self.half_plane * singular + self.next_order * kink + waves)
        return np.asarray(total / (2 * np.pi))

    @cached_property
    def _waves(self) -> CubicSpline:
        """Sum of the remaining modes, whose terms fall as k^-5, at angles up to 1 rad."""
        modes, angles = np.arange(1, len(self.rest)), np.linspace(0, 1, 2001)
        return CubicSpline(angles, np.cos(np.outer(angles, modes)) @ (-self.rest[1:] / modes**2))


@dataclass(frozen=True, eq=False)
class Contact:
    """One solved contact at composite radius 1 mm and μ = 1 MPa: nodes (rad), pressure (MPa), load (N/mm)."""

    nodes: np.ndarray
    pressure: np.ndarray
    load: float
    depth: float

    def spectrum(self, modes: np.ndarray) -> np.ndarray:
        """``q_k``: mean of cos kθ weighted by the pressure."""
        low, high = self.nodes[:-1, None], self.nodes[1:, None]
        share = (GAUSS_PLACES + 1) / 2
        places = low + (high - low) * share
        weight = (self.pressure[:-1, None] * (1 - share) + self.pressure[1:, None] * share) * (high - low) / 2
        weight = weight * GAUSS_WEIGHTS
        waves = np.cos(places.ravel()[:, None] * modes)
        return np.asarray(weight.ravel() @ waves / weight.sum())


def press(influence: Influence, outer: float, half_angle: float, intervals: int = INTERVALS) -> Contact:
    """Contact of half-angle `half_angle` (rad) under a parabola of composite radius 1 mm."""
    # nodes crowd at the edge, where the pressure falls like a square root
    nodes = half_angle * np.sin(np.linspace(0, np.pi / 2, intervals + 1))
    whole = np.concatenate([-nodes[:0:-1], nodes])
    table = influence(nodes[:, None] - whole)
    step = np.diff(whole)
    # a hat on a node is slopes that change at the node and at its neighbours
    left, right = table[:, :-2] / step[:-1], table[:, 2:] / step[1:]
    hats = left + right - table[:, 1:-1] * (1 / step[:-1] + 1 / step[1:])
    inner = intervals - 1
    symmetric = hats[:, inner:].copy()
    symmetric[:, 1:] += hats[:, :inner][:, ::-1]
    system = np.column_stack([symmetric, -np.ones(intervals + 1)])
    solution = np.linalg.solve(system, -((outer * nodes) ** 2) / 2)
    pressure = np.append(solution[:-1], 0.0)
    load = 2 * outer * float(np.sum((pressure[1:] + pressure[:-1]) / 2 * np.diff(nodes)))
    return Contact(nodes, pressure, load, float(solution[-1]))


@dataclass(frozen=True, eq=False)
class ContactTable:
    """Spectra over ``κ = P R/μ`` (mm²), splines in log κ; 1 in the limit of a knife edge."""

    kappa: np.ndarray
    half_width: np.ndarray
    spectra: np.ndarray

    def spectrum(self, kappa: np.ndarray) -> np.ndarray:
        """``q_k`` for modes 0, 1, 2, ..., shape (n, modes)."""
        kappa = np.asarray(kappa, dtype=float)
        if kappa.max(initial=0) > self.kappa[-1]:
            raise ValueError(f"κ of {kappa.max():g} mm² is beyond the table's {self.kappa[-1]:g}")
        at = CubicSpline(np.log(self.kappa), self.spectra)(np.log(np.maximum(kappa, self.kappa[0])))
        # below the table q_k = 1 - k² × something proportional to κ
        small = (kappa / self.kappa[0])[:, None]
        return np.where(small < 1, 1 - small * (1 - self.spectra[0]), at)

    def width(self, kappa: np.ndarray) -> np.ndarray:
        """Half-width in mm."""
        return np.asarray(np.exp(CubicSpline(np.log(self.kappa), np.log(self.half_width))(np.log(kappa))))


@lru_cache(maxsize=4)
def contact_table(body: Annulus, modes: int, knots: int = 64, intervals: int = INTERVALS) -> ContactTable:
    """Solve `knots` contacts with half-angles from 0.003 to 0.36 rad."""
    influence = Influence.of(body)
    solved = [press(influence, body.outer, beta, intervals) for beta in np.geomspace(0.003, 0.36, knots)]
    return ContactTable(
        # at R = 1 mm and μ = 1 MPa, κ is the load
        kappa=np.array([each.load for each in solved]),
        half_width=np.array([each.nodes[-1] * body.outer for each in solved]),
        spectra=np.array([each.spectrum(np.arange(modes)) for each in solved]),
    )
