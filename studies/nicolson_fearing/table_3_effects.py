"""What each effect explains of Tables 1 and 3: posterior of μ and of the authors' squeeze, residual, evidence.

Table 3's second contact model is "squeezed and stretched" Hertz. How much it squeezes is not printed; it is inferred as
a width taken off every contact (`SqueezedHertz`), beside the modulus. The exact layer
squeezes, too, but by a width that vanishes with the contact.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayestouch.contact import HertzContact, composite_radius, contact_model
from nicolson_fearing.modulus import ModulusPosterior
from nicolson_fearing.paper_finger import CALIBRATIONS, POISSON_RATIO, TIPS_MM
from nicolson_fearing.paper_physics import BUILT_RADIUS_MM, LINEAR, TIP_LENGTH_MM, Physics
from nicolson_fearing.published_fits import BiasCurves, infer_from_table_3, printed, with_table_1
from nicolson_fearing.simulated_fits import HERTZ, R_B, RADII, SimulatedFits, WidthModel
from nicolson_fearing.squeezed_hertz import SqueezedHertz

FloatArray = NDArray[np.float64]

CONTACTS = ("hertz", "frictionless")
LAYER = contact_model("layer", RADII, POISSON_RATIO)
SQUEEZES_MM = tuple(np.linspace(0.1, 0.52, 15).tolist())
"""Squeezes that are tried, each as probable as any other."""
MODULI_MPA = np.geomspace(0.04, 0.3, 6)
"""From the softest rubber of the finite-strain table; the Hertz columns alone say 0.045 to 0.065."""
PLACEMENT_SD_MM = 0.2
"""How far elements may be from where they were designed, all together: half of the dielectric's 0.4 mm."""
TRUTH = composite_radius(TIPS_MM, R_B)
ODD_TIP = 2
"""The tip of 3.90 mm, which all four columns read sharper than its neighbours say."""

LINEAR_NAME = "linear"
CASES: dict[str, Physics] = {
    LINEAR_NAME: LINEAR,
    "no noise or model error": Physics(noisy=False),
    "edges' locations off by 0.2°": Physics(location_error_deg=0.2),
    "edges with a radius of 0.25 mm": Physics(edge_radius_mm=0.25),
    "tips 4 mm long, σ 0.49": Physics(length_mm=TIP_LENGTH_MM, poisson_ratio=0.49),
    "linear, elements at 9.9 mm": Physics(BUILT_RADIUS_MM),
    "half of finite strain, 9.9 mm": Physics(BUILT_RADIUS_MM, finite_strain=0.5),
    "finite strain, 9.9 mm": Physics(BUILT_RADIUS_MM, finite_strain=1.0),
    "the same, tips stick": Physics(BUILT_RADIUS_MM, finite_strain=1.0, measure="stuck"),
    "the same, elements read lengths": Physics(BUILT_RADIUS_MM, finite_strain=1.0, measure="stretch"),
}
"""What may be true of the finger, each on its own; linear ones have elements where Table 1 fits them."""


@dataclass(frozen=True, eq=False)
class Explanation:
    """What Tables 1 and 3 say if a physics is true.

    Attributes
    ----------
    log_evidence : float
        Of both columns of both contact models and of Table 1's sensing radius, elements near where they were designed.
    log_evidence_as_designed : float
        The same with elements just where they were designed.
    modulus_MPa, squeeze_mm : (mean, low, high)
        Posterior mean and 90 % interval; the squeeze is the authors', NaN for the exact layer.
    residual : (2, 2, tips) array
        Printed minus predicted composite radius (mm) at the posterior mean: contact (hertz, frictionless), calibration
        (model, empirical), tip.
    fitted : (3,) array
        Table 1 as predicted at the posterior mean: σ, r_s (mm) with elements built at 9.9 mm, error in % of the peak.
    """

    log_evidence: float
    log_evidence_as_designed: float
    modulus_MPa: tuple[float, float, float]
    squeeze_mm: tuple[float, float, float]
    residual: FloatArray
    fitted: FloatArray

    def rms(self, contact: str, *, all_tips: bool = True) -> float:
        """Root mean square residual in R, mm, over tips and both calibrations; perhaps without the odd tip."""
        return rms_of(self.residual[CONTACTS.index(contact)], all_tips=all_tips)


def rms_of(residual: FloatArray, *, all_tips: bool = True) -> float:
    """Root mean square of (..., tips), perhaps without the odd tip."""
    kept = residual if all_tips else np.delete(residual, ODD_TIP, axis=-1)
    return float(np.sqrt(np.mean(kept**2)))


def table_3() -> FloatArray:
    """Table 3 as composite radii, (2, 2, tips): contact, calibration, tip."""
    return np.array([[printed(contact, calibration) for calibration in CALIBRATIONS] for contact in CONTACTS])


def squeezed(squeeze_mm: float, ratio: float = 1.0) -> SqueezedHertz:
    """The authors' reader."""
    assert isinstance(HERTZ, HertzContact)
    return SqueezedHertz(HERTZ, squeeze_mm, ratio)


def explain(
    fits: SimulatedFits,
    physics: Physics,
    base: SimulatedFits,
    *,
    readers: Sequence[float] | None = SQUEEZES_MM,
    average: str = "r_c",
) -> Explanation:
    """Posterior, residual and evidence under a physics.

    Parameters
    ----------
    fits : SimulatedFits
        Simulated with that physics.
    physics : Physics
        The same: where its elements are.
    base : SimulatedFits
        The linear ones, for the covariance of a table's errors: one for all, so that evidences compare means.
    readers : sequence of float, optional
        Squeezes of the second contact model that are tried; None: it is the exact layer.
    average : {"r_c", "R"}
        What Table 3 is the mean of.
    """
    models: list[WidthModel] = [LAYER] if readers is None else [squeezed(s) for s in readers]
    near, exact = [], []
    for model in models:
        curves = BiasCurves.of(fits, (HERTZ, model), average)
        covariance_of = BiasCurves.of(base, (HERTZ, model))
        posterior = infer_from_table_3(curves, contacts=CONTACTS, covariance_of=covariance_of)
        near.append(with_table_1(posterior, curves, physics.sensing_radius_mm, PLACEMENT_SD_MM))
        exact.append(with_table_1(posterior, curves, physics.sensing_radius_mm, 0.0))
    share = _shares(near)
    together = _mixed(near, share)
    mean = together.mean_MPa
    if readers is None:
        squeeze, best = (np.nan, np.nan, np.nan), models[0]
    else:
        squeeze = _interval(np.asarray(readers), share)
        best = squeezed(squeeze[0])
    curves = BiasCurves.of(fits, (HERTZ, best), average)
    fitted = curves.fitted_elements(mean)
    fitted[1] += BUILT_RADIUS_MM - physics.sensing_radius_mm
    return Explanation(
        log_evidence=_mean_log([p.log_evidence for p in near]),
        log_evidence_as_designed=_mean_log([p.log_evidence for p in exact]),
        modulus_MPa=(mean, *together.interval()),
        squeeze_mm=squeeze,
        residual=table_3() - curves.means(mean),
        fitted=fitted,
    )


def _shares(posteriors: Sequence[ModulusPosterior]) -> FloatArray:
    logs = np.array([p.log_evidence for p in posteriors])
    mass = np.exp(logs - logs.max())
    return np.asarray(mass / mass.sum())


def _mixed(posteriors: Sequence[ModulusPosterior], share: FloatArray) -> ModulusPosterior:
    weight = np.tensordot(share, np.array([p.weight for p in posteriors]), 1)
    extra = float(share @ [p.extra_sd for p in posteriors])
    return ModulusPosterior(posteriors[0].modulus_MPa, weight, _mean_log([p.log_evidence for p in posteriors]), extra)


def _mean_log(logs: Sequence[float]) -> float:
    return float(np.logaddexp.reduce(logs) - np.log(len(logs)))


def _interval(values: FloatArray, share: FloatArray) -> tuple[float, float, float]:
    """Mean and 90 % interval of a density known at equally spaced values."""
    fine = np.linspace(values[0], values[-1], 2001)
    with np.errstate(divide="ignore"):
        density = np.exp(np.interp(fine, values, np.maximum(np.log(share), -700.0)))
    mass = density / density.sum()
    low, high = np.interp([0.05, 0.95], np.cumsum(mass), fine)
    return float(mass @ fine), float(low), float(high)
