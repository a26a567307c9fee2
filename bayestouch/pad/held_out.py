"""Residuals of the held-out touches of a pad."""

from __future__ import annotations

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.pad import COORDINATES
from bayestouch.data.arrays import read_once
from bayestouch.model.as_stated import at_stated_references
from bayestouch.model.correction import Correction
from bayestouch.model.fitting import Fitted
from bayestouch.model.held_out import HeldOut, design_of, free_load, functions_at, without_wrong_readings
from bayestouch.model.observations import Observations
from bayestouch.model.whitening import Whitening
from bayestouch.pad.model import PadModel
from bayestouch.pad.quantities import quantities

# With fewer samples per touch, a change while the touch is held cannot be distinguished from noise.
ENOUGH_SAMPLES = 3


def held_out(
    fitted: Fitted, correction: Correction | None, observed: Observations, peak: FloatArray, *, stated: bool = False
) -> HeldOut:
    """Residuals of the model of a pad on held-out touches.

    If touches have several samples, the prediction error is that of samples, because the samples of a pad may be from
    different times of the hold. A load that was not measured is free: a change of the readings of a touch by its load
    does not count as lack of fit.

    Parameters
    ----------
    fitted, correction, observed, stated
        As in `bayestouch.finger.held_out.held_out`.
    peak : (m,) array
        Peak readings of the fit without effects, the unit of errors. (Those of a model with effects may differ.)
    """
    shown = at_stated_references(fitted) if stated else fitted
    observed = without_wrong_readings(fitted, observed)
    model = shown.model.observing(observed)
    assert isinstance(model, PadModel)
    added, functions = functions_at(shown, correction, observed)
    prediction = model.predict(shown.vector)
    predicted = prediction.touches + added
    means, rows = observed.means, observed.row_touch
    reads = read_once(means.counts.max(axis=1))
    one_load = np.median(fitted.noise.load_sd * np.sqrt(fitted.model.known.means.reads_of_load))
    measured = np.isfinite(observed.load)
    noise = fitted.noise.with_(load_sd=np.where(measured, one_load / np.sqrt(means.reads_of_load), model.load))
    by_load = model.by_load(shown.vector)
    whitening = Whitening.of(observed, noise, predicted, by_load)
    residual = means.readings - predicted
    present = whitening.present
    recording = model.poses(shown.vector)
    places = [axis for axis in (means.x_mm, means.y_mm) if axis is not None]
    changing = 0.0 if prediction.samples is None else prediction.samples
    by_sample = residual[rows] + observed.deviation - changing
    zero = model.chain(shown.vector).offset
    signal = (predicted - zero) / peak
    of_load = by_load * noise.load_sd[:, None]
    noise_sd = np.sqrt(noise.variance(predicted[rows], observed.weight[:, None]) + of_load[rows] ** 2) / peak
    return HeldOut(
        observed=observed,
        residual=np.where(present, residual, np.nan) / peak,
        whitened=np.where(present, whitening.touches(residual), 0.0),
        present=present,
        design=design_of(shown, model.derivatives(shown.vector)[0], functions, whitening),
        reference={**dict(zip(COORDINATES, recording.place, strict=False)), "P": observed.load},
        stated={**dict(zip(COORDINATES, places, strict=False)), "P": observed.load},
        quantities=quantities(observed, model.element_place, recording.place, observed.load, signal, peak, zero),
        noise_sd=np.where(measured[rows, None], noise_sd, np.nan),
        load_free=free_load(whitening, of_load, measured),
        log_volume=whitening.log_volume,
        samples=by_sample / peak,
        repeated=bool(reads.min(initial=ENOUGH_SAMPLES) >= ENOUGH_SAMPLES),
    )
