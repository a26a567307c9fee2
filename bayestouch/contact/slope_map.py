"""The S map of Nicolson and Fearing (1995), section 2.2: slopes in the contact from pressure coefficients.

``s = S p`` gives the slope ``du_r/ds`` at 4 n_c + 2 points of a contact of given centre and width from
``p = (p_0, p_1^s, p_1^c, …, p_nc^s, p_nc^c)``, compression positive. The paper inverts it by a singular
value decomposition [its reference 11] and does not state two choices, which are made here:

* **Outside the contact.** S alone cannot be inverted: its column of p_0 is zero (a uniform pressure causes no
  slope) and a contact of half-angle β determines well only about ``2 n_c β/π`` of the other coefficients.
  The truncated decomposition selects the pressure of least norm, whose tension outside the contact balances the
  compression inside: the load is zero. Therefore rows "pressure is zero here" are added below S, in the unit
  of pressure (slopes times ``μ/(1-σ)``, as on a half-plane) and weighted like integrals over the
  two regions. Both kinds of rows are then isometries except for the effect of the layer, all singular values are
  within a small factor of each other, and the inverse is well-posed. Equal weight is best: with a larger weight of
  the zero rows the load is too low, with a smaller weight too high (`outside_weight`).
* **Which solution.** The slope determines the pressure only up to that of a flat punch ``1/√(β² - θ²)``, which
  causes no slope. A band-limited series cannot represent its infinite values at the edges, so that least squares
  excludes it: the result is the pressure of smooth contact.

The series ends at n_c although the coefficients of the pressure fall only like ``k^-1.5``, so that convergence is
slow: the error of the load at a given width is 3 % at ``n_c β = 5``, 1.5 % at 10, 0.3 % at 20, 0.05 % at 40.
`bayestouch.contact.layer` is the same contact without this truncation, and much faster; the S map is for other
shapes.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray
from bayestouch.body.finger import surface_displacement_response
from bayestouch.contact.model import checked_body
from bayestouch.errors import InputError

# Singular values below this share of the largest are omitted. With the zero-pressure rows none is; without them the
# smallest is zero up to rounding.
RELATIVE_CUTOFF = 1e-6


@dataclass(frozen=True, eq=False)
class SlopeMap:
    """S map for one contact region on one bonded annulus, at μ = 1 MPa; build it with `for_contact`.

    Attributes
    ----------
    centre_rad, half_angle_rad : float
        Contact location θ_c and half-angle θ_w/2.
    outer_radius_mm, poisson_ratio : float
        ``r_b`` in mm, σ.
    contact_angles : (4 n_c + 2,) array
        Angles of the slopes, rad from the contact's centre: equally spaced, none on the edge.
    slopes : (4 n_c + 2, 2 n_c + 1) array
        S, mm per mm and MPa.
    outside : (8 n_c + 4, 2 n_c + 1) array
        Pressure at equally spaced points outside the contact, per coefficient.
    """

    centre_rad: float
    half_angle_rad: float
    outer_radius_mm: float
    poisson_ratio: float
    contact_angles: FloatArray
    slopes: FloatArray
    outside: FloatArray

    @classmethod
    def for_contact(
        cls,
        coefficients: int,
        *,
        half_angle_rad: float,
        core_radius_mm: float,
        outer_radius_mm: float,
        poisson_ratio: float,
        centre_rad: float = 0.0,
    ) -> SlopeMap:
        """Return the S map for ``n_c = coefficients`` and a contact region; radii in mm, angles in rad.

        Raises
        ------
        InputError
            If contact or body have impossible dimensions, or n_c is too small to resolve the contact
            (``n_c β < 3``).
        """
        checked_body(core_radius_mm, outer_radius_mm, poisson_ratio)
        if not 0 < half_angle_rad < np.pi:
            raise InputError(f"half-angle of the contact must lie between 0 and π, got {half_angle_rad:g}")
        if coefficients * half_angle_rad < 3:
            raise InputError(
                f"{coefficients} Fourier coefficients do not resolve a contact of half-angle "
                f"{half_angle_rad:g} rad; at least {np.ceil(3 / half_angle_rad):g} are needed"
            )
        inside = half_angle_rad * _midpoints(4 * coefficients + 2)
        beyond = np.pi + (np.pi - half_angle_rad) * _midpoints(8 * coefficients + 4)
        modes = np.arange(1, coefficients + 1)
        displacement = surface_displacement_response(
            modes,
            core_radius_mm=core_radius_mm,
            outer_radius_mm=outer_radius_mm,
            poisson_ratio=poisson_ratio,
        )
        gain = modes * displacement / outer_radius_mm
        # u_r = -U_k p_k under pressure, so that p^s sin causes a slope -cos and p^c cos a slope +sin.
        phase = (inside + centre_rad)[:, np.newaxis] * modes
        slopes = _interleaved(0.0, -gain * np.cos(phase), gain * np.sin(phase))
        phase = (beyond + centre_rad)[:, np.newaxis] * modes
        outside = _interleaved(1.0, np.sin(phase), np.cos(phase))
        return cls(centre_rad, half_angle_rad, outer_radius_mm, poisson_ratio, inside, slopes, outside)

    def singular_values(self, outside_weight: float = 1.0) -> FloatArray:
        """Singular values of S with the zero-pressure rows, largest first; weight 0 for S alone."""
        return np.asarray(np.linalg.svd(self._stacked(outside_weight), compute_uv=False))

    def pressure(self, slope: ArrayLike, *, outside_weight: float = 1.0) -> FloatArray:
        """Pressure coefficients p of a contact with given slopes: the truncated singular value inverse.

        Parameters
        ----------
        slope : (4 n_c + 2,) array_like
            ``du_r/ds`` at `contact_angles`.
        outside_weight : float
            Weight of the zero-pressure rows relative to the slope rows; 0 omits them (see the module
            description).

        Returns
        -------
        (2 n_c + 1,) array
            p at μ = 1 MPa (multiply by μ), compression positive.
        """
        wanted = np.zeros(len(self.contact_angles) + len(self.outside))
        wanted[: len(self.contact_angles)] = np.asarray(slope, dtype=float)
        rows = wanted * self._row_weights(outside_weight)
        if outside_weight == 1.0:
            left, values, right = self._decomposed
        else:
            left, values, right = np.linalg.svd(self._stacked(outside_weight), full_matrices=False)
        keep = values > RELATIVE_CUTOFF * values[0]
        return np.asarray(right[keep].T @ (left[:, keep].T @ rows / values[keep]))

    def load_over_modulus(self, pressure: FloatArray) -> float:
        """P/μ in mm for pressure coefficients p."""
        return float(2 * np.pi * self.outer_radius_mm * pressure[0])

    def spectrum(self, pressure: FloatArray) -> FloatArray:
        """Normalised symmetric spectrum ``q_k``, k = 0 … n_c, about the contact's centre."""
        modes = np.arange(1, len(pressure) // 2 + 1)
        phase = modes * self.centre_rad
        cosine = pressure[1::2] * np.sin(phase) + pressure[2::2] * np.cos(phase)
        return np.append(1.0, cosine / (2 * pressure[0]))

    def _row_weights(self, outside_weight: float) -> FloatArray:
        arc, rest = 2 * self.half_angle_rad, 2 * (np.pi - self.half_angle_rad)
        inside = np.sqrt(arc / len(self.contact_angles)) / (1 - self.poisson_ratio)
        outside = outside_weight * np.sqrt(rest / len(self.outside))
        return np.repeat([inside, outside], [len(self.contact_angles), len(self.outside)])

    def _stacked(self, outside_weight: float) -> FloatArray:
        return np.vstack([self.slopes, self.outside]) * self._row_weights(outside_weight)[:, np.newaxis]

    @cached_property
    def _decomposed(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        left, values, right = np.linalg.svd(self._stacked(1.0), full_matrices=False)
        return left, values, right


def _midpoints(count: int) -> FloatArray:
    """Midpoints of `count` equal intervals of -1 … 1."""
    return np.asarray((2 * np.arange(count) + 1) / count - 1)


def _interleaved(mean: float, sine: FloatArray, cosine: FloatArray) -> FloatArray:
    """Matrix with the columns of p in the paper's order: p_0, p_1^s, p_1^c, …"""
    pairs = np.stack([sine, cosine], axis=-1).reshape(len(sine), -1)
    return np.column_stack([np.full(len(sine), mean), pairs])
