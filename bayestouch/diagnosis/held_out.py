"""Errors on touches that no fit and no choice has seen."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayestouch.affected.fitting import Fitted, drift_columns
from bayestouch.affected.observations import Observations
from bayestouch.affected.whitening import Whitening
from bayestouch.contact import composite_radius
from bayestouch.diagnosis.correction import weights_of
from bayestouch.diagnosis.placed import Correction, where_of
from bayestouch.inference import infer
from bayestouch.results import Calibration
from bayestouch.touches import Touches

FloatArray = NDArray[np.float64]

COVERAGE = 0.9


@dataclass(frozen=True)
class Errors:
    """Errors on held-out touches; NaN what the data cannot give.

    Attributes
    ----------
    prediction_error_percent_peak : float
        Rms of mean reading minus prediction at the reference, over the peak reading; mean over elements.
    lack_of_fit : float
        Mean square of that over the pure error's, the load's error taken out.
    R_bias_mm, R_rms_mm : float
        Posterior mean of R minus that of the probe's tip.
    theta_rms_deg, P_rms_N_per_m : float
        The same of location and load, the load as it was read.
    coverage_90 : float
        Share of the touches whose R lies in the central 90 % of its posterior.
    """

    prediction_error_percent_peak: float
    lack_of_fit: float
    R_bias_mm: float
    R_rms_mm: float
    theta_rms_deg: float
    P_rms_N_per_m: float
    coverage_90: float


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Held-out touches with what a model says of them; t touches, m elements.

    Attributes
    ----------
    errors : Errors
        Their summary.
    residual : (t, m) array
        Mean reading minus prediction at the reference, over the peak; NaN missing.
    whitened : (t, m) array
        The same, whitened.
    angle_deg, radius_mm : (t,) arrays
        Location and composite radius of the references, as the model has them.
    """

    errors: Errors
    residual: FloatArray
    whitened: FloatArray
    angle_deg: FloatArray
    radius_mm: FloatArray


def predicted_at(fitted: Fitted, observed: Observations, correction: Correction | None) -> FloatArray:
    """Prediction (t, m) for touches that were not fitted: chain, drifts at their time, correction at their place."""
    model = fitted.model.observing(observed)
    out = model.predict(fitted.vector).touches
    weights = fitted.linear.weights()
    own = drift_columns(model, fitted.vector, fitted.drifts)
    out = out + np.tensordot(weights[: len(own)], own, axes=1)
    if correction is not None:
        there = where_of(replace(fitted, model=model))
        out = out + np.tensordot(weights_of(fitted)[0], correction.columns(*there), axes=1)
    return np.asarray(out)


def held_out_errors(
    fitted: Fitted,
    correction: Correction | None,
    observed: Observations,
    touches: Touches,
    calibration: Calibration,
    *,
    load_sd: FloatArray,
    seed: int,
) -> HeldOut:
    """Errors of a fitted model, and of its calibration when it reads the touches as unknown.

    Parameters
    ----------
    fitted : Fitted
        The model.
    correction : Correction or None
        Its correction.
    observed : Observations
        Held-out touches.
    touches : Touches
        The same as a table, rest reading subtracted.
    calibration : Calibration
        What the fit was made into.
    load_sd : (t,) array
        Standard error of the touches' loads.
    seed : int
        Of the draws.
    """
    model = fitted.model.observing(observed)
    readings = observed.means.readings
    predicted = predicted_at(fitted, observed, correction)
    noise = fitted.noise.with_(load_sd=load_sd)
    whitening = Whitening.of(observed, noise, predicted, model.by_load(fitted.vector))
    residual = readings - predicted
    whitened = whitening.touches(residual)
    present = (whitening.root != 0).any(axis=2)
    peak = np.abs(model.chain(fitted.vector).response) * model.reference_load
    count = np.maximum(present.sum(axis=0), 1)
    rms = np.sqrt((np.where(present, residual, 0.0) ** 2).sum(axis=0) / count)
    alive = present.any(axis=0)
    recording = model.poses(fitted.vector)
    radius = composite_radius(recording.indenter_radius_mm, model.finger.outer_radius_mm)
    # The rows have had their rest reading subtracted.
    plain = replace(calibration, extra={k: v for k, v in calibration.extra.items() if k != "rest_reading"})
    read = infer(touches, plain, seed=seed)
    reference = {"R": radius, "theta_c": recording.place[0], "P": observed.load}
    error = {name: read.mean(name) - reference[name] for name in reference}
    low, high = read.interval("R", COVERAGE)
    errors = Errors(
        prediction_error_percent_peak=float(100 * np.mean((rms / peak)[alive])),
        lack_of_fit=float((whitened**2).sum() / present.sum()),
        R_bias_mm=_mean(error["R"]),
        R_rms_mm=_rms(error["R"]),
        theta_rms_deg=_rms(error["theta_c"]),
        P_rms_N_per_m=_rms(error["P"]),
        coverage_90=float(np.mean((low <= radius) & (radius <= high))),
    )
    return HeldOut(errors, np.where(present, residual, np.nan) / peak, whitened, recording.place[0], radius)


def _mean(values: FloatArray) -> float:
    values = values[np.isfinite(values)]
    return float(values.mean()) if len(values) else float("nan")


def _rms(values: FloatArray) -> float:
    values = values[np.isfinite(values)]
    return float(np.sqrt((values**2).mean())) if len(values) else float("nan")
