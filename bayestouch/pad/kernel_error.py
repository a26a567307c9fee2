"""Error of the kernel of a pad that is fitted with effects and without an empirical map."""

from __future__ import annotations

import numpy as np

from bayestouch.chain.noise import Noise
from bayestouch.data.arrays import read_once
from bayestouch.model.added import AddedEffect, moved_to
from bayestouch.model.fitting import Fitted, fit
from bayestouch.model.whitening import Whitening


def with_kernel_error(fitted: Fitted, added: tuple[AddedEffect, ...] = ()) -> tuple[Fitted, tuple[AddedEffect, ...]]:
    """The fit, and the effects of its chain, with the error of the kernel as a part of the noise.

    The error of each element is the part of the variance of its residuals that noise and errors of the loads do not
    explain. It is independent from touch to touch, and samples of a touch have the same error.
    """
    model = fitted.model
    means = model.known.means
    predicted, by_load = model.predict(fitted.vector).touches, model.by_load(fitted.vector)
    signal, counts = predicted - model.zero(fitted.vector), read_once(means.counts)
    noise = fitted.noise.with_(lasting=None)
    explained = noise.mean_variance(signal, counts) + (by_load * noise.load_sd[:, None]) ** 2
    explained = explained + (noise.shared_errors(means.counts) ** 2).sum(axis=0)
    present = np.isfinite(means.readings)
    residual = np.where(present, means.readings - predicted - fitted.drifted, 0.0)
    number = present.sum(axis=0)
    # The unknowns take up a part of the residuals.
    free = np.maximum(number - len(fitted.vector) / model.n_elements, 1)
    left = (residual**2).sum(axis=0) / free - np.where(present, explained, 0.0).sum(axis=0) / np.maximum(number, 1)
    noise = noise.with_(lasting=Noise(noise.sd, np.sqrt(np.maximum(left, 0.0))))
    whitening = Whitening.of(model.known, noise, signal, by_load)
    refitted = fit(model, fitted.vector, noise, fitted.drifts, whitening=whitening)
    return refitted, moved_to(refitted, added)
