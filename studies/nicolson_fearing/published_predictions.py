"""Other numbers of the paper as functions of the shear modulus, with nothing else free.

The 4.2 % and 2.2 % of section 3.1, the two numbers read off Figure 4, and the noise rows of Table 4.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bayestouch.body.annulus import solve_annulus
from bayestouch.body.frequency import sensing_radius_for_cut_off
from bayestouch.contact import composite_radius, contact_model
from bayestouch.data.averages import average
from bayestouch.paper.published import TABLE_1, number
from bayestouch.paper.simplex import table_1
from nicolson_fearing.many_fits import fit_many_touches
from nicolson_fearing.paper_finger import (
    DESIGN,
    LOCATIONS_DEG,
    POISSON_RATIO,
    PaperCalibration,
    PaperFinger,
    simulated,
)

FloatArray = NDArray[np.float64]
MeanOver = Literal["circle", "touched half", "50 degrees"]

ALPHA = number("alpha.deep").value
CUT_OFF = number("cutoff.deep").value
LOAD_N_PER_MM = number("touches.load").value / 1000
R_B = DESIGN.outer_radius_mm
HALF_WIDTH_DEG: dict[MeanOver, float] = {"circle": 180.0, "touched half": 90.0, "50 degrees": 25.0}
"""What "mean square" can be the mean over: the whole circle, or the ranges of the errors of section 3, 180° and 50°."""
NOISE_TIPS_MM = np.array([0.0, 3.9, 6.01, 9.3, 12.3, np.inf])
"""Six indenters "ranging from edge to flat" (Table 4): the paper does not say which."""


def flat_fit_error(finger: PaperFinger, shear_modulus_MPa: float, contact: str, seed: int = 0) -> float:
    """Mean error (% of the peak) of fitting edges and flats together with a contact model: section 3.1.

    The paper's 2.16 % for edges alone holds everything that ails its finger; what the contact model adds to the
    simulated fit of edges alone (`finger`, of the same seed) is added to it in quadrature.
    """
    data = simulated(shear_modulus_MPa, seed, tips_mm=np.zeros(1))
    assert data.dataset.calibration is not None
    means = average(data.dataset.calibration)
    both = table_1(means, finger.sensor, shear_modulus_MPa, contact=contact).summary("error_percent_peak")[1]
    edges = finger.elements.summary("error_percent_peak")[1]
    return float(np.sqrt(TABLE_1[2].average ** 2 + max(both**2 - edges**2, 0.0)))


def profile_difference(
    load_over_modulus_mm: ArrayLike,
    indenter_radius_mm: ArrayLike,
    *,
    mean_over: MeanOver = "circle",
    contact: str = "layer",
    alpha: float = ALPHA,
    poisson_ratio: float = POISSON_RATIO,
) -> FloatArray:
    """Root mean square difference of strain profiles, round tip against edge, in % of the edge's peak: Figure 4.

    Parameters
    ----------
    load_over_modulus_mm, indenter_radius_mm : array_like
        P/μ and r_c in mm; they broadcast.
    mean_over : {"circle", "touched half", "50 degrees"}
        Range of the mean.
    contact : str
        Contact model.
    alpha : float
        ``r_a/r_b``; the sensing radius is the one with the printed cut-off, 4.5 cycles/radian.
    poisson_ratio : float
        σ.
    """
    sensing = sensing_radius_for_cut_off(
        CUT_OFF, core_radius_mm=alpha * R_B, outer_radius_mm=R_B, poisson_ratio=poisson_ratio
    )
    modes = np.arange(161)
    body = solve_annulus(modes, core_radius_mm=alpha * R_B, outer_radius_mm=R_B, poisson_ratio=poisson_ratio)
    weights = np.where(modes == 0, 1.0, 2.0) * body.radial_strain(sensing)
    load, radius = np.broadcast_arrays(np.asarray(load_over_modulus_mm, float), np.asarray(indenter_radius_mm, float))
    spectrum = contact_model(contact, (alpha * R_B, R_B), poisson_ratio).spectrum(
        load * composite_radius(radius, R_B), modes
    )
    half = np.radians(HALF_WIDTH_DEG[mean_over])
    angle = (np.arange(720) + 0.5) / 720 * half  # the profiles are even
    difference = ((spectrum - 1) * weights) @ np.cos(np.outer(modes, angle))
    return np.asarray(100 * np.sqrt((difference**2).mean(axis=-1)) / abs(weights.sum()))


def flat_from_edge_noise(shear_modulus_MPa: float, mean_over: MeanOver, contact: str = "layer") -> float:
    """Noise (% of the peak) at which a flat is just told from an edge: printed as 3.7."""
    threshold = number("figure_4.threshold").value
    difference = profile_difference(LOAD_N_PER_MM / shear_modulus_MPa, np.inf, mean_over=mean_over, contact=contact)
    return float(difference) / threshold


def distinguished_radius(shear_modulus_MPa: float, mean_over: MeanOver, contact: str = "layer") -> float:
    """r_c/r_b of the tip that is just told from an edge at 1 % noise: printed as 0.16."""
    level = number("figure_4.threshold").value * number("figure_4.low_noise").value
    ratio = np.geomspace(1e-3, 1e3, 400)
    difference = profile_difference(
        LOAD_N_PER_MM / shear_modulus_MPa, ratio * R_B, mean_over=mean_over, contact=contact
    )
    return float(np.exp(np.interp(level, difference, np.log(ratio), right=np.inf)))


def noise_row(
    finger: PaperFinger,
    shear_modulus_MPa: float,
    calibration: PaperCalibration = "model",
    *,
    contact: str = "layer",
    seed: int = 0,
) -> FloatArray:
    """Standard deviation of θ_c (degree), P (N/m) and R (mm) fitted to raw samples, about the fit to their mean.

    Noise of Table 1 (1.72 % of the peak on average) in 20 samples of 40 touches with six indenters: Table 4, rows
    "noise".
    """
    data = simulated(shear_modulus_MPa, seed, tips_mm=NOISE_TIPS_MM)
    reader = finger.reader(calibration, contact, shear_modulus_MPa)
    touches, means = data.dataset.touches, data.dataset.touches.averaged()
    assert touches.angle_deg is not None
    kept = touches.angle_deg < LOCATIONS_DEG[-1] + 0.5
    raw, mean = fit_many_touches(reader, touches.readings[kept]), fit_many_touches(reader, means.readings)
    of_touch = np.searchsorted(means.touch, touches.touch[kept])
    names = ("angle_deg", "load", "composite_radius_mm")
    return np.array([np.sqrt(np.mean((getattr(raw, n) - getattr(mean, n)[of_touch]) ** 2)) for n in names])
