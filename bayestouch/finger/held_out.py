"""Residuals of the held-out touches of a finger."""

from __future__ import annotations

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.contact import composite_radius
from bayestouch.data.arrays import read_once
from bayestouch.finger.model import finger_model
from bayestouch.finger.quantities import quantities
from bayestouch.model.as_stated import at_stated_references
from bayestouch.model.correction import Correction
from bayestouch.model.fitting import Fitted
from bayestouch.model.held_out import HeldOut, design_of, free_load, functions_at, without_wrong_readings
from bayestouch.model.left_over import force_noise
from bayestouch.model.observations import Observations
from bayestouch.model.whitening import Whitening


def held_out(
    fitted: Fitted, correction: Correction | None, observed: Observations, peak: FloatArray, *, stated: bool = False
) -> HeldOut:
    """Residuals of the model of a finger on held-out touches.

    Parameters
    ----------
    fitted : Fitted
        The model.
    correction : Correction or None
        Correction that was fitted with the model.
    observed : Observations
        Held-out touches.
    peak : (m,) array
        Peak readings, the unit of errors; those of the model with effects may differ.
    stated : bool
        Predict touches at the references stated in the data set, see `at_stated_references`.
    """
    shown = at_stated_references(fitted) if stated else fitted
    noise, observed = fitted.noise, without_wrong_readings(fitted, observed)
    model = finger_model(shown.model).observing(observed)
    added, functions = functions_at(shown, correction, observed)
    predicted = model.predict(shown.vector).touches + added
    means = observed.means
    measured = np.isfinite(observed.load)
    load_sd = np.where(measured, force_noise(fitted) / np.sqrt(means.reads_of_load), 0.3 * np.nanmean(model.load))
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
    noise_sd = np.sqrt(noise.variance(predicted, read_once(means.counts)) + of_load**2) / peak
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
        quantities=quantities(observed, element, angle, radius, load, predicted / peak, peak),
        noise_sd=np.where(measured[:, None], noise_sd, np.nan),
        load_free=free_load(whitening, of_load, measured),
        log_volume=whitening.log_volume,
        repeated=bool(np.nansum(fitted.model.known.means.pure_error_dof) > 0),
    )
