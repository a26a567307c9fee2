"""What a plan of calibration touches would leave open, without making one of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayestouch.calibration.finger import FingerLikelihood, KnownTouches
from bayestouch.calibration.finger_priors import FingerPriors
from bayestouch.contact import composite_radius
from bayestouch.noise import Noise
from bayestouch.reliability.known_finger import ElasticErrors, KnownFinger
from bayestouch.sensor import Finger
from bayestouch.simulation import FingerDesign
from bayestouch.simulation.designs import REFERENCE_LOAD
from bayestouch.simulation.finger import BuiltFinger, plan_touches

FloatArray = NDArray[np.float64]


def expected_finger(design: FingerDesign, *, seed: int | None = None, calibrated: bool = True) -> KnownFinger:
    """The finger of a design as its planned calibration would know it.

    The covariance is that of the Laplace approximation at the truth: Fisher information of the calibration touches
    and the default priors. It holds for any data, so no touch is simulated.

    Parameters
    ----------
    design : FingerDesign
        Sensor, noise, and calibration touches.
    seed : int, optional
        Draws the errors of the elements (gain, depth, angle); built as designed without.
    calibrated : bool
        False takes every parameter as known.
    """
    built = _built(design, seed)
    sensor = built.sensor({})
    finger = sensor.body
    assert isinstance(finger, Finger)
    noise = Noise(
        np.full(design.n_elements, design.noise_percent_peak / 100 * design.peak_reading),
        np.zeros(design.n_elements),
        0.0,
        design.force_noise_sd or np.nan,
    )
    truth = np.concatenate(
        [
            built.response,
            built.sensing_radius_mm,
            np.radians(built.angle_deg),
            [design.poisson_ratio, np.log(design.shear_modulus_MPa)],
        ]
    )
    priors, _ = FingerPriors.of(sensor)
    likelihood = FingerLikelihood(_known(design, finger), finger, priors, truth, design.contact)
    chain = likelihood.chain(truth)
    return KnownFinger(
        chain=chain,
        noise=noise,
        errors=ElasticErrors(chain, _covariance(likelihood, truth, noise)) if calibrated else None,
        typical_load=REFERENCE_LOAD,
    )


def _built(design: FingerDesign, seed: int | None) -> BuiltFinger:
    if seed is not None:
        return BuiltFinger.of(design, np.random.default_rng([seed, 0]))  # as `bayestouch.simulate` draws them
    m = design.n_elements
    one = BuiltFinger(design, np.full(m, design.sensing_radius_mm), design.element_angles_deg, np.ones(m))
    gain = design.peak_reading / (one.response * REFERENCE_LOAD)
    return BuiltFinger(design, one.sensing_radius_mm, one.angle_deg, gain)


def _known(design: FingerDesign, finger: Finger) -> KnownTouches:
    """The design's calibration touches under the reference load; their readings are of no account."""
    plan = plan_touches(design, np.random.default_rng(0))
    n = plan.n_calibration
    counts = np.full((n, design.n_elements), design.samples_per_touch)
    return KnownTouches(
        radius_mm=composite_radius(plan.indenter_radius_mm[:n], finger.outer_radius_mm),
        angle=np.radians(plan.place[0][:n]),
        load=np.full(n, REFERENCE_LOAD),
        load_sd=np.full(n, design.force_noise_sd / np.sqrt(design.samples_per_touch)),
        readings=np.zeros((n, design.n_elements)),
        counts=counts,
    )


def _covariance(likelihood: FingerLikelihood, truth: FloatArray, noise: Noise) -> FloatArray:
    counts = likelihood.known.counts
    sd = noise.mean_sd(counts, np.zeros(counts.shape))
    _, predicted = likelihood.predicted(truth)
    rows = likelihood.whiten(likelihood.derivatives(truth), predicted, sd).reshape(len(truth), -1)
    _, spread = likelihood.priors.flat(likelihood.finger, likelihood.start[: likelihood.n_elements])
    information = rows @ rows.T + np.diag(spread**-2)
    scale = np.sqrt(np.diag(information))
    return np.asarray(np.linalg.inv(information / np.outer(scale, scale)) / np.outer(scale, scale))
