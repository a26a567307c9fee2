"""Fits with noise effects."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.model.fitting import Fitted, fit
from bayestouch.model.noise import NoiseModel
from bayestouch.model.noise_posterior import FoundNoise
from bayestouch.model.outliers import RightReadings, from_prediction
from bayestouch.model.peaks import settled
from bayestouch.model.whitening import Whitening
from bayestouch.sampling.rank_one import normal_log_density

# Trial sizes of a shared error that is equal in all samples of a touch, over the peak.
TOUCH_SIZES = np.concatenate([[0.0], np.geomspace(2e-4, 0.2, 40)])


def with_noise(fitted: Fitted, found: FoundNoise) -> Fitted:
    """The model fitted again with a noise effect, without readings that are probably wrong."""
    noise, model, vector = fitted.noise, fitted.model, fitted.vector
    effect, values = found.effect, found.values
    noise = noise.with_(effects=(*noise.effects, (effect, values)))
    predicted, sd = model.predict(vector), found.own_sd
    if noise.added.adds:
        # A large deviation where other effects make the noise large is no wrong reading.
        sd = RightReadings(sd, noise.peak, noise.added).sd_at(predicted.touches)[model.known.row_touch]
    wrong = effect.wrong(from_prediction(model.known.table, predicted.samples), sd, noise.peak, values)
    if wrong is not None:
        cleaned = model.known.without(wrong)
        model = model.with_readings(cleaned)
        # The scatter that is left is the own noise, unless other effects have a part in it.
        sd = found.own_sd if noise.added.adds else np.sqrt(cleaned.means.pure_error_variance)
        noise = noise.with_(sd=np.where(np.isfinite(sd) & (sd > 0), sd, noise.sd))
        again = fit(model, vector, noise, fitted.drifts)
        # What effects explain of the scatter within touches is no noise.
        return again if again.linear.deviation_jacobian is None else settled(again)
    if added := effect.added(values):
        noise = noise.with_(added=replace(noise.added, **added), sd=found.own_sd)
        if "common" in added:
            noise = _with_touch_size(noise, _touch_size(fitted, noise, predicted.touches))
    return fit(model, vector, noise, fitted.drifts)


def _with_touch_size(noise: NoiseModel, size: float) -> NoiseModel:
    return noise.with_(added=replace(noise.added, common_touch=size))


def _touch_size(fitted: Fitted, noise: NoiseModel, predicted: FloatArray) -> float:
    """Size of the shared error that is equal in all samples of a touch, by the likelihood of the mean readings."""
    model, by_load = fitted.model, fitted.model.by_load(fitted.vector)
    residual = model.known.means.readings - predicted - fitted.drifted

    def log_likelihood(size: float) -> float:
        return normal_log_density(
            Whitening.of(model.known, _with_touch_size(noise, size), predicted, by_load).root, residual
        )

    return float(TOUCH_SIZES[int(np.argmax([log_likelihood(size) for size in TOUCH_SIZES]))])
