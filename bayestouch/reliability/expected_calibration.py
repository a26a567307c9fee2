"""Uncertainty of a planned calibration, without simulated touches."""

from __future__ import annotations

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.finger import FingerChain
from bayestouch.chain.neighbours import calibration_jacobian
from bayestouch.chain.noise import Noise
from bayestouch.contact import composite_radius
from bayestouch.errors import InputError
from bayestouch.finger.likelihood import LOAD_REACH
from bayestouch.finger.priors import FingerPriors
from bayestouch.priors.parameters import Prior
from bayestouch.reliability.known_finger import ElasticErrors, KnownFinger, TouchPlaces
from bayestouch.sampling.rank_one import DiagonalPlusRankOne
from bayestouch.simulation import FingerDesign
from bayestouch.simulation.checks import check_not_negative
from bayestouch.simulation.finger import REFERENCE_LOAD, BuiltFinger

# A force sensor without noise, as a share of the load: with a zero it would count as no force sensor.
_EXACT_LOAD = 1e-6
# Limits of the central 68 % of a prior: plus and minus one standard deviation if it is normal.
_ONE_SD = np.array([0.15865525, 0.84134475])


def expected_finger(
    design: FingerDesign, *, seed: int | None = None, calibrated: bool = True, lack_of_fit_percent: float = 0.0
) -> KnownFinger:
    """Finger of a design with the posterior that its planned calibration would give.

    The covariance is the Laplace approximation at the true values: Fisher information of the calibration touches and
    of the default priors. It does not depend on the data, so no touch is simulated.

    Parameters
    ----------
    design : FingerDesign
        Sensor, noise, and calibration touches.
    seed : int, optional
        Seed of the errors of the elements (gain, depth, angle); without it, the finger is built as designed.
    calibrated : bool
        If False, every parameter is known exactly.
    lack_of_fit_percent : float
        Model error in % of `peak_reading`, independent between touches and elements. Averaging samples does not reduce
        it. It affects both the calibration touches and the touches to be inferred.

    Raises
    ------
    InputError
        The lack of fit is negative or not finite; or the readings have neither noise nor lack of fit, so that every
        error to expect is zero.

    Notes
    -----
    Every calibration touch has the mean load of `design.load_range`, which is also the typical load of the finger.
    """
    check_not_negative(lack_of_fit_percent=lack_of_fit_percent)
    if design.noise_percent_peak == 0 and lack_of_fit_percent == 0:
        raise InputError("noise_percent_peak: expected above zero; without noise there are no errors to predict")
    built = _built(design, seed)
    m, typical = design.n_elements, float(np.mean(design.load_range))
    noise = Noise(
        np.full(m, design.noise_percent_peak / 100 * design.peak_reading),
        np.full(m, lack_of_fit_percent / 100 * design.peak_reading),
        0.0,
        max(design.force_noise_sd, _EXACT_LOAD * typical),
    )
    chain = FingerChain(
        core_radius_mm=design.core_radius_mm,
        outer_radius_mm=design.outer_radius_mm,
        response=built.response,
        sensing_radius_mm=built.sensing_radius_mm,
        angle=np.radians(built.angle_deg),
        offset=np.zeros(m),
        poisson_ratio=design.poisson_ratio,
        shear_modulus_MPa=design.shear_modulus_MPa,
        largest_load=LOAD_REACH * typical,
        contact=design.contact,
    )
    errors = ElasticErrors(chain, _covariance(design, built, chain, noise, typical)) if calibrated else None
    return KnownFinger(chain, noise, errors, typical, chain.largest_load)


def _built(design: FingerDesign, seed: int | None) -> BuiltFinger:
    if seed is not None:
        return BuiltFinger.of(design, np.random.default_rng([seed, 0]))  # same stream as in `bayestouch.simulate`
    m = design.n_elements
    one = BuiltFinger(design, np.full(m, design.sensing_radius_mm), design.element_angles_deg, np.ones(m))
    gain = design.peak_reading / (one.response * REFERENCE_LOAD)
    return BuiltFinger(design, one.sensing_radius_mm, one.angle_deg, gain)


def _covariance(design: FingerDesign, built: BuiltFinger, chain: FingerChain, noise: Noise, load: float) -> FloatArray:
    """Covariance of responses, depths (mm), angles (rad), σ and log μ after the design's calibration touches."""
    m, samples = design.n_elements, design.samples_per_touch
    plan = design.plan(np.random.default_rng(0))
    n = plan.n_calibration
    touches = TouchPlaces(
        np.asarray(composite_radius(plan.indenter_radius_mm[:n], design.outer_radius_mm)),
        np.radians(plan.place[0][:n]),
        np.full(n, load),
    )
    jacobian = calibration_jacobian(chain, touches.radius_mm, touches.angle, touches.load)
    rows = np.zeros((3 * m + 2, n, m))
    for block in range(3):
        for element in range(m):
            rows[block * m + element, :, element] = jacobian[block, :, element]
    rows[3 * m :] = jacobian[3:]
    sd = noise.mean_sd(np.full((n, m), samples), np.zeros((n, m)))
    # The load of a calibration touch has a measurement error, which shifts all elements together.
    by_load = chain.predict(touches.radius_mm, touches.angle, touches.load) / touches.load[:, None]
    covariance = DiagonalPlusRankOne(sd, by_load * design.force_noise_sd / np.sqrt(samples))
    white = covariance.whiten(rows).reshape(len(rows), -1)
    information = white @ white.T + np.diag(_prior_precision(built, chain))
    scale = np.sqrt(np.diag(information))
    return np.asarray(np.linalg.inv(information / np.outer(scale, scale)) / np.outer(scale, scale))


def _prior_precision(built: BuiltFinger, chain: FingerChain) -> FloatArray:
    """Prior precision of responses (within a factor of 3), depths, angles, σ, log μ."""
    priors, _ = FingerPriors.of(built.sensor({}))
    m = chain.n_elements

    def spread(prior: Prior, scale: float = 1.0) -> FloatArray:
        return np.full(m, scale * float(np.ptp(prior.quantile(_ONE_SD))) / 2)

    modulus = float(np.ptp(np.log(priors.shear_modulus.quantile(_ONE_SD)))) / 2
    widths = [
        np.abs(chain.response) * np.log(3.0),
        spread(priors.sensing_radius),
        spread(priors.angle, np.pi / 180),
        spread(priors.poisson_ratio)[:1],
        np.array([modulus]),
    ]
    return np.asarray(np.concatenate(widths) ** -2.0)
