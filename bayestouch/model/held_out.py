"""Residuals of touches that no fit and no choice has seen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray
from bayestouch.model.correction import Correction
from bayestouch.model.fitting import Fitted, drift_columns
from bayestouch.model.observations import Observations
from bayestouch.model.outliers import from_median
from bayestouch.model.predictive import precision_of_all
from bayestouch.model.quantities import Quantity
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
        there = model.correction_inputs(fitted.vector)
        functions = np.concatenate([functions, correction.columns(*there)])
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
