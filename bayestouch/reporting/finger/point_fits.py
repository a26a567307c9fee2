"""Least-squares fits of touches on a finger for any contact model, like the estimates in section 4 of the paper.

The paper minimised the squared error touch by touch with the simplex method. Here the same minimum, weighted by the
noise of each element, is found for all touches at once.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray
from bayestouch.chain.finger import FingerChain
from bayestouch.contact import indenter_radius
from bayestouch.data.averages import TouchMeans
from bayestouch.finger.calibration import finger_chain
from bayestouch.finger.reading.modes import find_modes
from bayestouch.finger.reading.reader import FingerPosterior, IndenterPriors, TouchReadings, noise_whitener
from bayestouch.paper.simplex import TouchPredictor
from bayestouch.results.objects import Calibration

# A radius within this share of edge or flat counts as edge or flat.
_END = 1e-9


@dataclass(frozen=True, eq=False)
class PointFits:
    """Fitted touches, one row a touch.

    Attributes
    ----------
    R, r_c : (n,) arrays
        Composite and indenter radius, mm; r_c is inf if the fit is at the flat.
    theta_c : (n,) array
        Location, degree.
    P : (n,) array
        Line load, N/m.
    """

    R: FloatArray
    r_c: FloatArray
    theta_c: FloatArray
    P: FloatArray


@dataclass(frozen=True)
class _FlatInLogit:
    """Prior that cancels the Jacobian of the coordinate used, so that the mode is the least-squares fit."""

    largest: float

    @property
    def support(self) -> tuple[float, float]:
        return 0.0, self.largest

    def log_density(self, value: ArrayLike) -> FloatArray:
        share = np.clip(np.asarray(value, dtype=float) / self.largest, _END, 1 - _END)
        return np.asarray(-np.log(share) - np.log1p(-share))

    def quantile(self, probability: ArrayLike) -> FloatArray:
        return np.asarray(self.largest * np.asarray(probability, dtype=float))


def model_finger(calibration: Calibration, contact: str) -> TouchPredictor:
    """Finger at the mode of its calibration, with a contact model that may differ from that of the calibration."""
    chain = finger_chain(calibration)
    return chain if contact == chain.contact else chain.with_(contact=contact)


def fit_points(
    means: TouchMeans, calibration: Calibration, finger: TouchPredictor, *, use_load: bool = False
) -> PointFits:
    """Fitted radius, location and load of every touch.

    Parameters
    ----------
    means : TouchMeans
        Averaged touches, rest reading subtracted.
    calibration : Calibration
        Calibration, for the noise and the range of loads.
    finger : FingerModel
        Model that predicts the readings: from `model_finger`, or an identified map.
    use_load : bool
        Use the reading of the force sensor with its noise.
    """
    # The calibration knows nothing of a dead element but its prior, which a fit would take as exact.
    read = np.where(calibration.rows.responds, means.readings, np.nan)
    counts = np.where(np.isnan(read), 0, means.counts)
    load = means.load if use_load else np.full(means.n_touches, np.nan)
    load_sd = calibration.noise.mean_load_sd(means.reads_of_load)
    readings = TouchReadings(read, counts, load, load_sd)
    # The search only uses what a `TouchPredictor` has: angles, outer radius, predictions.
    chain = cast(FingerChain, finger)
    wide = IndenterPriors.of_calibration(chain, calibration)
    priors = IndenterPriors(_FlatInLogit(finger.outer_radius_mm), wide.location, wide.load)
    posterior = FingerPosterior(chain, readings, priors, noise_whitener(calibration.noise, readings))
    mode = find_modes(posterior)
    radius = posterior.radius(mode[:, 0])
    return PointFits(
        R=radius,
        r_c=np.asarray(indenter_radius(radius, finger.outer_radius_mm)),
        theta_c=np.degrees(mode[:, 1]),
        P=mode[:, 2],
    )
