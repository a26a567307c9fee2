"""The touches of Table 3, simulated, calibrated and fitted: what every contact model then makes of them.

A contact model with an elliptic pressure (Hertz, or a Hertz pressure squeezed) has one shape: its half-width. The
width, location and load that fit a touch best do not depend on how the model goes from width to radius, so that one fit
serves all models that differ in that alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bayestouch.contact import composite_radius, contact_model, indenter_radius
from bayestouch.simulation.finger import REFERENCE_LOAD
from nicolson_fearing.many_fits import fit_many_touches
from nicolson_fearing.paper_finger import (
    CALIBRATIONS,
    DESIGN,
    LOCATIONS_DEG,
    MISFIT_PERCENT,
    POISSON_RATIO,
    TIPS_MM,
    PaperFinger,
    averaged_noise,
    model_error,
)
from nicolson_fearing.paper_physics import Physics, TrueFinger

FloatArray = NDArray[np.float64]

R_B = DESIGN.outer_radius_mm
RADII = (DESIGN.core_radius_mm, R_B)
HERTZ = contact_model("hertz", RADII, POISSON_RATIO)
# Of √κ, between which the half-width is linear: it is nearly in proportion.
WIDTH_KNOTS = 4000


class WidthModel(Protocol):
    """A contact model whose pressure is an ellipse."""

    def half_width(self, kappa: ArrayLike) -> FloatArray:
        """Half-width in mm for κ = ``P R/μ`` in mm²."""
        ...


@dataclass(frozen=True, eq=False)
class SimulatedFits:
    """Best elliptic pressures at k moduli: n simulated tables of both calibrations (model, empirical).

    Attributes
    ----------
    moduli_MPa : (k,) array
        μ.
    half_width_mm, load : (k, n, 2, tips, locations) arrays
        Of the pressure (mm), and P (N/m).
    elements : (k, 3) array
        Means over elements and fingers of what Table 1 fits: σ, r_s (mm) and the error (% of the peak).
    read_with_MPa : (k,) array
        μ by which readers turn widths into radii; the true one unless told otherwise.
    """

    moduli_MPa: FloatArray
    half_width_mm: FloatArray
    load: FloatArray
    elements: FloatArray
    read_with_MPa: FloatArray

    def read_with(self, shear_modulus_MPa: float) -> SimulatedFits:
        """The same touches read with one modulus, whatever the rubber's."""
        return replace(self, read_with_MPa=np.full(len(self.moduli_MPa), shear_modulus_MPa))

    def radii(self, reader: WidthModel) -> FloatArray:
        """Composite radius R (mm) that a contact model reads, (k, n, 2, tips, locations); at most that of a flat."""
        pressed = self.load / 1000 / self.read_with_MPa.reshape(-1, 1, 1, 1, 1)
        root = np.linspace(0.0, np.sqrt(2 * R_B * pressed.max()), WIDTH_KNOTS)
        width = reader.half_width(root**2)
        wide = np.flatnonzero(width > 0)[0] - 1  # a squeezed contact has no width below some radius
        kappa = np.interp(self.half_width_mm, width[wide:], root[wide:]) ** 2
        return np.minimum(kappa / pressed, R_B)

    def table(self, reader: WidthModel, average: str = "r_c") -> FloatArray:
        """Simulated Table 3, (k, n, 2, tips): composite radius of the mean over locations of r_c, or mean R."""
        radii = self.radii(reader)
        if average == "R":
            return np.asarray(radii.mean(axis=-1))
        return composite_radius(indenter_radius(radii, R_B).mean(axis=-1), R_B)

    @cached_property
    def location_sd(self) -> FloatArray:
        """Root mean square over tables and tips of the sd of R between locations, read by Hertz; mm, (k, 2)."""
        return np.asarray(np.sqrt(self.radii(HERTZ).var(axis=-1).mean(axis=(1, 3))))


def simulate_fits(
    moduli_MPa: Sequence[float] | FloatArray,
    physics: Physics,
    *,
    fingers: int,
    errors: int,
    first: int = 0,
    tips_mm: Sequence[float] | FloatArray = TIPS_MM,
) -> SimulatedFits:
    """Simulate the touches of Table 3 at each μ, and fit them with both calibrations.

    Parameters
    ----------
    moduli_MPa : sequence of float
        Shear moduli.
    physics : Physics
        What is true.
    fingers, errors : int
        Simulated fingers with their calibrations and noise, and draws of model error for each. The same at every μ,
        so that results are smooth in μ.
    first : int
        Seed of the first finger.
    tips_mm : sequence of float
        r_c of the tips; those of Table 3 by default.
    """
    kept: dict[int, PaperFinger] = {}
    shape = (len(moduli_MPa), fingers, errors, 2, len(tips_mm), len(LOCATIONS_DEG))
    width, load, elements = np.empty(shape), np.empty(shape), np.empty((len(moduli_MPa), fingers, 3))
    tips, where = (g.ravel() for g in np.meshgrid(tips_mm, LOCATIONS_DEG, indexing="ij"))
    for i, modulus in enumerate(moduli_MPa):
        for place in range(fingers):
            seed = first + place
            true = TrueFinger.of(physics, DESIGN, float(modulus), seed)
            if seed not in kept or not physics.linear_in_load:
                kept[seed] = PaperFinger.calibrated(true, seed)
            finger = kept[seed]
            names = ("poisson_ratio", "sensing_radius_mm", "error_percent_peak")
            elements[i, place] = [finger.elements.summary(name)[1] for name in names]
            readings = true.readings(tips, where, np.full(len(tips), REFERENCE_LOAD))
            if physics.noisy:
                readings += averaged_noise(readings.shape, np.random.default_rng([seed, 2]))
            for c, calibration in enumerate(CALIBRATIONS):
                wrong = DESIGN.peak_reading * physics.noisy * _model_errors([seed, c], errors)
                touches = readings + np.tile(wrong, (1, len(tips_mm), 1))
                reader = finger.reader(calibration, "hertz", float(modulus))
                found = fit_many_touches(reader, touches.reshape(-1, touches.shape[-1]))
                kappa = found.composite_radius_mm * found.load / 1000 / modulus
                width[i, place, :, c] = HERTZ.half_width(kappa).reshape(errors, *shape[-2:])
                load[i, place, :, c] = found.load.reshape(errors, *shape[-2:])
    together = (shape[0], fingers * errors, *shape[3:])
    moduli = np.asarray(moduli_MPa, dtype=float)
    return SimulatedFits(moduli, width.reshape(together), load.reshape(together), elements.mean(axis=1), moduli)


def _model_errors(seed: list[int], count: int) -> FloatArray:
    """Draws of model error as a share of the peak, (count, locations, elements); the seed ends in the calibration."""
    rng = np.random.default_rng([*seed, 3])
    share = MISFIT_PERCENT[CALIBRATIONS[seed[-1]]] / 100
    return share * np.array([model_error(DESIGN.element_angles_deg, LOCATIONS_DEG, rng) for _ in range(count)])
