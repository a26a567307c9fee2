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
change of length of a radial line). They differ by half the square of the shear, which is large near the bond.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bayestouch.errors import InputError

FloatArray = NDArray[np.float64]
Measure = Literal["projected", "stretch"]

MEASURES: tuple[Measure, Measure] = ("projected", "stretch")
DATA = Path(__file__).parent / "data" / "finite_strain.npz"
CORE_RADIUS_MM, OUTER_RADIUS_MM, POISSON_RATIO = 9.4, 12.7, 0.46
# Knots between which responses are linear: 2e-4 of the peak from the spline through the solved ones.
KNOTS, ANGLES = 24, 256
LOAD_SCALE_MM, RADIUS_SCALE_MM = 1.0, 1.0


@dataclass(frozen=True, eq=False)
class FiniteStrainTable:
    """Cosine coefficients of the added response.

    Attributes
    ----------
    load_over_modulus_mm : (p,) array
        P/μ, from 0.
    radius_mm : (q,) array
        Composite radii R; the first is the paper's edge.
    sensing_radius_mm : (s,) array
        Sensing radii r_s, core first.
    coefficients : (p, q, s, k) array
        ``D(φ) = c_0 + 2 Σ c_k cos kφ``: response at φ from the touch that finite strain adds, over the linear peak
        response to a knife edge of the same load. Zero at no load.
    """

    load_over_modulus_mm: FloatArray
    radius_mm: FloatArray
    sensing_radius_mm: FloatArray
    coefficients: FloatArray

    @classmethod
    def load(cls, measure: Measure = "projected") -> FiniteStrainTable:
        """The shipped table, for what the elements read."""
        if measure not in MEASURES:
            raise InputError(f"unknown measure of strain {measure!r}; expected one of {', '.join(MEASURES)}")
        return _loaded(measure)

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
        at = CubicSpline(self.sensing_radius_mm, self.coefficients, axis=2)(radii)
        load, radius = _knots(self.load_over_modulus_mm, LOAD_SCALE_MM), _knots(self.radius_mm, RADIUS_SCALE_MM)
        at = CubicSpline(self.load_over_modulus_mm, at, axis=0)(np.expm1(load) * LOAD_SCALE_MM)
        at = CubicSpline(self.radius_mm, at, axis=1)(np.expm1(radius) * RADIUS_SCALE_MM)
        modes = np.arange(at.shape[-1])
        by_element = np.moveaxis(at, 2, 0)
        return FiniteStrainResponse(
            load,
            radius,
            np.fft.irfft(by_element, n=ANGLES) * ANGLES,
            np.fft.irfft(1j * modes * by_element, n=ANGLES) * (2 * np.pi),
        )


@dataclass(frozen=True, eq=False)
class FiniteStrainResponse:
    """Added response of every element: linear between knots of load and radius, cubic in angle.

    Attributes
    ----------
    loads, radii : (a,), (b,) arrays
        Knots, equally spaced in ``log(1 + P/μ)`` and ``log(1 + R)`` (mm).
    values, slopes : (m, a, b, n_angles) arrays
        Added response, and its derivative times the spacing of the angles.
    """

    loads: FloatArray
    radii: FloatArray
    values: FloatArray
    slopes: FloatArray

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
        m, n_loads, n_radii, n_angles = self.values.shape
        row, up = _place(load_over_modulus_mm, LOAD_SCALE_MM, self.loads)
        column, right = _place(radius_mm, RADIUS_SCALE_MM, self.radii)
        turn = np.asarray(angle, dtype=float) * (n_angles / (2 * np.pi))
        node = np.floor(turn)
        t = turn - node
        first = node.astype(np.int64) & (n_angles - 1)
        second = (first + 1) & (n_angles - 1)
        s = 1 - t
        weights = (s * s * (1 + 2 * t), t * t * (1 + 2 * s), s * s * t, -t * t * s)
        values, slopes = self.values.ravel(), self.slopes.ravel()
        base = ((np.arange(m) * n_loads + row[..., None]) * n_radii + column[..., None]) * n_angles

        def at(start: NDArray[np.int64]) -> FloatArray:
            i, j = start + first, start + second
            return np.asarray(
                weights[0] * values.take(i)
                + weights[1] * values.take(j)
                + weights[2] * slopes.take(i)
                + weights[3] * slopes.take(j)
            )

        up, right = up[..., None], right[..., None]
        below, above = base, base + n_radii * n_angles
        lower = (1 - right) * at(below) + right * at(below + n_angles)
        upper = (1 - right) * at(above) + right * at(above + n_angles)
        return np.asarray((1 - up) * lower + up * upper)


def finite_strain_correction(
    load_over_modulus_mm: ArrayLike,
    radius_mm: ArrayLike,
    angle: ArrayLike,
    sensing_radius_mm: ArrayLike,
    *,
    measure: Measure = "projected",
) -> FloatArray:
    """Response that finite strain adds, over the linear peak response to a knife edge of the same load.

    Parameters
    ----------
    load_over_modulus_mm, radius_mm : (...,) array_like
        P/μ and composite radius R, mm.
    angle : (..., m) array_like
        Angle of each element from the touch, rad.
    sensing_radius_mm : (m,) array_like
        ``r_s``, mm.
    measure : {"projected", "stretch"}
        What the elements read, see the module.

    Returns
    -------
    (..., m) array
        To be added to `bayestouch.chain.response.ResponseTable`; zero without load.
    """
    return FiniteStrainTable.load(measure).for_elements(sensing_radius_mm)(load_over_modulus_mm, radius_mm, angle)


def check_finger(core_radius_mm: float, outer_radius_mm: float, poisson_ratio: float) -> None:
    """Raise `InputError` unless this is the finger of the table (radii to 0.02 mm, σ from 0.40 to 0.49)."""
    off = max(abs(core_radius_mm - CORE_RADIUS_MM), abs(outer_radius_mm - OUTER_RADIUS_MM))
    if off > 0.02 or not 0.40 <= poisson_ratio <= 0.49:
        raise InputError(
            f"finite strain is tabulated for r_a {CORE_RADIUS_MM:g} mm, r_b {OUTER_RADIUS_MM:g} mm and σ "
            f"{POISSON_RATIO:g} alone; this finger has {core_radius_mm:g} mm, {outer_radius_mm:g} mm and "
            f"{poisson_ratio:g}"
        )


@lru_cache(maxsize=2)
def _loaded(measure: Measure) -> FiniteStrainTable:
    with np.load(DATA, allow_pickle=False) as held:
        scale = held[f"{measure}_scale"]
        return FiniteStrainTable(
            held["load_over_modulus_mm"],
            held["radius_mm"],
            held["sensing_radius_mm"],
            held[measure].astype(float) * scale,
        )


def _knots(solved: FloatArray, scale: float) -> FloatArray:
    return np.linspace(np.log1p(solved[0] / scale), np.log1p(solved[-1] / scale), KNOTS)


def _place(value: ArrayLike, scale: float, knots: FloatArray) -> tuple[NDArray[np.int64], FloatArray]:
    """Knot below and the share of the way to the next."""
    place = (np.log1p(np.maximum(value, 0.0) / scale) - knots[0]) / (knots[1] - knots[0])
    place = np.clip(place, 0.0, len(knots) - 1 - 1e-9)
    row = place.astype(np.int64)
    return row, np.asarray(place - row)
