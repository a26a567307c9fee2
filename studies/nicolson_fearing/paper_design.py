"""The paper's finger as the studies of its tables and figures simulate it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.special import ndtri

from bayestouch import Calibration, calibrate
from bayestouch.contact import composite_radius, contact_model
from bayestouch.data.dataset import DataSet
from bayestouch.data.sensor import Finger
from bayestouch.data.touches import Touches
from bayestouch.finger.fit import fit_finger
from bayestouch.finger.priors import FingerPriors
from bayestouch.simulation import FingerDesign, SimulatedDataSet
from nicolson_fearing.paper_finger import DESIGN

#: MPa: posterior mean and 90 % interval that `table_3_modulus.py` prints; the paper prints no modulus.
SHEAR_MODULUS = 0.054
MODULUS_INTERVAL = (0.045, 0.065)


def drawn_modulus(seed: int) -> float:
    """μ of a simulated finger, MPa: quantiles of that posterior, evenly spread over the seeds, 0 the median."""
    low, high = np.log(MODULUS_INTERVAL)
    share = (0.5 + seed * (np.sqrt(5) - 1) / 2) % 1
    return float(np.exp((low + high) / 2 + (high - low) / 2 * ndtri(share) / ndtri(0.95)))


def paper_design(**changes: object) -> FingerDesign:
    """Sizes and noise as printed, elements as deep as Table 1 fitted them, rubber as Table 3 wants it."""
    return replace(DESIGN, **{"shear_modulus_MPa": SHEAR_MODULUS, **changes})  # type: ignore[arg-type]  # a wrong name fails when it is made


def indenter(radius_mm: float) -> str:
    """What a tip is called."""
    if radius_mm == 0:
        return "edge"
    return "flat" if np.isinf(radius_mm) else f"{radius_mm:g} mm"


def with_map_errors(simulated: SimulatedDataSet, percent: float, seed: int, length_deg: float = 8.0) -> DataSet:
    """Add to every element an error of its E map, as a hand-made finger has them: smooth, random, its own.

    The response to an edge gets a stationary Gaussian process of the angle between element and touch, `percent` of the
    peak, with a squared-exponential covariance; blunter indenters feel it smoothed by their own pressure, so that
    superposition holds.
    """
    design = FingerDesign(**simulated.truth["design"])
    rng = np.random.default_rng([seed, 77])
    modes = np.arange(int(4 / np.radians(length_deg)) + 1)
    power = np.exp(-0.5 * (modes * np.radians(length_deg)) ** 2) * np.where(modes == 0, 0.5, 1.0)
    scale = percent / 100 * np.sqrt(power / power.sum())
    cosine, sine = scale * rng.standard_normal((2, design.n_elements, len(modes)))
    contact = contact_model(design.contact, (design.core_radius_mm, design.outer_radius_mm), design.poisson_ratio)
    place, response = (np.asarray(simulated.truth[name]) for name in ("theta_s", "response"))
    tables = {}
    for name in ("calibration", "touches"):
        table = getattr(simulated.dataset, name)
        load = np.asarray(simulated.truth[name]["P"])[table.touch]
        kappa = load / 1000 * composite_radius(table.indenter_radius_mm, design.outer_radius_mm)
        distinct, row = np.unique(kappa / design.shear_modulus_MPa, return_inverse=True)
        spectrum = contact.spectrum(distinct, modes)[row]
        turn = np.radians(table.angle_deg[:, None] - place)[..., None] * modes
        error = np.einsum("tk,tek->te", spectrum, np.cos(turn) * cosine + np.sin(turn) * sine)
        tables[name] = table.with_(readings=table.readings + response * load[:, None] * error)
    return replace(simulated.dataset, **tables)


def with_place_errors(
    simulated: SimulatedDataSet, percent: float, seed: int, *, step_deg: float = 1.0, repeats: bool = True
) -> DataSet:
    """Add to every reading an error of the place that is touched, `percent` of the peak, whatever the indenter.

    It differs from place to place (of `step_deg`) and element to element without any smoothness, so that no E map can
    take it up, and repeats whenever the place is touched: the surface or the rubber there, or the prober. Without
    `repeats` every touch has its own.
    """
    response = np.asarray(simulated.truth["response"])
    rng = np.random.default_rng([seed, 78])
    places = round(360 / step_deg) if repeats else sum(np.unique(t.touch).size for t in _tables(simulated))
    error = percent / 100 * response * rng.standard_normal((places, len(response)))
    tables = {}
    for name, table in zip(("calibration", "touches"), _tables(simulated), strict=True):
        load = np.asarray(simulated.truth[name]["P"])[table.touch]
        own = table.touch if name == "calibration" else -1 - table.touch  # from both ends
        place = (np.round(table.angle_deg / step_deg).astype(int) if repeats else own) % places
        tables[name] = table.with_(readings=table.readings + load[:, None] * error[place])
    return replace(simulated.dataset, **tables)


def _tables(simulated: SimulatedDataSet) -> tuple[Touches, Touches]:
    """Calibration and touches."""
    assert simulated.dataset.calibration is not None
    return simulated.dataset.calibration, simulated.dataset.touches


def calibrated(dataset: DataSet, e_map: str = "model") -> Calibration:
    """Calibration with the Laplace covariance in place of long chains: the same within a few per cent, in seconds."""
    calibration = calibrate(dataset, e_map=e_map, draws=8)
    finger, table = dataset.sensor.body, dataset.calibration
    assert isinstance(finger, Finger)
    assert table is not None
    priors, _ = FingerPriors.of(dataset.sensor)
    fit, _ = fit_finger(table.baseline_corrected().averaged(), finger, priors)
    return replace(calibration, covariance=fit.covariance)
