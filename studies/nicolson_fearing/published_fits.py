"""Tables 1 and 3 as measured data: what they say about the shear modulus that the paper does not print.

The authors' procedure is simulated at many moduli (`simulated_fits`): edges calibrate the finger in both of their ways,
a stated physics presses nine tips at 40 locations, and a contact model reads them. The mean radius of each tip as a
function of μ is the emulator. Printed and simulated means are compared as composite radii, in which errors are alike.
Errors of the nine means are strongly correlated (they share elements and locations): their covariance comes from the
same simulations. A further error of unknown size τ belongs for the most part to a tip, whatever the column: tips were
machined, and the columns' residuals go together. Two unknowns, so the posterior is a sum over a grid.

Table 1 may be data too: the sensing radius that was fitted, 10.3 mm on average, where 9.9 mm was designed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bayestouch.contact import composite_radius
from bayestouch.paper.published import TABLE_1, TABLE_3
from nicolson_fearing.modulus import ModulusPosterior, infer_modulus
from nicolson_fearing.paper_finger import CALIBRATIONS, TIPS_MM, PaperCalibration
from nicolson_fearing.paper_physics import BUILT_RADIUS_MM, LINEAR, Physics
from nicolson_fearing.simulated_fits import HERTZ, R_B, SimulatedFits, WidthModel, simulate_fits

FloatArray = NDArray[np.float64]

MODULI_MPA = np.geomspace(0.025, 0.4, 9)
"""Moduli that are simulated. Below, the contact of a flat is more than a finger's radius wide."""
N_FINGERS, N_ERRORS = 4, 10
# A sample covariance of few tables is close to singular: correlations shrink by a fifth. And prints are rounded.
SHRINKAGE, FLOOR_MM = 0.2, 0.02
# Share of τ² that columns have in common: residuals of one tip scatter about their mean by half of what means do.
TIP_SHARE = 0.75
FITTED_RADIUS_SD_MM = 0.08
"""Of Table 1's mean sensing radius: 14 elements from 9.8 to 10.7 mm scatter by 0.26 mm, and it is rounded to 0.1."""


def printed(contact: str, calibration: PaperCalibration) -> FloatArray:
    """A column of Table 3 as composite radii, mm; contact ``hertz`` or ``frictionless``."""
    return composite_radius([getattr(row, f"{contact}_{calibration}") for row in TABLE_3], R_B)


@dataclass(frozen=True, eq=False)
class BiasCurves:
    """Simulated Table 3 over the shear modulus.

    Attributes
    ----------
    moduli_MPa : (k,) array
        μ of the simulations.
    tables : (k, n, readers, 2, tips) array
        Composite radius (mm) of the mean estimate of r_c, for n simulated tables, each reader, calibration (model,
        empirical) and tip.
    location_sd : (k, 2) array
        Root mean square over tables and tips of the sd of R between locations, read by Hertz; mm.
    elements : (k, 3) array
        Means over elements and fingers of what Table 1 fits: σ, r_s (mm) and the error (% of the peak).
    """

    moduli_MPa: FloatArray
    tables: FloatArray
    location_sd: FloatArray
    elements: FloatArray

    @classmethod
    def of(cls, fits: SimulatedFits, read_by: Sequence[WidthModel], average: str = "r_c") -> BiasCurves:
        """Simulated touches read by contact models; means over locations of r_c, as printed, or of R."""
        tables = np.stack([fits.table(reader, average) for reader in read_by], axis=2)
        return cls(fits.moduli_MPa, tables, fits.location_sd, fits.elements)

    def means(self, modulus: ArrayLike) -> FloatArray:
        """Expected table at μ, (..., readers, 2, tips), by a cubic spline in log μ."""
        from scipy.interpolate import CubicSpline

        return np.asarray(CubicSpline(np.log(self.moduli_MPa), self.tables.mean(axis=1))(np.log(modulus)))

    def fitted_elements(self, modulus: ArrayLike) -> FloatArray:
        """σ, r_s and error of Table 1 at μ, (..., 3)."""
        from scipy.interpolate import CubicSpline

        return np.asarray(CubicSpline(np.log(self.moduli_MPa), self.elements)(np.log(modulus)))

    def covariance(self, modulus: ArrayLike, readers: Sequence[int], calibrations: Sequence[int]) -> FloatArray:
        """Covariance of one table's columns, (..., n, n) in the order of `columns`.

        Linear between the simulated moduli, since a covariance between two covariances is one. Calibrations are
        independent by construction, and what the sample says otherwise is chance.
        """
        tips = self.tables.shape[-1]
        size = len(readers) * len(calibrations) * tips
        out = np.zeros((len(self.moduli_MPa), size, size))
        centred = self.tables - self.tables.mean(axis=1, keepdims=True)
        place = np.arange(size).reshape(len(readers), len(calibrations), tips)
        count = self.tables.shape[1]
        for i, calibration in enumerate(calibrations):
            block = centred[:, :, list(readers), calibration].reshape(len(self.moduli_MPa), count, -1)
            rows = place[:, i].ravel()
            # n tables leave their mean uncertain by 1/n of the covariance
            sample = np.einsum("kna,knb->kab", block, block) / (count - 1) * (1 + 1 / count)
            sample *= np.where(np.eye(sample.shape[-1]) > 0, 1.0, 1 - SHRINKAGE)
            out[:, rows[:, None], rows] = sample
        return _linear(np.log(modulus), np.log(self.moduli_MPa), out)


def columns(values: FloatArray, readers: Sequence[int], calibrations: Sequence[int]) -> FloatArray:
    """Some columns of tables (..., readers, 2, tips) as vectors: reader by reader, calibration by calibration."""
    chosen = values[..., list(readers), :, :][..., list(calibrations), :]
    return chosen.reshape(*values.shape[:-3], -1)


def bias_curves(
    moduli_MPa: Sequence[float] | FloatArray = MODULI_MPA,
    *,
    physics: Physics = LINEAR,
    read_by: Sequence[WidthModel] = (HERTZ,),
    fingers: int = N_FINGERS,
    errors: int = N_ERRORS,
) -> BiasCurves:
    """Simulate Table 3 at each μ: touches by a stated physics, read by contact models with both calibrations.

    Parameters
    ----------
    moduli_MPa : sequence of float
        Shear moduli.
    physics : Physics
        What presses; by default the layer's frictionless contact at small strain.
    read_by : sequence of WidthModel
        Contact models of the readers.
    fingers, errors : int
        As `nicolson_fearing.simulated_fits.simulate_fits`.
    """
    return BiasCurves.of(simulate_fits(moduli_MPa, physics, fingers=fingers, errors=errors), read_by)


def infer_from_table_3(
    curves: BiasCurves,
    *,
    contacts: Sequence[str] = ("hertz",),
    calibrations: Sequence[PaperCalibration] = CALIBRATIONS,
    covariance_of: BiasCurves | None = None,
) -> ModulusPosterior:
    """Posterior of μ from columns of Table 3.

    Parameters
    ----------
    curves : BiasCurves
        Simulated with the readers of those columns, in the order of `contacts`.
    contacts : sequence of {"hertz", "frictionless"}
        Which columns.
    calibrations : sequence of {"model", "empirical"}
        Both by default.
    covariance_of : BiasCurves, optional
        Where the covariance of a table's errors comes from, if not from `curves`.
    """
    chosen = [CALIBRATIONS.index(calibration) for calibration in calibrations]
    readers = range(len(contacts))
    data = np.concatenate([printed(contact, calibration) for contact in contacts for calibration in calibrations])

    def emulator(moduli: FloatArray) -> tuple[FloatArray, FloatArray]:
        covariance = (covariance_of or curves).covariance(moduli, readers, chosen) + FLOOR_MM**2 * np.eye(len(data))
        return columns(curves.means(moduli), readers, chosen), covariance

    tip = np.tile(np.arange(len(TIPS_MM)), len(data) // len(TIPS_MM))
    shared = TIP_SHARE * (tip[:, None] == tip) + (1 - TIP_SHARE) * np.eye(len(data))
    support = float(curves.moduli_MPa[0]), float(curves.moduli_MPa[-1])
    return infer_modulus(data, emulator, support, shared=shared)


def with_table_1(
    posterior: ModulusPosterior, curves: BiasCurves, built_mm: float, placement_sd_mm: float
) -> ModulusPosterior:
    """The posterior with Table 1's mean sensing radius as a further datum.

    Parameters
    ----------
    posterior : ModulusPosterior
        From Table 3.
    curves : BiasCurves
        Simulated with the same physics.
    built_mm : float
        Sensing radius of the simulated finger, from which its fits are off.
    placement_sd_mm : float
        How far the paper's elements may lie, all together, from where they were designed; 0: nowhere else.
    """
    expected = BUILT_RADIUS_MM + curves.fitted_elements(posterior.modulus_MPa)[:, 1] - built_mm
    sd = np.hypot(FITTED_RADIUS_SD_MM, placement_sd_mm)
    off = (TABLE_1[1].average - expected) / sd
    return posterior.updated(-0.5 * off**2 - np.log(sd * np.sqrt(2 * np.pi)))


def _linear(place: FloatArray, knots: FloatArray, values: FloatArray) -> FloatArray:
    """Linear interpolation along the first axis, ends held."""
    row = np.clip(np.searchsorted(knots, place) - 1, 0, len(knots) - 2)
    share = np.clip((place - knots[row]) / (knots[row + 1] - knots[row]), 0.0, 1.0)
    share = share.reshape(share.shape + (1,) * (values.ndim - 1))
    return np.asarray((1 - share) * values[row] + share * values[row + 1])
