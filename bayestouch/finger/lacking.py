"""Data that are missing for the calibration of a finger."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.data.arrays import turned
from bayestouch.data.averages import TouchMeans
from bayestouch.data.dataset import DataSet
from bayestouch.data.finger import Finger
from bayestouch.data.sensor import finger_of
from bayestouch.data.splits import with_calibration
from bayestouch.errors import InputError
from bayestouch.finger.fit import identifying_touches
from bayestouch.finger.priors import FingerPriors
from bayestouch.model.misplaced import misplaced

# No finger with several elements is thinner than a hair, in mm; in metres, every finger below 100 mm looks so.
HAIR_MM = 0.1
# Elements nearer to each other than this share of the rubber's thickness above the core read the same. Pitches of
# elements are a tenth to twice the thickness, and in radians 57 times smaller.
LEAST_PITCH = 0.05


def _units(finger: Finger) -> Iterator[str]:
    """Questions about units of lengths and angles with which no finger is built."""
    if finger.outer_radius_mm < HAIR_MM:
        yield f"outer_radius_mm is {finger.outer_radius_mm:g}: is it in metres?; state all lengths in mm"
    pitch, thickness = finger.pitch_deg, finger.outer_radius_mm - finger.core_radius_mm
    if pitch is None or np.radians(pitch) * finger.outer_radius_mm > LEAST_PITCH * thickness:
        return
    if (largest := max(map(abs, finger.element_angles_deg))) <= 2 * np.pi:
        yield f"all element_angles_deg are within ±{largest:.3g}: are they in radians?; state all angles in degrees"


# The shear modulus is that of its prior if its logarithm has more than this share of the sd of the prior: then the
# touches reduce its variance by less than a fifth.
FROM_PRIOR = 0.9
# A scale of the radii that is known to better than this share by the prior needs no touches: radii of single touches
# are seldom read better.
PRIOR_ENOUGH = 0.05


def lacking_to_calibrate(dataset: DataSet, known: TouchMeans) -> Iterator[str]:
    """A line of text for each kind of touch that is missing and that is needed or useful for the calibration.

    Parameters
    ----------
    dataset : DataSet
        Data set of a finger.
    known : TouchMeans
        Touches with references, from the calibration table or, without one, from the only table.
    """
    finger = finger_of(dataset.sensor)
    yield from _units(finger)
    if known.angle_deg is None:
        yield "cannot be calibrated: no angle_deg"
        return
    try:
        table = with_calibration(dataset).calibration
        assert table is not None
        FingerPriors.of(dataset.sensor)
        identifying_touches(table.baseline_corrected().averaged(), finger)
    except InputError as error:
        yield f"cannot be calibrated: {error.message}"
        return
    edges = known.angle_deg[(known.indenter_radius_mm == 0) & np.isfinite(known.angle_deg)]
    pitch = finger.pitch_deg
    if not edges.size:
        yield "no knife edge to calibrate with: it determines the depth of each element best"
    elif pitch is not None:
        nearest = np.abs(turned(np.asarray(finger.element_angles_deg)[:, None] - edges)).min(axis=1)
        bare = [f"e{e + 1:02d}" for e in np.flatnonzero(nearest > pitch / 2)]
        if bare:
            yield f"no knife edge within half a pitch ({pitch / 2:.3g}°) of {', '.join(bare)}"
    yield from misplaced(known, np.asarray(finger.element_angles_deg)[:, None], finger.location_columns, "°")
    if not np.isinf(known.indenter_radius_mm).any():
        yield "no flat to calibrate with: it determines the shear modulus, and so the scale of all radii"


def shear_modulus_from_prior(log_mu: FloatArray, prior_sd: float) -> Iterator[str]:
    """A note if the touches do not determine the shear modulus, from its draws.

    Readings depend on the curvature radius R and the load P by P R/μ. So all radii are in proportion to μ, and only
    calibration touches of known radius above zero, as a flat, say how large it is: knife edges have R = 0.

    Parameters
    ----------
    log_mu : array
        Draws of log μ of the posterior.
    prior_sd : float
        Standard deviation of its prior.
    """
    if prior_sd > PRIOR_ENOUGH and is_from_prior(log_mu, prior_sd):
        yield (
            "The touches say little of the shear modulus: it is that of its prior, known to "
            f"{100 * float(log_mu.std()):.0f} %. All radii R are in proportion to it and have this error in common "
            "(docs/statistics.md): calibrate with flats, too."
        )


def is_from_prior(log_mu: FloatArray, prior_sd: float) -> bool:
    """Whether draws of log μ are those of its prior, which has the standard deviation `prior_sd`."""
    return float(log_mu.std()) > FROM_PRIOR * prior_sd
