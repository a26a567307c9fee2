"""What large strain adds to the response of the paper's finger: a finite-element table.

At the paper's load its soft rubber is strained by a tenth and more, and everything linear is a first term. The table
holds the difference between a neo-Hookean annulus (``W = μ/2 (F:F - 3) - μ ln J + λ/2 (ln J)²``, σ = 0.46, plane
strain, bonded core, no friction, true circles) and the linear chain (parabola on the layer) at the same load and
radius. All depends on ``P/μ``, R and r_s alone. `studies/finite_strain_table.py` makes it and says how well it has
converged.

The indenter is a right-angled wedge with a round nose: for blunt tips the nose alone touches; the paper's edge, a 90°
corner, is the wedge with the least nose that was solved (0.1 mm), and stands for R = 0. An ideal line load has no
finite displacement, and none at finite strain to compare with.

An element can read one of two strains: ``projected``, ``e_r·F e_r - 1`` (the change of distance from the core along the
radius it was built on, what the plates of a capacitor over a rigid core measure), or ``stretch``, ``|F e_r| - 1`` (the
change of length of a radial line). They differ by half the square of the shear, which is large near the bond. The third
table, ``stuck``, is of projected strains under a tip to which rubber sticks where it first touches it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bayestouch.array_types import FloatArray
from bayestouch.errors import InputError

Measure = Literal["projected", "stretch", "stuck"]

MEASURES: tuple[Measure, ...] = ("projected", "stretch", "stuck")
DATA = Path(__file__).parent / "data" / "finite_strain.npz"
CORE_RADIUS_MM, OUTER_RADIUS_MM, POISSON_RATIO = 9.4, 12.7, 0.46
# Interpolation is linear between these: together off by 3e-4 of the peak from splines and cosines.
KNOTS, ANGLES = 48, 1024
LOAD_SCALE_MM, RADIUS_SCALE_MM = 1.0, 1.0


@dataclass(frozen=True, eq=False)
class FiniteStrainTable:
    """The added response as a short sum of shapes over angle and depth, ``D = Σ_j a_j(P/μ, R) D_j(r_s, φ)``.

    Attributes
    ----------
    load_over_modulus_mm : (p,) array
        P/μ, from 0.
    radius_mm : (q,) array
        Composite radii R; the first is the paper's edge.
    sensing_radius_mm : (s,) array
        Sensing radii r_s, core first.
    amplitudes : (p, q, n) array
        ``a_j``; zero at no load.
    shapes : (n, s, k) array
        Cosine coefficients of ``D_j(φ) = c_0 + 2 Σ c_k cos kφ``. D is the response at φ from the touch that finite
        strain adds, over the linear peak response to a knife edge of the same load.
    """

    load_over_modulus_mm: FloatArray
    radius_mm: FloatArray
    sensing_radius_mm: FloatArray
    amplitudes: FloatArray
    shapes: FloatArray

    @classmethod
    def load(cls, measure: Measure = "projected") -> FiniteStrainTable:
        """The shipped table, for what the elements read."""
        if measure not in MEASURES:
            raise InputError(f"unknown measure of strain {measure!r}; expected one of {', '.join(MEASURES)}")
        return _loaded(measure)

    @property
    def coefficients(self) -> FloatArray:
        """Cosine coefficients of the added response, (p, q, s, k)."""
        return np.tensordot(self.amplitudes, self.shapes, 1)

    @cached_property
    def knots(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Knots in ``log(1 + P/μ)`` and ``log(1 + R)``, and amplitudes there by cubic splines."""
        from scipy.interpolate import CubicSpline

        load, radius = _knots(self.load_over_modulus_mm, LOAD_SCALE_MM), _knots(self.radius_mm, RADIUS_SCALE_MM)
        at = CubicSpline(self.load_over_modulus_mm, self.amplitudes, axis=0)(np.expm1(load) * LOAD_SCALE_MM)
        return load, radius, CubicSpline(self.radius_mm, at, axis=1)(np.expm1(radius) * RADIUS_SCALE_MM)

    def for_elements(self, sensing_radius_mm: ArrayLike) -> FiniteStrainResponse:
        """Interpolator for elements at `sensing_radius_mm` (m,).

        Raises
        ------
        InputError
            If an element lies outside the tabulated radii.
        """
        from scipy.interpolate import CubicSpline

        radii = np.atleast_1d(np.asarray(sensing_radius_mm, dtype=float))
        low, high = self.sensing_radius_mm[0], self.sensing_radius_mm[-1]
        if not np.all((radii >= low) & (radii <= high)):
            raise InputError(f"finite strain is tabulated for sensing radii from {low:g} to {high:g} mm")
        at = CubicSpline(self.sensing_radius_mm, self.shapes, axis=1)(radii)
        shapes = np.moveaxis(np.fft.irfft(at, n=ANGLES) * ANGLES, 0, -1)
        return FiniteStrainResponse(*self.knots, np.ascontiguousarray(shapes))


@dataclass(frozen=True, eq=False)
class FiniteStrainResponse:
    """Added response of every element: linear between knots of load, radius and angle.

    Attributes
    ----------
    loads, radii : (a,), (b,) arrays
        Knots, equally spaced in ``log(1 + P/μ)`` and ``log(1 + R)`` (mm).
    amplitudes : (a, b, n) array
        Amplitudes of the shapes.
    shapes : (m, n_angles, n) array
        Shapes around each element.
    """

    loads: FloatArray
    radii: FloatArray
    amplitudes: FloatArray
    shapes: FloatArray

    def __call__(self, load_over_modulus_mm: ArrayLike, radius_mm: ArrayLike, angle: ArrayLike) -> FloatArray:
        """Added response over the linear peak response to a knife edge of the same load.

        Parameters
        ----------
        load_over_modulus_mm, radius_mm : (...,) array_like
            P/μ and R in mm; beyond an end of the table the end is used.
        angle : (..., m) array_like
            Angle of each element from the touch, rad.

        Returns
        -------
        (..., m) array
        """
        m, n_angles, n = self.shapes.shape
        row, up = _place(load_over_modulus_mm, LOAD_SCALE_MM, self.loads)
        column, right = _place(radius_mm, RADIUS_SCALE_MM, self.radii)
        place, across = row * len(self.radii) + column, right[..., None]
        amplitudes = self.amplitudes.reshape(-1, n)
        lower, upper = (
            (1 - across) * amplitudes[start] + across * amplitudes[start + 1]
            for start in (place, place + len(self.radii))
        )
        amplitude = lower + up[..., None] * (upper - lower)
        turn = np.asarray(angle, dtype=float) * (n_angles / (2 * np.pi))
        node = np.floor(turn)
        first = node.astype(np.int64) & (n_angles - 1)
        element, shapes = np.arange(m) * n_angles, self.shapes.reshape(-1, n)

        def at(index: NDArray[np.int64]) -> FloatArray:
            return np.asarray((shapes.take(element + index, axis=0) @ amplitude[..., None])[..., 0])

        before = at(first)
        return np.asarray(before + (turn - node) * (at((first + 1) & (n_angles - 1)) - before))


def is_tabulated(core_radius_mm: float, outer_radius_mm: float) -> bool:
    """Whether this is the finger of the table, to 0.02 mm."""
    return max(abs(core_radius_mm - CORE_RADIUS_MM), abs(outer_radius_mm - OUTER_RADIUS_MM)) <= 0.02


def check_tabulated_finger(core_radius_mm: float, outer_radius_mm: float) -> None:
    """Raise `InputError` unless this is the finger of the table."""
    if not is_tabulated(core_radius_mm, outer_radius_mm):
        raise InputError(
            f"finite strain is tabulated for r_a {CORE_RADIUS_MM:g} mm and r_b {OUTER_RADIUS_MM:g} mm alone; "
            f"this finger has {core_radius_mm:g} mm and {outer_radius_mm:g} mm"
        )


@lru_cache(maxsize=3)
def _loaded(measure: Measure) -> FiniteStrainTable:
    with np.load(DATA, allow_pickle=False) as held:
        return FiniteStrainTable(
            load_over_modulus_mm=held["load_over_modulus_mm"],
            radius_mm=held["radius_mm"],
            sensing_radius_mm=held["sensing_radius_mm"],
            amplitudes=held[f"{measure}_amplitudes"],
            shapes=held[f"{measure}_shapes"],
        )


def _knots(solved: FloatArray, scale: float) -> FloatArray:
    return np.linspace(np.log1p(solved[0] / scale), np.log1p(solved[-1] / scale), KNOTS)


def _place(value: ArrayLike, scale: float, knots: FloatArray) -> tuple[NDArray[np.int64], FloatArray]:
    """Knot below and the share of the way to the next."""
    place = (np.log1p(np.maximum(value, 0.0) / scale) - knots[0]) / (knots[1] - knots[0])
    place = np.clip(place, 0.0, len(knots) - 1 - 1e-9)
    row = place.astype(np.int64)
    return row, np.asarray(place - row)
