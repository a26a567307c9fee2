"""Residuals of touches that no fit and no choice has seen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayestouch.affected.finger_model import finger_model
from bayestouch.affected.fitting import Fitted, drift_columns
from bayestouch.affected.observations import Observations
from bayestouch.affected.outliers import from_median, wrong_readings
from bayestouch.affected.predictive import precision_of_all
from bayestouch.affected.whitening import Whitening
from bayestouch.contact import composite_radius
from bayestouch.diagnosis.correction import weights_of
from bayestouch.diagnosis.placed import Correction, where_of
from bayestouch.diagnosis.quantities import Quantity, of_finger

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Held-out touches with what a model says of their mean readings; t touches, m elements.

    Attributes
    ----------
    observed : Observations
        The touches, without readings that the model takes to be wrong.
    residual : (t, m) array
        Mean reading minus prediction at the reference, over the peak reading; NaN missing.
    whitened : (t, m) array
        The same made independent with variance one: noise, and the load's error; zero where missing.
    present : (t, m) bool array
        Readings that are there.
    design : (t m, q) array
        What one standard deviation of each direction of the model's own uncertainty does to `whitened`.
    reference : mapping of (t,) arrays
        References as the model has them, by the names of posteriors; NaN unknown.
    quantities : tuple of Quantity
        What the residuals may be looked at against.
    samples : (n, m) array or None
        Reading minus prediction of every sample, over the peak, where they are what a prediction is held against.
    repeated : bool
        Whether touches are read often enough for their noise to be known.
    """

    observed: Observations
    residual: FloatArray
    whitened: FloatArray
    present: BoolArray
    design: FloatArray
    reference: Mapping[str, FloatArray]
    quantities: tuple[Quantity, ...]
    samples: FloatArray | None = None
    repeated: bool = True

    @property
    def error_percent_peak(self) -> float:
        """Rms residual of each element in percent of its peak, mean over elements: the paper's measure."""
        residual = self.residual if self.samples is None else self.samples
        count = np.isfinite(residual).sum(axis=0)
        squares = (np.nan_to_num(residual) ** 2).sum(axis=0)
        alive = count > 0
        return float(100 * np.mean(np.sqrt(squares[alive] / count[alive])))

    @property
    def lack_of_fit(self) -> float:
        """Mean square of the whitened residuals: 1 where the model is right and exactly known; NaN without repeats."""
        if not self.repeated:
            return float("nan")
        return float((self.whitened**2).sum() / self.present.sum())

    @property
    def predictive_lack_of_fit(self) -> float:
        """The same with the model's own uncertainty allowed for: its mean is one where the model is right."""
        r = self.whitened.ravel()
        inside = self.design.T @ r
        matrix = np.eye(self.design.shape[1]) + self.design.T @ self.design
        return float((r @ r - inside @ np.linalg.solve(matrix, inside)) / self.present.sum())


def held_out(fitted: Fitted, correction: Correction | None, observed: Observations, force_sd: float) -> HeldOut:
    """Residuals of a finger's model on touches that it was not fitted to.

    Parameters
    ----------
    fitted : Fitted
        The model.
    correction : Correction or None
        Correction that was fitted with it.
    observed : Observations
        Held-out touches.
    force_sd : float
        Noise of one reading of the load.
    """
    noise, observed = fitted.noise, without_wrong_readings(fitted, observed)
    model = finger_model(fitted.model).observing(observed)
    added, functions = functions_at(fitted, correction, observed)
    predicted = model.predict(fitted.vector).touches + added
    reads = np.maximum(observed.means.counts.max(axis=1), 1)
    unknown = ~np.isfinite(observed.load)
    load_sd = np.where(unknown, 0.3 * np.nanmean(model.load), force_sd / np.sqrt(reads))
    whitening = Whitening.of(observed, noise.with_(load_sd=load_sd), predicted, model.by_load(fitted.vector))
    residual = observed.means.readings - predicted
    present = whitening.present
    peak = np.abs(model.chain(fitted.vector).response) * model.reference_load
    recording = model.poses(fitted.vector)
    angle, load = recording.place[0], np.where(unknown, np.nan, recording.load)
    radius = composite_radius(recording.indenter_radius_mm, model.finger.outer_radius_mm)
    element = np.asarray(model.finger.element_angles_deg)
    return HeldOut(
        observed=observed,
        residual=np.where(present, residual, np.nan) / peak,
        whitened=np.where(present, whitening.touches(residual), 0.0),
        present=present,
        design=design_of(fitted, model.derivatives(fitted.vector)[0], functions, whitening),
        reference={"R": radius, "theta_c": angle, "P": load},
        quantities=of_finger(observed, element, angle, radius, load, predicted / peak, peak),
    )


def without_wrong_readings(fitted: Fitted, observed: Observations) -> Observations:
    """Touches without the readings that a model takes to be wrong."""
    noise = fitted.noise
    for name, values in noise.effects:
        if name == "outliers":
            observed = observed.without(wrong_readings(from_median(observed.table), noise.sd, noise.peak, values))
    return observed


def functions_at(
    fitted: Fitted, correction: Correction | None, observed: Observations
) -> tuple[FloatArray, FloatArray]:
    """What drifts and correction of a fit add to other touches, (t, m), and what each weight does, (k, t, m)."""
    model = fitted.model.observing(observed)
    functions, weights = drift_columns(model, fitted.vector, fitted.drifts), fitted.linear.weights()
    if correction is not None:
        there = where_of(replace(fitted, model=model))
        functions = np.concatenate([functions, correction.columns(*there)])
        weights = np.concatenate([weights[: len(functions) - len(weights_of(fitted)[0])], weights_of(fitted)[0]])
    return np.asarray(np.tensordot(weights, functions, axes=1)), functions


def design_of(fitted: Fitted, slopes: FloatArray, functions: FloatArray, whitening: Whitening) -> FloatArray:
    """Columns of `HeldOut.design`: parameters and weights of the functions together."""
    columns = whitening.touches(np.concatenate([slopes, functions]))
    precision = precision_of_all(fitted.linear.free)
    scale = 1 / np.sqrt(np.diag(precision))
    root = np.linalg.cholesky(precision * np.outer(scale, scale) + 1e-10 * np.eye(len(scale)))
    return np.asarray(np.linalg.solve(root, scale[:, None] * columns.reshape(len(columns), -1)).T)
