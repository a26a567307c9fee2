"""Nonlinear part of the response of the paper's finger at large strain, from a finite-element table.

At the paper's load the strain of its soft rubber is 10 % and more, so that a linear model is a first approximation.
The table contains the difference between a neo-Hookean annulus (``W = μ/2 (F:F - 3) - μ ln J + λ/2 (ln J)²``, σ = 0.46,
plane strain, bonded core, no friction, true circles) and the linear chain (parabola on the layer) at the same load
and radius. It depends only on ``P/μ``, R and r_s. `studies/finite_strain_table.py` computes it and describes its
convergence.

The indenter is a right-angled wedge with a round nose; with blunt tips only the nose touches. The paper's edge, a 90°
corner, is the wedge with the smallest nose that was solved (0.1 mm), and is used for R = 0. Under an ideal line load
the displacement is not finite, so that it cannot be compared.

An element can measure one of two strains: ``projected``, ``e_r·F e_r - 1`` (the change of distance from the core along
the original radius, as a capacitor over a rigid core measures it), or ``stretch``, ``|F e_r| - 1`` (the change of
length of a radial line). They differ by half the square of the shear, which is large near the bond. The third table,
``stuck``, contains projected strains under a tip to which the rubber sticks at the point of first contact.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bayestouch.array_types import FloatArray
from bayestouch.errors import InputError

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

Measure = Literal["projected", "stretch", "stuck"]

MEASURES: tuple[Measure, ...] = ("projected", "stretch", "stuck")
DATA = Path(__file__).parent / "data" / "finite_strain.npz"
CORE_RADIUS_MM, OUTER_RADIUS_MM, POISSON_RATIO = 9.4, 12.7, 0.46
# Numbers of knots and angles for linear interpolation: its error is 3e-4 of the peak.
KNOTS, ANGLES = 48, 1024
LOAD_SCALE_MM, RADIUS_SCALE_MM = 1.0, 1.0


@dataclass(frozen=True, eq=False)
class FiniteStrainTable:
    """Nonlinear part of the response as a sum of shapes over angle and depth, ``D = Σ_j a_j(P/μ, R) D_j(r_s, φ)``.

    Attributes
    ----------
    load_over_modulus_mm : (p,) array
        P/μ, from 0.
    radius_mm : (q,) array
        Composite radii R; the first is for the paper's edge.
    sensing_radius_mm : (s,) array
        Sensing radii r_s, core first.
    amplitudes : (p, q, n) array
        ``a_j``; zero at zero load.
    shapes : (n, s, k) array
        Cosine coefficients of ``D_j(φ) = c_0 + 2 Σ c_k cos kφ``. D is the nonlinear part of the
        response at angle φ from the touch, divided by the linear peak response to a knife edge of the same load.
    """

    load_over_modulus_mm: FloatArray
    radius_mm: FloatArray
    sensing_radius_mm: FloatArray
    amplitudes: FloatArray
    shapes: FloatArray

    @classmethod
    def load(cls, measure: Measure = "projected") -> FiniteStrainTable:
        """Return the table of the package for the strain that the elements measure."""
        if measure not in MEASURES:
            raise InputError(f"unknown measure of strain {measure!r}; expected one of {', '.join(MEASURES)}")
        return _loaded(measure)

    @property
    def coefficients(self) -> FloatArray:
        """Cosine coefficients of the nonlinear part, (p, q, s, k)."""
        return np.tensordot(self.amplitudes, self.shapes, 1)

    @cached_property
    def knots(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Knots in ``log(1 + P/μ)`` and in ``log(1 + R)``, and the amplitudes at them from cubic splines."""
        from scipy.interpolate import CubicSpline

        load, radius = _knots(self.load_over_modulus_mm, LOAD_SCALE_MM), _knots(self.radius_mm, RADIUS_SCALE_MM)
        at = CubicSpline(self.load_over_modulus_mm, self.amplitudes, axis=0)(np.expm1(load) * LOAD_SCALE_MM)
        return load, radius, CubicSpline(self.radius_mm, at, axis=1)(np.expm1(radius) * RADIUS_SCALE_MM)

    @cached_property
    def by_depth(self) -> CubicSpline:
        """Shapes as a function of the sensing radius."""
        from scipy.interpolate import CubicSpline

        return CubicSpline(self.sensing_radius_mm, self.shapes, axis=1)

    def for_elements(self, sensing_radius_mm: ArrayLike) -> FiniteStrainResponse:
        """Return the interpolator for elements at `sensing_radius_mm` (m,).

        Raises
        ------
        InputError
            If an element is outside the tabulated radii.
        """
        radii = np.atleast_1d(np.asarray(sensing_radius_mm, dtype=float))
        low, high = self.sensing_radius_mm[0], self.sensing_radius_mm[-1]
        if not np.all((radii >= low) & (radii <= high)):
            raise InputError(f"finite strain is tabulated for sensing radii from {low:g} to {high:g} mm")
        return _of_elements(self, radii.tobytes())


@dataclass(frozen=True, eq=False)
class FiniteStrainResponse:
    """Nonlinear part of the response of every element, interpolated linearly in load, radius and angle.

    Attributes
    ----------
    loads, radii : (a,), (b,) arrays
        Knots, equally spaced in ``log(1 + P/μ)`` and ``log(1 + R)`` (mm).
    amplitudes : (a, b, n) array
        Amplitudes of the shapes.
    shapes : (m, n_angles, n) array
        Shapes over the angle for each element.
    """

    loads: FloatArray
    radii: FloatArray
    amplitudes: FloatArray
    shapes: FloatArray

    def __call__(self, load_over_modulus_mm: ArrayLike, radius_mm: ArrayLike, angle: ArrayLike) -> FloatArray:
        """Return the nonlinear part divided by the linear peak response to a knife edge of the same load.

        Parameters
        ----------
        load_over_modulus_mm, radius_mm : (...,) array_like
            P/μ and R in mm; values beyond the table are replaced by its limits.
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


# A fit evaluates many loads, angles and moduli with the same depths.
@lru_cache(maxsize=4)
def _of_elements(table: FiniteStrainTable, radii: bytes) -> FiniteStrainResponse:
    shapes = np.moveaxis(np.fft.irfft(table.by_depth(np.frombuffer(radii)), n=ANGLES) * ANGLES, 0, -1)
    return FiniteStrainResponse(*table.knots, np.ascontiguousarray(shapes))


def is_tabulated(core_radius_mm: float, outer_radius_mm: float) -> bool:
    """Return True if both radii are those of the tabulated finger, to 0.02 mm."""
    return max(abs(core_radius_mm - CORE_RADIUS_MM), abs(outer_radius_mm - OUTER_RADIUS_MM)) <= 0.02


def check_tabulated_finger(core_radius_mm: float, outer_radius_mm: float) -> None:
    """Raise `InputError` if the radii are not those of the tabulated finger."""
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
    """Index of the knot below each value, and the fraction of the interval to the next knot."""
    place = (np.log1p(np.maximum(value, 0.0) / scale) - knots[0]) / (knots[1] - knots[0])
    place = np.clip(place, 0.0, len(knots) - 1 - 1e-9)
    row = place.astype(np.int64)
    return row, np.asarray(place - row)
