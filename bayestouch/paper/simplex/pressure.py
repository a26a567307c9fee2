"""Strain under touches with known indenter, location and load, from the sum of the Fourier series at each touch."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray
from bayestouch.body.finger import solve_body
from bayestouch.chain.response import modes_needed
from bayestouch.contact import composite_radius, contact_model
from bayestouch.data.averages import TouchMeans
from bayestouch.data.sensor import Finger
from bayestouch.errors import InputError

# Nodes of the polynomial that interpolates contact spectra over σ; its error is below 2e-6.
POISSON_NODES = 0.25 * (1 - np.cos(np.pi * np.arange(13) / 12))


def shallowest_radius(finger: Finger) -> float:
    """Return the largest sensing radius (mm) in a fit: halfway from the design radius to the surface."""
    return 0.5 * (finger.sensing_radius_mm + finger.outer_radius_mm)


@dataclass(frozen=True, eq=False)
class KnownPressure:
    """Fourier series of the pressures of touches with known indenter, location and load.

    Attributes
    ----------
    rows : (t,) bool array
        True for the touches of the means that are used.
    angle_deg, load : (t,) arrays
        Location (degree), load over shear modulus (mm).
    modes, cosine, sine : arrays
        Fourier modes (k,), ``cos kθ_c`` and ``sin kθ_c`` (t, k).
    spectrum : callable
        Function from Poisson's ratio to ``q_k``, (t, k), or to 1 if all touches are knife edges.
    """

    finger: Finger
    rows: NDArray[np.bool_]
    angle_deg: FloatArray
    load: FloatArray
    modes: FloatArray
    cosine: FloatArray
    sine: FloatArray
    spectrum: Callable[[float], FloatArray]

    @classmethod
    def of(cls, means: TouchMeans, finger: Finger, shear_modulus_MPa: float, contact: str | None) -> KnownPressure:
        """Return the pressures of the knife edges or, with a contact model, of every touch with a known indenter."""
        if means.angle_deg is None:
            raise InputError("the simplex fits need angle_deg")
        known = np.isfinite(means.load) & np.isfinite(means.angle_deg)
        radius = means.indenter_radius_mm
        rows = known & (radius == 0 if contact is None else ~np.isnan(radius))
        if not rows.any():
            raise InputError(
                "no touch with a known load and location is a knife edge (indenter_radius_mm = 0)"
                if contact is None
                else "no touch has a known indenter, location and load"
            )
        modes = np.arange(modes_needed(shallowest_radius(finger), finger.outer_radius_mm) + 1.0)
        phase = np.outer(np.radians(means.angle_deg[rows]), modes)
        load = means.load[rows] / 1000 / shear_modulus_MPa
        kappa = load * composite_radius(radius[rows], finger.outer_radius_mm)
        spectrum = _edges if contact is None else _spectra(finger, contact, kappa, modes)
        return cls(finger, rows, means.angle_deg[rows], load, modes, np.cos(phase), np.sin(phase), spectrum)

    def peak_strain(self, poisson_ratio: float, sensing_radius_mm: float) -> float:
        """Return the compressive strain directly under a knife edge with the mean load."""
        finger = self.finger
        strain = solve_body(
            self.modes,
            core_radius_mm=finger.core_radius_mm,
            outer_radius_mm=finger.outer_radius_mm,
            poisson_ratio=poisson_ratio,
        ).radial_strain(sensing_radius_mm)
        series = float(strain[0] + 2 * strain[1:].sum())
        return float(self.load.mean()) / (2 * np.pi * finger.outer_radius_mm) * series

    def strain(self, near: NDArray[np.bool_]) -> Callable[[float, float, float], FloatArray]:
        """Return the compressive strain under the touches `near` as a function of σ, r_s (mm) and θ_s (degree)."""
        finger, cosine, sine = self.finger, self.cosine[near], self.sine[near]
        twice = np.where(self.modes == 0, 1.0, 2.0)
        scale = self.load[near] / (2 * np.pi * finger.outer_radius_mm)

        def of(poisson_ratio: float, sensing_radius_mm: float, angle_deg: float) -> FloatArray:
            body = solve_body(
                self.modes,
                core_radius_mm=finger.core_radius_mm,
                outer_radius_mm=finger.outer_radius_mm,
                poisson_ratio=poisson_ratio,
            )
            weights = twice * body.radial_strain(sensing_radius_mm)
            turn = self.modes * np.radians(angle_deg)
            spectrum = self.spectrum(poisson_ratio)
            pressure = spectrum if np.ndim(spectrum) == 0 else spectrum[near]
            series = (pressure * cosine) @ (weights * np.cos(turn))
            return np.asarray(scale * (series + (pressure * sine) @ (weights * np.sin(turn))))

        return of


def _edges(poisson_ratio: float) -> FloatArray:
    return np.asarray(1.0)


def _spectra(finger: Finger, contact: str, kappa: FloatArray, modes: FloatArray) -> Callable[[float], FloatArray]:
    """Spectra (t, k) as a function of σ, interpolated between the contacts solved at a few values."""
    radii = (finger.core_radius_mm, finger.outer_radius_mm)
    solved = [contact_model(contact, radii, float(node)).spectrum(kappa, modes) for node in POISSON_NODES]
    nodes = np.stack(solved)
    # Barycentric formula at Chebyshev points of the second kind.
    signs = np.where(np.arange(len(nodes)) % 2, -1.0, 1.0)
    signs[[0, -1]] /= 2

    def of(poisson_ratio: float) -> FloatArray:
        distance = poisson_ratio - POISSON_NODES
        if np.any(distance == 0):
            return np.asarray(nodes[int(np.argmin(np.abs(distance)))])
        weights = signs / distance
        return np.asarray(np.tensordot(weights / weights.sum(), nodes, axes=1))

    return of
