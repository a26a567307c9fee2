"""Fits of touches by an elliptic pressure, to first order in errors of the strains; and what a contact is read as.

Strains are in % of each element's peak under an edge. The contact's width is turned into R exactly, and no contact is
narrower than an edge.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from bayestouch.body.annulus import solve_annulus
from bayestouch.contact.hertz import elliptic_spectrum
from bayestouch.paper.published import number
from nicolson_fearing.paper_finger import DESIGN, POISSON_RATIO
from nicolson_fearing.paper_physics import Physics, contact_of
from nicolson_fearing.unknowns import POISSON_RATIOS, Unknowns

FloatArray = NDArray[np.float64]

MODES = np.arange(71)
R_A, R_B = DESIGN.core_radius_mm, DESIGN.outer_radius_mm
LOAD = number("touches.load").value
PER_KAPPA = 2 * (1 - POISSON_RATIO) / np.pi
"""Square of Hertz's half-width over κ."""
SLOPE_FROM_MM = 0.1  # a sharper tip has no slope on both sides; its R² is nothing beside
LARGEST_KAPPA, KAPPAS = 80.0, 60  # mm²: a flat at 0.032 MPa


@dataclass(frozen=True, eq=False)
class Estimates:
    """Fits of touches with both calibrations (model, empirical): (2, tips, places) of averages, or (…, samples).

    Attributes
    ----------
    angle_error_deg, load_error : arrays
        Errors of θ_c and P (N/m).
    width_mm, load : arrays
        Half-width of the best elliptic pressure (mm) and P (N/m).
    """

    angle_error_deg: FloatArray
    load_error: FloatArray
    width_mm: FloatArray
    load: FloatArray

    def radius_mm(self, modulus_MPa: float, squeeze_mm: float) -> FloatArray:
        """R by Hertz, squeezed by a width; at most that of a flat."""
        kappa = (self.width_mm + squeeze_mm) ** 2 / PER_KAPPA
        return np.asarray(np.minimum(kappa * modulus_MPa / (self.load / 1000), R_B))


@dataclass(frozen=True, eq=False)
class TouchFits:
    """Fits of tips at places.

    Attributes
    ----------
    kappa, factor : (tips,) arrays
        κ (mm²) of the ellipse that is found without errors, and its load over the true one.
    spectrum : (tips, modes) array
        Of its pressure.
    solve : (tips, places, 3, m) array
        Changes of θ_c (degree), P (N/m) and κ by strains in % of the peak.
    held : (tips, places, 3) array
        Changes for a unit by which κ is held back.
    """

    kappa: FloatArray
    factor: FloatArray
    spectrum: FloatArray
    solve: FloatArray
    held: FloatArray

    @classmethod
    def of(cls, weights: FloatArray, turns: list[FloatArray], width: FloatArray, factor: FloatArray) -> TouchFits:
        """Derivatives at ellipses of these widths (mm); turns are cos and sin of each mode, (places, m, modes)."""
        kappa = width**2 / PER_KAPPA
        step = 1e-3
        spectrum = elliptic_spectrum(width / R_B, MODES)
        by_kappa = (elliptic_spectrum(np.sqrt(PER_KAPPA * (kappa + step)) / R_B, MODES) - spectrum) / step
        cos, sin = turns
        load = 100.0 * factor[:, None, None]
        even, odd = cos * weights, sin * (weights * MODES)
        slopes = [
            -load * felt(odd, spectrum) * np.pi / 180,
            felt(even, spectrum) * 100 / LOAD,
            load * felt(even, by_kappa),
        ]
        jacobian = np.stack(slopes, axis=-1)
        inverse = np.linalg.inv(np.swapaxes(jacobian, -1, -2) @ jacobian)
        solve = inverse @ np.swapaxes(jacobian, -1, -2)
        return cls(kappa, factor, spectrum, solve, inverse[..., 2] / inverse[..., 2, 2, None])

    def only(self, tips: NDArray[np.bool_]) -> TouchFits:
        """Some of the tips."""
        return TouchFits(self.kappa[tips], self.factor[tips], self.spectrum[tips], self.solve[tips], self.held[tips])

    def fit(self, errors: FloatArray, jitter: FloatArray) -> Estimates:
        """Estimates from errors of the strains (2, tips, places[, samples], m); jitter is a factor of all strains."""
        path = "tpji,ctpi->ctpj" if errors.ndim == 4 else "tpji,ctpsi->ctpsj"
        found = np.einsum(path, self.solve, errors)
        more = (1,) * (errors.ndim - 4)
        kappa = self.kappa.reshape(-1, 1, *more)
        beyond = np.minimum(kappa + found[..., 2], 0.0)
        found = found - beyond[..., None] * self.held.reshape(*self.held.shape[:2], *more, 3)
        load = LOAD * self.factor.reshape(-1, 1, *more) + found[..., 1]
        load = load * (1 + jitter)
        width = np.sqrt(PER_KAPPA * np.maximum(kappa + found[..., 2], 0.0))
        return Estimates(found[..., 0], load - LOAD, width, load)


def felt(by_mode: FloatArray, spectrum: FloatArray) -> FloatArray:
    """Sum over modes of (places, m, modes) under the pressure of each tip: (tips, places, m)."""
    flat = by_mode.reshape(-1, len(MODES)) @ spectrum.T
    return np.ascontiguousarray(flat.T).reshape(len(spectrum), *by_mode.shape[:2])


def element_weights(sensing_radius_mm: FloatArray, poisson_ratio: float) -> FloatArray:
    """Response to each mode of the pressure, one right under an edge; (m, modes)."""
    solved = solve_annulus(MODES, core_radius_mm=R_A, outer_radius_mm=R_B, poisson_ratio=poisson_ratio)
    strain = np.where(MODES == 0, 1.0, 2.0) * solved.radial_strain(sensing_radius_mm)
    return np.asarray(strain / strain.sum(axis=1, keepdims=True))


@lru_cache(maxsize=24)
def _ellipses(
    poisson_ratio: float, length_mm: float, core_radius_mm: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """κ, half-width and load of the ellipse that reads most like the contact on the layer."""
    physics = Physics(poisson_ratio=poisson_ratio, length_mm=length_mm)
    kappa = np.linspace(0.0, np.sqrt(LARGEST_KAPPA), KAPPAS) ** 2
    true = contact_of(replace(DESIGN, core_radius_mm=core_radius_mm), physics).spectrum(kappa, MODES)
    # elements and places are spread evenly, so that the sum over them is one over modes
    power = element_weights(np.array([DESIGN.sensing_radius_mm]), POISSON_RATIO)[0] ** 2 * np.where(
        MODES == 0, 1.0, 0.5
    )
    widths = np.linspace(0.0, 1.1 * np.sqrt(PER_KAPPA * kappa[-1]), 4000)
    tried = elliptic_spectrum(widths / R_B, MODES)
    along, square = true @ (power * tried).T, (power * tried**2).sum(axis=1)
    best = (along**2 / square).argmax(axis=1)
    return kappa, widths[best], along[np.arange(KAPPAS), best] / square[best]


def best_ellipse(
    kappa: FloatArray, poisson_ratio: float, length_mm: float, core_radius_mm: float = R_A
) -> tuple[FloatArray, FloatArray]:
    """Half-width (mm) and load (1: the true one) of the elliptic pressure that fits the contact on the layer best.

    Between a few Poisson's ratios by interpolation. A larger core has a thinner layer.
    """
    place = np.interp(poisson_ratio, POISSON_RATIOS, np.arange(len(POISSON_RATIOS)))
    low = min(int(place), len(POISSON_RATIOS) - 2)
    out = []
    for ratio in POISSON_RATIOS[low : low + 2]:
        known, width, load = _ellipses(ratio, length_mm, core_radius_mm)
        out.append([np.interp(np.sqrt(kappa), np.sqrt(known), each) for each in (width, load)])
    upper = place - low
    width, load = (1 - upper) * np.array(out[0]) + upper * np.array(out[1])
    return width, load


def read_slopes(unknowns: Unknowns, true_mm: FloatArray) -> FloatArray:
    """Change of the composite radius that is read by Hertz, and by the squeezed contact, by the true one; (2, n)."""
    step = 0.05
    read = []
    for radius in (true_mm - step, true_mm + step):
        kappa = LOAD / 1000 * radius / unknowns.modulus_MPa
        width, factor = best_ellipse(kappa, unknowns.poisson_ratio, unknowns.length_mm)
        load = LOAD / 1000 * factor
        read.append([(width + s) ** 2 / PER_KAPPA * unknowns.modulus_MPa / load for s in (0.0, unknowns.squeeze_mm)])
    return np.asarray((np.array(read[1]) - np.array(read[0])) / (2 * step))


def read_by_curvature(unknowns: Unknowns, true_mm: FloatArray, per_mm: FloatArray) -> FloatArray:
    """Errors of the R that both contact models read if the surface adds to 1/R at places; (2, tips, places), mm.

    To first order: R changes by ``-R²`` times the curvature, and what is read with it.
    """
    slopes = read_slopes(unknowns, np.maximum(true_mm, SLOPE_FROM_MM))
    return np.asarray(-(slopes * true_mm**2)[..., None] * per_mm)
