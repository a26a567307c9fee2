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

from bayestouch.body.emap import model_e_matrix
from bayestouch.contact import ContactModel
from bayestouch.data.averages import TouchMeans, average
from bayestouch.data.sensor import Sensor
from bayestouch.paper.published import TABLE_1, TABLE_2, TABLE_3, number
from bayestouch.paper.simplex import ElementTable, EmpiricalFinger, EmpiricalTable, table_1, table_2
from bayestouch.simulation import FingerDesign, SimulatedDataSet, simulate
from bayestouch.simulation.finger import REFERENCE_LOAD, BuiltFinger
from nicolson_fearing.paper_physics import TrueFinger

FloatArray = NDArray[np.float64]
PaperCalibration = Literal["model", "empirical"]

CALIBRATIONS: tuple[PaperCalibration, PaperCalibration] = ("model", "empirical")
TIPS_MM = np.array([row.r_c for row in TABLE_3])
LOCATIONS_DEG = np.arange(-20.0, 20.0)
SENSING_RADIUS_MM, POISSON_RATIO = TABLE_1[1].average, TABLE_1[0].average
LARGEST_LOAD = 3 * REFERENCE_LOAD
MISFIT_LENGTH_DEG = 8.0
"""Correlation length of the model error: one element spacing. Between 4° and 16° results hardly change."""
# Noise of the averaged fits in quadrature: 0.5 % of the force sensor, 0.4 % of the readings.
_NOISE_OF_FIT = float(np.hypot(number("noise.force_sensor").value, number("noise.averaged_readings").value))
MISFIT_PERCENT: dict[PaperCalibration, float] = {
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

RAW_NOISE_SD = DESIGN.noise_percent_peak / 100 * DESIGN.peak_reading


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
    def calibrated(cls, true: TrueFinger, seed: int) -> PaperFinger:
        """Calibrate with edges at every degree of ±90°, taken for ideal, with the paper's noise of both sensors."""
        rng = np.random.default_rng([seed, 1])
        design = true.design
        angle = np.arange(-design.calibration_span_deg, design.calibration_span_deg + 1)
        load = np.full(len(angle), REFERENCE_LOAD)
        physics = true.physics
        pressed_at = angle + physics.location_error_deg * np.random.default_rng([seed, 4]).standard_normal(len(angle))
        silent = true.readings(np.full(len(angle), physics.edge_radius_mm), pressed_at, load)
        force_sd = physics.noisy * number("noise.force_sensor").value / 100 * REFERENCE_LOAD
        blank = np.full(len(angle), np.nan)
        means = TouchMeans(
            touch=np.arange(len(angle)),
            readings=silent + physics.noisy * averaged_noise(silent.shape, rng),
            counts=np.full(silent.shape, design.samples_per_touch),
            pure_error_variance=np.full(design.n_elements, RAW_NOISE_SD**2),
            pure_error_dof=np.full(design.n_elements, float(len(angle) * (design.samples_per_touch - 1))),
            load=load + force_sd * rng.standard_normal(len(angle)),
            indenter_radius_mm=np.zeros(len(angle)),
            depth_mm=blank,
            time_s=blank,
            angle_deg=angle,
            x_mm=None,
            y_mm=None,
        )
        sensor = BuiltFinger(design, true.sensing_radius_mm, true.angle_deg, true.gain_factor).sensor({})
        modulus = true.shear_modulus_MPa
        return cls(sensor, table_1(means, sensor, modulus), table_2(means, sensor), modulus)

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

    def reader(
        self, calibration: PaperCalibration, contact: str | ContactModel, shear_modulus_MPa: float
    ) -> EmpiricalFinger:
        """The finger to read touches with, by a named contact model or one of another kind."""
        finger = EmpiricalFinger.of(
            self.fitted_map if calibration == "model" else self.identified,
            self.sensor,
            shear_modulus_MPa=shear_modulus_MPa,
            poisson_ratio=POISSON_RATIO,
            largest_load=LARGEST_LOAD,
            contact=contact if isinstance(contact, str) else "hertz",
        )
        if isinstance(contact, str):
            return finger
        kappa = np.expm1(finger.coordinates) * finger.kappa_scale
        return replace(finger, spectra=contact.spectrum(kappa, np.arange(finger.spectra.shape[1])))


def averaged_noise(shape: tuple[int, ...], rng: np.random.Generator) -> FloatArray:
    """Noise of readings averaged over a touch's samples."""
    return np.asarray(RAW_NOISE_SD / np.sqrt(DESIGN.samples_per_touch) * rng.standard_normal(shape))


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
