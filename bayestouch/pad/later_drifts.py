"""Noise of touches to come on a pad that drifts.

A pad is calibrated with its drift in the readings, and the drift counts as noise. Offsets and gains follow the mean of
the drift over the calibration, so that the residuals have the variance s² - v, where s is the sd of the drift and v the
variance of its mean. A touch at another time differs from that mean with the variance s² + v: 2 v more than the
calibration shows. It is small if the calibration takes many correlation times.

A gain that all elements share changes the readings of a touch as another load would: it moves the estimated load and
not the location, so it counts as load scatter.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayestouch.chain.noise import Noise
from bayestouch.model.fitting import Fitted
from bayestouch.model.joint_drifts import exact_basis
from bayestouch.pad.model import PadModel


def with_later_drifts(noise: Noise, fitted: Fitted) -> Noise:
    """Noise of touches at times that are far from those of the calibration.

    Parameters
    ----------
    noise : Noise
        Noise of the calibration, in which the drifts count as noise.
    fitted : Fitted
        Fit of a pad with its drifts.
    """
    model = fitted.model
    assert isinstance(model, PadModel)
    constant, by_signal, by_load = noise.discrepancy_sd**2, noise.signal_share**2, noise.load_scatter**2
    recording = model.poses(fitted.vector)
    none, peak = (replace(recording, signal=np.broadcast_to(s, recording.signal.shape)) for s in (0.0, model.peak))
    for drift, values in fitted.drifts:
        of_mean = float((exact_basis(drift, values, model.known).mean(axis=0) ** 2).sum())
        at_zero, at_peak = (drift.scale(each)[0] for each in (none, peak))
        constant = constant + 2 * of_mean * at_zero**2
        share2 = 2 * of_mean * float(np.mean(((at_peak - at_zero) / model.peak) ** 2))
        if drift.own(values):
            by_signal = by_signal + share2
        else:
            # The scatter is the same at all loads: it is right in the mean over those of the calibration.
            by_load = by_load + share2 * float(np.mean(recording.load**2))
    return replace(
        noise,
        discrepancy_sd=np.sqrt(constant),
        signal_share=float(np.sqrt(by_signal)),
        load_scatter=float(np.sqrt(by_load)),
    )
