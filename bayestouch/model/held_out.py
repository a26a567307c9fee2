"""Residuals of held-out touches, which were used neither in a fit nor in a choice of effects."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray
from bayestouch.model.correction import Correction
from bayestouch.model.fitting import Fitted, drift_columns
from bayestouch.model.observations import Observations
from bayestouch.model.outliers import RightReadings, from_prediction
from bayestouch.model.predictive import density_of_touches, precision_of_all
from bayestouch.model.quantities import Quantity
from bayestouch.model.whitening import Whitening


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Held-out touches with the residuals of their mean readings; t touches, m elements.

    Attributes
    ----------
    observed : Observations
        The touches, without readings that are probably wrong.
    residual : (t, m) array
        Mean reading minus prediction at the reference, over the peak reading; NaN missing.
    whitened : (t, m) array
        Residuals with the noise and the error of the load whitened to variance one; zero where missing.
    present : (t, m) bool array
        Whether a reading is present.
    design : (t m, q) array
        Change of `whitened` per standard deviation of each principal direction of the model's uncertainty.
    reference, stated : mappings of (t,) arrays
        References as corrected by the model and as stated in the data set, by variable of the posterior; NaN unknown.
    quantities : tuple of Quantity
        Quantities on which the residuals may depend.
    noise_sd : (t, m) or (n, m) array
        Standard deviation of each of the residuals `errors` if the model is right, over the peak: from the noise of
        the readings and the error of the load. NaN where the load was not measured.
    load_free : (t,) array
        Decrease of the expected sum of squares of `whitened` of a touch because its load was not measured and is
        free; zero where it was measured.
    log_volume : (t,) array
        Logarithm of the determinant that whitens the readings of each touch.
    samples : (n, m) array or None
        Reading minus prediction of every sample, over the peak, if the prediction error is that of samples.
    repeated : bool
        Whether touches have enough samples to estimate the noise.
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
    log_volume: FloatArray
    samples: FloatArray | None = None
    repeated: bool = True

    @property
    def errors(self) -> FloatArray:
        """Residuals of the prediction error, over the peak: of touches (t, m), or of samples (n, m)."""
        return self.residual if self.samples is None else self.samples

    @property
    def error_percent_peak(self) -> float:
        """Rms residual of each element in percent of its peak, mean over elements, as in the paper."""
        return rms_percent(self.errors)

    @property
    def touch_error_percent_peak(self) -> float:
        """Rms residual of the mean readings of touches, percent of each element's peak, mean over elements.

        It equals `error_percent_peak`, except where `errors` are those of samples. The error of samples also contains
        the change of readings while a touch is held, and more noise than the error of means.
        """
        return rms_percent(self.residual)

    @property
    def floor_percent_peak(self) -> float:
        """Expected value of `error_percent_peak` if the model is right; NaN if a load was not measured."""
        here = np.isfinite(self.errors)
        known = np.isfinite(self.noise_sd[here]).all()
        return rms_percent(np.where(here, self.noise_sd, np.nan)) if known else float("nan")

    @property
    def log_density(self) -> FloatArray:
        """Log predictive density of the mean readings of each touch, (t,), up to a constant for each reading.

        The density is normal. Its covariance is that of the noise and of the uncertainty of the fit.
        """
        spread = self.design.reshape(*self.whitened.shape, -1)
        return self.log_volume + density_of_touches(self.whitened, spread)

    @property
    def freedom(self) -> float:
        """Degrees of freedom of `mean_square`: number of readings minus those for unknown loads."""
        return float(self.present.sum() - self.load_free.sum())

    @property
    def mean_square(self) -> float:
        """Mean square of the whitened residuals: 1 if the model is right and exactly known."""
        return float((self.whitened**2).sum()) / self.freedom if self.freedom >= 1 else float("nan")

    @property
    def lack_of_fit(self) -> float:
        """`mean_square` if the noise is known; NaN without repeated samples."""
        return self.mean_square if self.repeated else float("nan")


def rms_percent(residual: FloatArray) -> float:
    """Rms over the rows of (n, m) for each element, mean over elements with readings, times 100; NaN missing."""
    count = np.isfinite(residual).sum(axis=0)
    alive = count > 0
    squares = (np.nan_to_num(residual) ** 2).sum(axis=0)[alive]
    return float(100 * np.mean(np.sqrt(squares / count[alive]))) if alive.any() else float("nan")


def free_load(whitening: Whitening, of_load: FloatArray, measured: BoolArray) -> FloatArray:
    """`HeldOut.load_free` (t,), from the change of the readings per standard deviation of each load, (t, m)."""
    return np.where(measured, 0.0, (whitening.touches(of_load) ** 2).sum(axis=1))


def without_wrong_readings(fitted: Fitted, observed: Observations) -> Observations:
    """Touches without the readings that are wrong with more than 50 % probability, by the model's noise effects."""
    noise = fitted.noise
    if not noise.effects:
        return observed
    predicted, sd = fitted.model.observing(observed).predict(fitted.vector), noise.sd
    if noise.added.adds:
        sd = RightReadings(sd, noise.peak, noise.added).sd_at(predicted.touches)[observed.row_touch]
    for effect, values in noise.effects:
        wrong = effect.wrong(from_prediction(observed.table, predicted.samples), sd, noise.peak, values)
        observed = observed if wrong is None else observed.without(wrong)
    return observed


def functions_at(
    fitted: Fitted, correction: Correction | None, observed: Observations
) -> tuple[FloatArray, FloatArray]:
    """Contribution of the drifts and the correction of a fit at other touches: sum (t, m), per weight (k, t, m)."""
    model = fitted.model.observing(observed)
    functions, weights = drift_columns(model, fitted.vector, fitted.drifts), fitted.linear.weights()
    if correction is not None:
        there = model.correction_inputs(fitted.vector)
        functions = np.concatenate([functions, correction.columns(*there)])
    return np.asarray(np.tensordot(weights, functions, axes=1)), functions


def design_of(fitted: Fitted, slopes: FloatArray, functions: FloatArray, whitening: Whitening) -> FloatArray:
    """`HeldOut.design` (t m, q) for the parameters and the weights of the functions together.

    No columns, (t m, 0), for a model that was changed after its fit (`at_stated_references`).
    """
    precision = precision_of_all(fitted.linear.free)
    columns = whitening.touches(np.concatenate([slopes, functions]))
    if len(columns) != len(precision):
        return np.zeros((columns[0].size, 0))
    scale = 1 / np.sqrt(np.diag(precision))
    root = np.linalg.cholesky(precision * np.outer(scale, scale) + 1e-10 * np.eye(len(scale)))
    return np.asarray(np.linalg.solve(root, scale[:, None] * columns.reshape(len(columns), -1)).T)
