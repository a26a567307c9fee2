"""Bonded flat layer (a pad): stress or strain under an elastic layer on a rigid base, away from a touch.

The response at a distance is the Fourier (line load, plane strain) or Hankel (load on a disc) transform of
one transfer function, `bayestouch.body.layer_transfer`. Its half-space part has a closed form; the contribution of
the base is smooth on the scale of the thickness, so that it is tabulated once and interpolated. Compression is
positive.

Typical results: at the base of a pad that is thick enough, the normal stress has almost no negative ring around the
touch (none at σ = 0.46, 4e-4 of the peak at σ = 0.5). Above the base, the normal *strain* of an almost
incompressible layer has a negative ring of 3 to 7 % of the peak, at a little more than one thickness from the load,
because the rubber beside a touch bulges.

Source: K. L. Johnson, Contact Mechanics (1985), chapters 2 to 4 (Flamant, Boussinesq, McEwen), and M. T.
Huber, Annalen der Physik 14 (1904) 153, for the half-space.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import j0, j1

from bayestouch.array_types import FloatArray, FloatOrArray, ObjectArray
from bayestouch.body.half_space import half_space_kernel_1d, half_space_kernel_2d
from bayestouch.body.layer_transfer import (
    Quantity,
    check_layer,
    combine,
    hertz_spectrum,
    layer_surface_compliance,
    layer_transfer,
    reflected_stress,
)

__all__ = [
    "EXTENT",
    "half_space_kernel_1d",
    "half_space_kernel_2d",
    "layer_kernel_1d",
    "layer_kernel_2d",
    "layer_surface_compliance",
    "layer_transfer",
]

EXTENT = 32.0
"""Kernels are zero beyond this many thicknesses from the load; there they have decayed by exp(-0.74 * 32), 1e-10."""
#: Points of the table over arcsinh(ρ/2h), and their spacing: cubic interpolation errs by less than 2e-8 of the peak.
GRID = 400
_STEP = float(np.arcsinh(EXTENT / 2)) / (GRID - 1)
#: Highest frequency ξh of the table.
HIGHEST = 34.0
#: Frequencies at which a spectrum is computed. Loads that are wider than `WIDE_LOAD` thicknesses have spectra that
#: oscillate faster, and need more. Both err by less than 1e-11 of the peak (loads up to 20 thicknesses).
NODES, WIDE_LOAD, NODES_OF_WIDE_LOAD = 128, 4.0, 512


def layer_kernel_2d(
    rho_mm: ArrayLike,
    thickness_mm: FloatOrArray,
    poisson_ratio: FloatOrArray,
    indenter_radius_mm: FloatOrArray = 0.0,
    depth_mm: FloatOrArray | None = None,
    quantity: Quantity = "normal_stress",
) -> FloatArray:
    """Response of a bonded layer (a pad) at a distance from a unit load (1 N).

    Each parameter may be an array (n,) with the values of n layers: the distances then have n as their first axis.
    Many layers take much less time together than one by one.

    Parameters
    ----------
    rho_mm : array_like
        Distance between element and load in the plane, mm; also for a line of elements touched by a ball.
    thickness_mm : float or (n,) array
        Layer thickness h, mm; the number ``inf`` is the half-space, which needs a depth.
    poisson_ratio : float or (n,) array
        σ, above -1 and at most 0.5.
    indenter_radius_mm : float or (n,) array
        Radius of the disc that the Hertz pressure acts on, mm; 0 is a point load. It is the radius of the contact,
        not of the ball. If it is much smaller than the depth, it has almost no influence at the base.
    depth_mm : float or (n,) array, optional
        Depth of the elements below the surface, mm; the base by default.
    quantity : {"normal_stress", "mean_stress", "normal_strain"}
        Quantity that an element measures, as in `layer_transfer`; the three are proportional at the base.

    Returns
    -------
    array of the shape of `rho_mm`
        Compression positive, MPa per N (1/mm²); the strain at μ = 1 MPa. Zero beyond ``EXTENT`` thicknesses.

    Raises
    ------
    InputError
        If thickness, depth, load radius or Poisson's ratio are out of range.
    """
    return _kernel(2, rho_mm, thickness_mm, poisson_ratio, indenter_radius_mm, depth_mm, quantity)


def layer_kernel_1d(
    x_mm: ArrayLike,
    thickness_mm: FloatOrArray,
    poisson_ratio: FloatOrArray,
    indenter_radius_mm: FloatOrArray = 0.0,
    depth_mm: FloatOrArray | None = None,
    quantity: Quantity = "normal_stress",
) -> FloatArray:
    """Response of a bonded layer at a distance from a unit *line* load (1 N/mm, plane strain), 1/mm.

    As `layer_kernel_2d`, for a touch that is long across the line of elements; `indenter_radius_mm` is the
    half-width of its contact.
    """
    return _kernel(1, x_mm, thickness_mm, poisson_ratio, indenter_radius_mm, depth_mm, quantity)


def _kernel(
    dimensions: int,
    distance_mm: ArrayLike,
    thickness_mm: FloatOrArray,
    poisson_ratio: FloatOrArray,
    load_radius_mm: FloatOrArray,
    depth_mm: FloatOrArray | None,
    quantity: Quantity,
) -> FloatArray:
    depth = check_layer(thickness_mm, poisson_ratio, depth_mm)
    distance = np.asarray(distance_mm, dtype=float)
    half_space = half_space_kernel_1d if dimensions == 1 else half_space_kernel_2d
    given = (depth, load_radius_mm, poisson_ratio, thickness_mm)
    z, a, sigma, h = (over_first(each, distance) if np.ndim(each) else each for each in given)
    direct = half_space(distance, z, a, poisson_ratio=sigma, quantity=quantity)
    if np.ndim(h) == 0 and np.isinf(h):
        return direct
    layers = (poisson_ratio, np.divide(depth, thickness_mm), np.divide(load_radius_mm, thickness_mm))
    if all(np.ndim(each) == 0 for each in layers):
        reflection = _reflection(dimensions, *(float(each) for each in layers), quantity)
    else:
        reflection = _Reflection.of(dimensions, quantity, *np.broadcast_arrays(*layers))
    return reflection.added_to(direct, distance, h)


def over_first(values: ArrayLike, distance: FloatArray) -> ObjectArray:
    """Values (n,), one for each of the first axis, in a shape that broadcasts with distances (n, ...)."""
    return np.reshape(values, (-1,) + (1,) * (distance.ndim - 1))


@dataclass(frozen=True)
class _Reflection:
    """Contribution of the base to the half-space response, tabulated over distance divided by thickness.

    Attributes
    ----------
    dimensions : int
        1 for a line load, 2 for a load on a disc.
    values, slopes : (n, GRID) arrays
        Contribution on the grid of `_transform` for each of n layers, and its derivative times the spacing of the grid.
    """

    dimensions: int
    values: FloatArray
    slopes: FloatArray

    @classmethod
    def of(
        cls, dimensions: int, quantity: Quantity, poisson_ratio: FloatArray, depth: FloatArray, load_radius: FloatArray
    ) -> _Reflection:
        """Tables of n layers; Poisson's ratio, and depth and load radius divided by the thickness, are (n,)."""
        xi, transform = _transform(dimensions, NODES if load_radius.max() <= WIDE_LOAD else NODES_OF_WIDE_LOAD)
        sigma = poisson_ratio[:, None]
        reflected = combine(*reflected_stress(xi, 1.0, depth[:, None], sigma), sigma, quantity)
        spectra = reflected * hertz_spectrum(xi * load_radius[:, None], dimensions)
        return cls(dimensions, spectra @ transform[:GRID].T, spectra @ transform[GRID:].T)

    def added_to(self, direct: FloatArray, distance_mm: FloatArray, thickness_mm: FloatOrArray) -> FloatArray:
        distance = np.abs(distance_mm) / thickness_mm
        added = self._at(np.minimum(np.arcsinh(distance / 2) / _STEP, GRID - 1.0)) / thickness_mm**self.dimensions
        # The base cancels the power-law tail of the half-space: beyond the table their sum is zero.
        return np.asarray(np.where(distance > EXTENT, 0.0, direct + added))

    def _at(self, place: FloatArray) -> FloatArray:
        """Cubic interpolation at places in steps of the grid, by values and slopes at both ends (Hermite).

        The places are (n, ...), or of any shape for one layer.
        """
        left = np.minimum(place.astype(np.intp), GRID - 2)
        t = place - left
        s = 1 - t
        if len(self.values) > 1:
            left += over_first(GRID * np.arange(len(self.values)), place)
        by_values = s * s * (1 + 2 * t) * self.values.take(left) + t * t * (1 + 2 * s) * self.values.take(left + 1)
        return np.asarray(by_values + s * t * (s * self.slopes.take(left) - t * self.slopes.take(left + 1)))


@lru_cache(maxsize=64)
def _reflection(
    dimensions: int, poisson_ratio: float, depth: float, load_radius: float, quantity: Quantity
) -> _Reflection:
    layer = np.array([[poisson_ratio], [depth], [load_radius]])
    return _Reflection.of(dimensions, quantity, *layer)


@lru_cache(maxsize=4)
def _transform(dimensions: int, n: int) -> tuple[FloatArray, FloatArray]:
    """Frequencies ξh (n,), and the matrix (2 GRID, n) that turns a spectrum at these into a `_Reflection`.

    The reflected part decays as ξ² exp(-ξ(2h - z)), at least as fast as ξ² exp(-ξh): at `HIGHEST` it is below 1e-11.
    Divided by this decay it is a polynomial of √ξ, which its values at n Chebyshev nodes determine. The polynomial is
    integrated with 900 Gauss-Legendre nodes: these resolve the phase of 34 * 32 rad (π nodes per cycle are needed).
    The grid is even in arcsinh(ρ/2h).
    """
    nodes, weights = np.polynomial.legendre.leggauss(900)
    xi, weights = 0.5 * HIGHEST * (nodes + 1), 0.5 * HIGHEST * weights
    grid = _STEP * np.arange(GRID)
    distance, slope = 2 * np.sinh(grid), 2 * np.cosh(grid) * _STEP
    phase = np.outer(distance, xi)
    if dimensions == 1:
        waves, falls, weights = np.cos(phase), -np.sin(phase), weights / np.pi
    else:
        waves, falls, weights = np.asarray(j0(phase)), -np.asarray(j1(phase)), weights * xi / (2 * np.pi)
    integral = np.concatenate([waves, slope[:, None] * falls * xi]) * weights
    angle = np.pi * (np.arange(n) + 0.5) / n
    root = 0.5 * (1 - np.cos(angle))
    known = HIGHEST * root**2
    # Lagrange's polynomials in their barycentric form; no two nodes of the two rules are the same.
    share = (-1.0) ** np.arange(n) * np.sin(angle) / (np.sqrt(xi / HIGHEST)[:, None] - root)
    share /= share.sum(axis=1, keepdims=True)
    return known, integral @ (share * _decay(xi)[:, None] / _decay(known))


def _decay(xi: FloatArray) -> FloatArray:
    return np.asarray((1 + xi**2) * np.exp(-xi))
