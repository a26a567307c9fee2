"""Table 3 as measured data: what its Hertz columns say about the shear modulus that the paper does not print.

Touches on the layer are read by Hertz as the authors did, at many moduli; the mean radius of each tip as a function of
μ is the emulator. Printed and simulated means are compared as composite radii, in which errors are alike. Errors of the
nine means are strongly correlated (they share elements and locations): their covariance comes from the same
simulations. A further independent error of each mean, of unknown size τ, takes what the simulation leaves out. Two
unknowns, so the posterior is a sum over a grid.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bayestouch.contact import composite_radius
from bayestouch.published import TABLE_3
from bayestouch.reliability.many_fits import fit_many_touches
from bayestouch.reliability.modulus import ModulusPosterior, infer_modulus
from bayestouch.reliability.paper_finger import (
    CALIBRATIONS,
    DESIGN,
    LOCATIONS_DEG,
    MISFIT_PERCENT,
    TIPS_MM,
    Calibration,
    PaperFinger,
    model_error,
    simulated,
)

FloatArray = NDArray[np.float64]

MODULI_MPA = np.geomspace(0.025, 0.4, 9)
"""Moduli that are simulated. Below, the contact of a flat is more than a finger's radius wide."""
N_FINGERS, N_ERRORS = 4, 10
R_B = DESIGN.outer_radius_mm


def printed(contact: str, calibration: Calibration) -> FloatArray:
    """A column of Table 3 as composite radii, mm; contact ``hertz`` or ``frictionless``."""
    return composite_radius([getattr(row, f"{contact}_{calibration}") for row in TABLE_3], R_B)


@dataclass(frozen=True, eq=False)
class BiasCurves:
    """Simulated Table 3 over the shear modulus.

    Attributes
    ----------
    moduli_MPa : (k,) array
        μ of the simulations.
    means : (k, 2, tips) array
        Composite radius (mm) of the mean estimate of r_c by calibration (model, empirical) and tip, averaged over
        simulated fingers.
    covariance : (k, 2, tips, tips) array
        Its covariance between fingers.
    n_simulated : int
        Tables behind each mean.
    location_sd : (k, 2) array
        Root mean square over the tips of the sd of R between locations within a finger.
    """

    moduli_MPa: FloatArray
    means: FloatArray
    covariance: FloatArray
    n_simulated: int
    location_sd: FloatArray

    def at(self, modulus: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Means (..., 2, tips) and covariances (..., 2, tips, tips) at a μ, by cubic splines in log μ."""
        from scipy.interpolate import CubicSpline

        place, knots = np.log(np.asarray(modulus, dtype=float)), np.log(self.moduli_MPa)
        return CubicSpline(knots, self.means)(place), _linear(place, knots, self.covariance)


def infer_from_table_3(
    curves: BiasCurves, *, contact: str = "hertz", calibrations: Sequence[Calibration] = CALIBRATIONS
) -> ModulusPosterior:
    """Posterior of μ from columns of Table 3.

    Parameters
    ----------
    curves : BiasCurves
        Simulated with the reader of those columns.
    contact : {"hertz", "frictionless"}
        Which columns.
    calibrations : sequence of {"model", "empirical"}
        Both by default; their errors count as independent.
    """
    chosen = [CALIBRATIONS.index(calibration) for calibration in calibrations]
    # means of a finite number of simulated tables: their own error is 1/n of the covariance
    more = 1 + 1 / curves.n_simulated

    def emulator(moduli: FloatArray) -> tuple[FloatArray, FloatArray]:
        means, covariance = curves.at(moduli)
        return means[:, chosen], more * covariance[:, chosen]

    support = float(curves.moduli_MPa[0]), float(curves.moduli_MPa[-1])
    return infer_modulus([printed(contact, calibration) for calibration in calibrations], emulator, support)


def _linear(place: FloatArray, knots: FloatArray, values: FloatArray) -> FloatArray:
    """Linear interpolation: a covariance between two covariances is one."""
    row = np.clip(np.searchsorted(knots, place) - 1, 0, len(knots) - 2)
    share = np.clip((place - knots[row]) / (knots[row + 1] - knots[row]), 0.0, 1.0)
    share = share.reshape(share.shape + (1,) * (values.ndim - 1))
    return np.asarray((1 - share) * values[row] + share * values[row + 1])


def bias_curves(
    moduli_MPa: Sequence[float] | FloatArray = MODULI_MPA,
    *,
    read_by: str = "hertz",
    fingers: int = N_FINGERS,
    errors: int = N_ERRORS,
    tips_mm: FloatArray = TIPS_MM,
) -> BiasCurves:
    """Simulate Table 3 at each μ: touches by the layer's contact, read by another model with both calibrations.

    Parameters
    ----------
    moduli_MPa : sequence of float
        Shear moduli.
    read_by : str
        Contact model of the reader.
    fingers, errors : int
        Simulated fingers with their calibrations and noise, and draws of model error for each. The same at every μ,
        so that the curves are smooth.
    tips_mm : (tips,) array
        Indenter radii.
    """
    calibrated = [PaperFinger.of(simulated(0.1, seed)) for seed in range(fingers)]
    wrong = np.array([[_model_errors([seed, c], errors) for c in range(2)] for seed in range(fingers)])
    shape = (len(moduli_MPa), 2, fingers * errors, len(tips_mm))
    tables, spread = np.empty(shape), np.empty(shape[:3])
    for i, modulus in enumerate(moduli_MPa):
        for seed, finger in enumerate(calibrated):
            touches = simulated(float(modulus), seed, tips_mm=tips_mm).dataset.touches.averaged()
            assert touches.angle_deg is not None
            kept = touches.angle_deg < LOCATIONS_DEG[-1] + 0.5
            clean = touches.readings[kept]
            for c, calibration in enumerate(CALIBRATIONS):
                reader = finger.reader(calibration, read_by, float(modulus))
                for e in range(errors):
                    off = np.tile(wrong[seed, c, e], (len(tips_mm), 1)) * DESIGN.peak_reading
                    found = fit_many_touches(reader, clean + off)
                    by_tip = found.indenter_radius_mm.reshape(len(tips_mm), len(LOCATIONS_DEG))
                    row = seed * errors + e
                    tables[i, c, row] = composite_radius(by_tip.mean(axis=1), R_B)
                    within = composite_radius(by_tip, R_B).std(axis=1)
                    spread[i, c, row] = np.sqrt(np.mean(within**2))
    centred = tables - tables.mean(axis=2, keepdims=True)
    covariance = np.einsum("kcnt,kcnu->kctu", centred, centred) / max(shape[2] - 1, 1)
    return BiasCurves(
        np.asarray(moduli_MPa, dtype=float),
        tables.mean(axis=2),
        covariance,
        shape[2],
        np.sqrt((spread**2).mean(axis=2)),
    )


def _model_errors(seed: list[int], count: int) -> FloatArray:
    """Draws of model error as a share of the peak, (count, locations, elements); the seed ends in the calibration."""
    rng = np.random.default_rng(seed)
    share = MISFIT_PERCENT[CALIBRATIONS[seed[-1]]] / 100
    return share * np.array([model_error(DESIGN.element_angles_deg, LOCATIONS_DEG, rng) for _ in range(count)])
