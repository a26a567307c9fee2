"""Residuals of touches that no fit and no choice has seen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray
from bayestouch.contact import composite_radius
from bayestouch.diagnosis.as_stated import at_stated_references
from bayestouch.diagnosis.correction import weights_of
from bayestouch.diagnosis.correction_basis import Correction, where_of
from bayestouch.diagnosis.quantities import Quantity, of_finger
from bayestouch.finger.model import finger_model
from bayestouch.model.fitting import Fitted, drift_columns
from bayestouch.model.observations import Observations
from bayestouch.model.outliers import from_median
from bayestouch.model.predictive import precision_of_all
from bayestouch.model.whitening import Whitening


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
    reference, stated : mappings of (t,) arrays
        References as the model corrects them and as the data set states them, by the names of posteriors; NaN unknown.
    quantities : tuple of Quantity
        What the residuals may be looked at against.
    noise_sd : (t, m) or (n, m) array
        Standard deviation of each residual of the prediction error if the model is right, over the peak: noise of the
        readings and error of the load's reading. NaN where the load was not measured: its error is not known.
    load_free : (t,) array
        By how much the expected sum of squares of a touch's `whitened` is below its number of readings because its
        load was not measured and may be anything; zero where it was.
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
    stated: Mapping[str, FloatArray]
    quantities: tuple[Quantity, ...]
    noise_sd: FloatArray
    load_free: FloatArray
    samples: FloatArray | None = None
    repeated: bool = True

    @property
    def errors(self) -> FloatArray:
        """Residuals that the prediction error is of, over the peak: of touches (t, m), or of samples (n, m)."""
        return self.residual if self.samples is None else self.samples

    @property
    def error_percent_peak(self) -> float:
        """Rms residual of each element in percent of its peak, mean over elements: the paper's measure."""
        return rms_percent(self.errors)

    @property
    def touch_error_percent_peak(self) -> float:
        """Rms residual of touches' mean readings, percent of each element's peak, mean over elements.

        Equal to `error_percent_peak` where that is of touches. Where that is of samples, it also has the change of
        readings while a touch is held, and more noise, since a mean over samples has less.
        """
        return rms_percent(self.residual)

    @property
    def floor_percent_peak(self) -> float:
        """Expected value of `error_percent_peak` if the model is right; NaN where a load was not measured."""
        here = np.isfinite(self.errors)
        known = np.isfinite(self.noise_sd[here]).all()
        return rms_percent(np.where(here, self.noise_sd, np.nan)) if known else float("nan")

    @property
    def freedom(self) -> float:
        """Readings behind `mean_square`, less what unknown loads take."""
        return float(self.present.sum() - self.load_free.sum())

    @property
    def mean_square(self) -> float:
        """Mean square of the whitened residuals: 1 where the model is right and exactly known."""
        return float((self.whitened**2).sum()) / self.freedom if self.freedom >= 1 else float("nan")

    @property
    def lack_of_fit(self) -> float:
        """The same where the noise is known; NaN without repeats."""
        return self.mean_square if self.repeated else float("nan")


def rms_percent(residual: FloatArray) -> float:
    """Rms over rows of each element, mean over the elements that have any, times 100; (n, m), NaN missing."""
    count = np.isfinite(residual).sum(axis=0)
    alive = count > 0
    squares = (np.nan_to_num(residual) ** 2).sum(axis=0)[alive]
    return float(100 * np.mean(np.sqrt(squares / count[alive]))) if alive.any() else float("nan")


def held_out(
    fitted: Fitted,
    correction: Correction | None,
    observed: Observations,
    force_sd: float,
    peak: FloatArray,
    *,
    stated: bool = False,
) -> HeldOut:
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
    peak : (m,) array
        Peak readings that errors are shares of: those of the fit without effects, before and after.
    stated : bool
        Predict touches at the references that the data set states, see `at_stated_references`.
    """
    shown = at_stated_references(fitted) if stated else fitted
    noise, observed = fitted.noise, without_wrong_readings(fitted, observed)
    model = finger_model(shown.model).observing(observed)
    added, functions = functions_at(shown, correction, observed)
    predicted = model.predict(shown.vector).touches + added
    means = observed.means
    reads = np.maximum(means.counts.max(axis=1), 1)
    measured = np.isfinite(observed.load)
    load_sd = np.where(measured, force_sd / np.sqrt(reads), 0.3 * np.nanmean(model.load))
    noise = noise.with_(load_sd=load_sd)
    by_load = model.by_load(shown.vector)
    whitening = Whitening.of(observed, noise, predicted, by_load)
    residual = means.readings - predicted
    present = whitening.present
    recording = model.poses(shown.vector)
    angle, load = recording.place[0], np.where(measured, recording.load, np.nan)
    outer = model.finger.outer_radius_mm
    radius = composite_radius(recording.indenter_radius_mm, outer)
    element = np.asarray(model.finger.element_angles_deg)
    assert means.angle_deg is not None
    of_load = by_load * load_sd[:, None]
    noise_sd = np.sqrt(noise.variance(predicted, np.maximum(means.counts, 1)) + of_load**2) / peak
    return HeldOut(
        observed=observed,
        residual=np.where(present, residual, np.nan) / peak,
        whitened=np.where(present, whitening.touches(residual), 0.0),
        present=present,
        design=design_of(shown, model.derivatives(shown.vector)[0], functions, whitening),
        reference={"R": radius, "theta_c": angle, "P": load},
        stated={
            "R": composite_radius(means.indenter_radius_mm, outer),
            "theta_c": means.angle_deg,
            "P": observed.load,
        },
        quantities=of_finger(observed, element, angle, radius, load, predicted / peak, peak),
        noise_sd=np.where(measured[:, None], noise_sd, np.nan),
        load_free=free_load(whitening, of_load, measured),
    )


def free_load(whitening: Whitening, of_load: FloatArray, measured: BoolArray) -> FloatArray:
    """See `HeldOut.load_free`, (t,); from what one standard deviation of each load does to the readings, (t, m)."""
    return np.where(measured, 0.0, (whitening.touches(of_load) ** 2).sum(axis=1))


def without_wrong_readings(fitted: Fitted, observed: Observations) -> Observations:
    """Touches without the readings that a model takes to be wrong."""
    noise = fitted.noise
    for effect, values in noise.effects:
        wrong = effect.wrong(from_median(observed.table), noise.sd, noise.peak, values)
        observed = observed if wrong is None else observed.without(wrong)
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
    """Columns of `HeldOut.design`: parameters and weights of the functions together.

    None, (t m, 0), for a model that is not as it was fitted (`at_stated_references`).
    """
    precision = precision_of_all(fitted.linear.free)
    columns = whitening.touches(np.concatenate([slopes, functions]))
    if len(columns) != len(precision):
        return np.zeros((columns[0].size, 0))
    scale = 1 / np.sqrt(np.diag(precision))
    root = np.linalg.cholesky(precision * np.outer(scale, scale) + 1e-10 * np.eye(len(scale)))
    return np.asarray(np.linalg.solve(root, scale[:, None] * columns.reshape(len(columns), -1)).T)
