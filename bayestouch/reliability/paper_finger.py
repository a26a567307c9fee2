"""The paper's finger and procedure, simulated: calibrated with edges by both of its methods, touched, and read.

Touches are pressed by the exact frictionless contact on the bonded layer and read by least squares with any contact
model. Sizes and noise are the printed ones. What the paper's fits left over and noise does not explain (its "model
error": Tables 1 and 2 against 0.64 %) is put into the touches as a smooth random error of every element, a function of
the angle from the touch and the same for every indenter.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bayestouch.averages import average
from bayestouch.body.emap import model_e_matrix
from bayestouch.published import TABLE_1, TABLE_2, TABLE_3, number
from bayestouch.sensor import Sensor
from bayestouch.simplex import ElementTable, EmpiricalFinger, EmpiricalTable, table_1, table_2
from bayestouch.simulation import FingerDesign, SimulatedDataSet, simulate
from bayestouch.simulation.designs import REFERENCE_LOAD

FloatArray = NDArray[np.float64]
Calibration = Literal["model", "empirical"]

CALIBRATIONS: tuple[Calibration, Calibration] = ("model", "empirical")
TIPS_MM = np.array([row.r_c for row in TABLE_3])
LOCATIONS_DEG = np.arange(-20.0, 20.0)
SENSING_RADIUS_MM, POISSON_RATIO = TABLE_1[1].average, TABLE_1[0].average
LARGEST_LOAD = 3 * REFERENCE_LOAD
MISFIT_LENGTH_DEG = 8.0
"""Correlation length of the model error: one element spacing. Between 4° and 16° results hardly change."""
# Noise of the averaged fits in quadrature: 0.5 % of the force sensor, 0.4 % of the readings.
_NOISE_OF_FIT = float(np.hypot(number("noise.force_sensor").value, number("noise.averaged_readings").value))
MISFIT_PERCENT: dict[Calibration, float] = {
    "model": float(np.sqrt(TABLE_1[2].average ** 2 - _NOISE_OF_FIT**2)),
    "empirical": float(np.sqrt(TABLE_2[0].average ** 2 - _NOISE_OF_FIT**2)),
}
"""Root mean square model error in % of the peak: 2.06 and 1.26."""

DESIGN = FingerDesign(
    sensing_radius_mm=SENSING_RADIUS_MM,
    poisson_ratio=POISSON_RATIO,
    load_range=(REFERENCE_LOAD, REFERENCE_LOAD),
    touch_step_deg=1.0,
)


def simulated(shear_modulus_MPa: float, seed: int, *, tips_mm: FloatArray = TIPS_MM) -> SimulatedDataSet:
    """The finger, its calibration touches, and every tip at -20 … 20 degrees; one seed gives one finger and noise."""
    return simulate(replace(DESIGN, shear_modulus_MPa=shear_modulus_MPa, touch_radii_mm=tuple(tips_mm)), seed=seed)


@dataclass(frozen=True, eq=False)
class PaperFinger:
    """The finger calibrated with edges by both of the paper's methods; these do not depend on μ.

    Attributes
    ----------
    sensor : Sensor
        As designed.
    elements : ElementTable
        Table 1: σ, r_s, θ_s and gain of each element.
    identified : EmpiricalTable
        Table 2: the E map by least squares.
    shear_modulus_MPa : float
        μ that the gains of `elements` refer to.
    """

    sensor: Sensor
    elements: ElementTable
    identified: EmpiricalTable
    shear_modulus_MPa: float

    @classmethod
    def of(cls, data: SimulatedDataSet) -> PaperFinger:
        """Calibrate with the edges of a simulated finger."""
        assert data.dataset.calibration is not None
        means, sensor = average(data.dataset.calibration), data.dataset.sensor
        modulus = float(data.truth["mu"])
        return cls(sensor, table_1(means, sensor, modulus), table_2(means, sensor), modulus)

    @cached_property
    def fitted_map(self) -> EmpiricalTable:
        """The E map of the element fits, in the form of an identified one: readings per MPa of the coefficients."""
        fits, highest = self.elements.fits, 70  # (10.7/12.7)^70 is 6e-6
        strain = model_e_matrix(
            [fit.angle_deg for fit in fits],
            highest,
            sensing_radius_mm=np.array([fit.sensing_radius_mm for fit in fits]),
            core_radius_mm=DESIGN.core_radius_mm,
            outer_radius_mm=DESIGN.outer_radius_mm,
            poisson_ratio=np.array([fit.poisson_ratio for fit in fits]),
            shear_modulus_MPa=self.shear_modulus_MPa,
        )
        readings = -np.array([fit.gain for fit in fits])[:, None] * strain  # gains are per compressive strain
        coefficients = np.ones(2 * highest + 1)
        coefficients[1:] = 2.0
        angles = np.radians([fit.angle_deg for fit in fits])[:, None] * np.arange(1, highest + 1)
        edge = np.ones((len(fits), 2 * highest + 1))
        edge[:, 1::2], edge[:, 2::2] = np.sin(angles), np.cos(angles)
        response = -1e-3 / (2 * np.pi * DESIGN.outer_radius_mm) * (readings * coefficients * edge).sum(axis=1)
        return replace(self.identified, map=readings, response=response)

    def reader(self, calibration: Calibration, contact: str, shear_modulus_MPa: float) -> EmpiricalFinger:
        """The finger to read touches with."""
        return EmpiricalFinger.of(
            self.fitted_map if calibration == "model" else self.identified,
            self.sensor,
            shear_modulus_MPa=shear_modulus_MPa,
            poisson_ratio=POISSON_RATIO,
            largest_load=LARGEST_LOAD,
            contact=contact,
        )


def model_error(element_deg: FloatArray, touch_deg: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Smooth random error of each element as a function of its angle from the touch, sd 1; shape (t, m).

    A stationary Gaussian process with a squared-exponential covariance, drawn by its spectrum: waves of random
    frequency and phase.
    """
    waves = 100
    frequency = rng.standard_normal((len(element_deg), waves)) / np.radians(MISFIT_LENGTH_DEG)
    phase = rng.uniform(0, 2 * np.pi, (len(element_deg), waves))
    off = np.radians(touch_deg[:, None] - element_deg)
    return np.asarray(np.sqrt(2 / waves) * np.cos(off[..., None] * frequency + phase).sum(axis=-1))
