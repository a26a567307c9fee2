"""Response of each element of a finger over contact width and angle, tabulated.

The table combines contact and body: for one body the strain under a touch of load P depends only on ``κ = P R/μ``
and on the angle between element and touch. One table is used for calibration (known touches) and inference (unknown
touches).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bayestouch.array_types import FloatArray
from bayestouch.body.finger import FingerBody, solve_body
from bayestouch.chain.element_weight import ElementWeight
from bayestouch.contact import contact_model
from bayestouch.errors import InputError

# Strain decays as (r_s/r_b)^k: modes below this fraction of the surface value are omitted.
MODE_TOLERANCE = 1e-7
# Number of knots in log(1 + κ/κ_s): the error of linear interpolation is below 1e-4 of the peak on the paper's
# finger up to P/μ = 5 mm, and up to 5e-4 for a thin layer (r_a/r_b = 0.9) with elements near the surface.
KAPPA_KNOTS = 96


def modes_needed(sensing_radius_mm: float, outer_radius_mm: float) -> int:
    """Highest Fourier mode that is not negligible at the element, from ``(r_s/r_b)^k``."""
    if not 0 < sensing_radius_mm < outer_radius_mm:
        raise InputError("sensing radius must be inside the finger")
    return int(np.ceil(np.log(MODE_TOLERANCE) / np.log(sensing_radius_mm / outer_radius_mm)))


@dataclass(frozen=True, eq=False)
class ContactSpectra:
    """Pressure spectra and solved body for one Poisson's ratio: the part of a table that does not depend on elements.

    Attributes
    ----------
    kappa_scale : float
        ``κ_s`` in mm².
    coordinates : (n,) array
        ``log(1 + κ/κ_s)`` of the knots, equally spaced.
    spectra : (n, n_modes) array
        ``q_k`` at the knots.
    body : FingerBody
        Solved modes of the body.
    """

    kappa_scale: float
    coordinates: FloatArray
    spectra: FloatArray
    body: FingerBody

    @classmethod
    def of(
        cls,
        finger_radii: tuple[float, float],
        poisson_ratio: float,
        *,
        largest_kappa: float,
        largest_sensing_radius_mm: float,
        smallest_kappa: float = 0.0,
        contact: str = "layer",
        knots: int = KAPPA_KNOTS,
    ) -> ContactSpectra:
        """Return the solved contact and body.

        Parameters
        ----------
        finger_radii : (float, float)
            ``r_a`` and ``r_b`` in mm.
        poisson_ratio : float
            σ.
        largest_kappa, smallest_kappa : float
            Ends of the table, mm²; by default it begins at the knife edge.
        largest_sensing_radius_mm : float
            Radius of the element closest to the surface; determines the number of modes.
        contact : str
            Name of the contact model, see `bayestouch.contact.contact_model`.
        knots : int
            Number of knots in κ.
        """
        core, outer = finger_radii
        modes = np.arange(modes_needed(largest_sensing_radius_mm, outer) + 1)
        scale = 0.1 * (outer - core) ** 2
        coordinates = np.linspace(np.log1p(smallest_kappa / scale), np.log1p(largest_kappa / scale), knots)
        kappa = np.expm1(coordinates) * scale
        spectra = contact_model(contact, finger_radii, poisson_ratio).spectrum(kappa, modes)
        body = solve_body(modes, core_radius_mm=core, outer_radius_mm=outer, poisson_ratio=poisson_ratio)
        return cls(scale, coordinates, spectra, body)

    def at(self, kappa: FloatArray, n_modes: int) -> FloatArray:
        """Spectra (t, n_modes + 1) at κ (t,) in mm², linear between knots; beyond the knots that of their end.

        Modes beyond those of the table are zero.
        """
        first, step = self.coordinates[0], self.coordinates[1] - self.coordinates[0]
        place = np.clip((np.log1p(kappa / self.kappa_scale) - first) / step, 0.0, len(self.coordinates) - 1 - 1e-9)
        row = place.astype(np.int64)
        upper = (place - row)[:, None]
        knots = self.spectra[:, : n_modes + 1]
        out = knots[row] + upper * (knots[row + 1] - knots[row])
        return np.pad(out, ((0, 0), (0, n_modes + 1 - knots.shape[1])))


def mode_strain(
    body: FingerBody,
    sensing_radius_mm: ArrayLike,
    *,
    element_weight: ElementWeight | None = None,
    friction: float | FloatArray = 0.0,
) -> NDArray[np.complex128]:
    """Return the radial strain of each element per unit of each mode of the pressure.

    Parameters
    ----------
    body : FingerBody
        The solved body.
    sensing_radius_mm : (..., m) array_like
        Sensing radii ``r_s``.
    element_weight : ElementWeight, optional
        Weight with which the elements average along the arc; by default they are points.
    friction : float or (..., 1, 1) array
        Shear traction towards larger θ, as a fraction of the pressure.

    Returns
    -------
    (..., m, n_modes) complex array
        Under a pressure ``Re p_k exp(ikφ)`` and its friction the strain at angle φ is minus ``Re p_k e_k exp(ikφ)``.
    """
    radii = np.atleast_1d(np.asarray(sensing_radius_mm, dtype=float))
    strain = body.radial_strain(radii).astype(np.complex128)
    if np.any(friction):
        sheared = solve_body(
            body.modes,
            core_radius_mm=body.core_radius_mm,
            outer_radius_mm=body.outer_radius_mm,
            poisson_ratio=body.poisson_ratio,
            traction="tangential",
        )
        # τ_rθ = sin kφ causes the strain s_k cos kφ; shifted by a quarter wave, cos kφ causes -s_k sin kφ.
        strain -= 1j * friction * sheared.radial_strain(radii)
    if element_weight is not None:
        strain *= element_weight.of_modes(body.modes, radii)
    return strain


@dataclass(frozen=True, eq=False)
class ResponseTable:
    """Strain of each element relative to that under a knife edge directly above it, over (κ, angle).

    Attributes
    ----------
    kappa_scale, coordinates
        As in `ContactSpectra`.
    values, slopes : (n_elements, n, n_angles) arrays
        Relative response, and its derivative times the spacing of the angles.
    peak_strain : (n_elements,) array
        Compressive strain under a knife edge of 1 N/mm directly above the element at μ = 1 MPa (positive if the
        element is compressed).
    """

    kappa_scale: float
    coordinates: FloatArray
    values: FloatArray
    slopes: FloatArray
    peak_strain: FloatArray

    @classmethod
    def of(
        cls,
        spectra: ContactSpectra,
        sensing_radius_mm: ArrayLike,
        *,
        element_weight: ElementWeight | None = None,
        friction: float = 0.0,
    ) -> ResponseTable:
        """Return the table for elements at `sensing_radius_mm` (n_elements,); other parameters as in `mode_strain`."""
        strain = mode_strain(spectra.body, sensing_radius_mm, element_weight=element_weight, friction=friction)
        modes = spectra.body.modes
        # Cubic interpolation in angle, four angles per wave of the highest mode and at least 512: the error is below
        # 1e-5 of the peak on the paper's finger, and at most 3e-5 (129 modes).
        n_angles = 1 << int(np.ceil(np.log2(max(512, 4 * modes[-1]))))
        load = -1 / (2 * np.pi * spectra.body.outer_radius_mm)
        peak = load * (strain[:, 0].real + 2 * strain[:, 1:].real.sum(axis=-1))
        weights = (load / peak)[:, None, None] * strain[:, None, :] * spectra.spectra
        # plain sums over modes: the factors are in the weights, which are far fewer
        values = np.fft.irfft(weights, n=n_angles, norm="forward")
        slopes = np.fft.irfft(2j * np.pi / n_angles * modes * weights, n=n_angles, norm="forward")
        return cls(spectra.kappa_scale, spectra.coordinates, values, slopes, -peak)

    def __call__(self, kappa: ArrayLike, angle: ArrayLike) -> FloatArray:
        """Return the relative response of every element.

        Parameters
        ----------
        kappa : (...,) array_like
            ``P R/μ`` in mm²; 0 is a knife edge. Values beyond the table are replaced by its limits.
        angle : (..., n_elements) array_like
            Angle of the element from the touch, rad.

        Returns
        -------
        (..., n_elements) array
            Response divided by the peak response to a knife edge of the same load.
        """
        n_elements, n_kappa, n_angles = self.values.shape
        first, second = self.coordinates[0], self.coordinates[1]
        place = (np.log1p(np.maximum(kappa, 0.0) / self.kappa_scale) - first) / (second - first)
        place = np.clip(place, 0.0, n_kappa - 1 - 1e-9)
        row = place.astype(np.int64)
        upper = (place - row)[..., None]
        turn = np.asarray(angle) * (n_angles / (2 * np.pi))
        node = np.floor(turn)
        t = turn - node
        left = node.astype(np.int64) & (n_angles - 1)
        right = (left + 1) & (n_angles - 1)
        base = (np.arange(n_elements) * n_kappa + row[..., None]) * n_angles
        values, slopes = self.values.ravel(), self.slopes.ravel()
        # Hermite basis on [0, 1]
        s = 1 - t
        h_left, h_right = s * s * (1 + 2 * t), t * t * (1 + 2 * s)
        d_left, d_right = s * s * t, -t * t * s

        def at(start: NDArray[np.int64]) -> FloatArray:
            i, j = start + left, start + right
            return np.asarray(
                h_left * values.take(i) + h_right * values.take(j) + d_left * slopes.take(i) + d_right * slopes.take(j)
            )

        lower = at(base)
        return np.asarray(lower + upper * (at(base + n_angles) - lower))
