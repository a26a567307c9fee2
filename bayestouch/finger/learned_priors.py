"""Priors of a finger that are learned from calibrations of earlier fingers of the same build."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq
from scipy.special import stdtrit

from bayestouch.array_types import FloatArray
from bayestouch.data.sensor import Sensor, finger_of
from bayestouch.finger.layout import normal_approximation
from bayestouch.finger.population import EarlierFingers, NextFinger, Population, predict
from bayestouch.finger.priors import DISCREPANCY, FingerPriors
from bayestouch.finger.same_build import check_same_build
from bayestouch.priors.parameters import LogStudentT, Parameter, Prior, StudentT, Uniform
from bayestouch.results.objects import Calibration

# Half-normal scales of the sds of log responses and log noise; the default priors of one finger have these sds.
RESPONSE_SPREAD, NOISE_SPREAD = float(np.log(3.0)), float(np.log(10.0))
# Smallest and largest number of degrees of freedom. Chains with normal proposals accept few steps in heavier tails than
# those of 4 degrees; with 200 the prior is practically normal.
DOF = 4.0, 200.0
SEED = 0


def learned_priors(
    earlier: Sequence[tuple[str, Calibration]], sensor: Sensor, contact: str, samples: float
) -> tuple[dict[str, Prior], tuple[str, ...]]:
    """Priors of the next finger by name, and notes on what was learned.

    Priors are learned for σ, log μ and the depths of the elements together, for log responses, for the log noise of the
    readings, and for the log discrepancies if every earlier calibration has draws of them. The other parameters keep
    their default priors: few touches determine the angles, and the noise of the force sensor is that of the rig.

    Parameters
    ----------
    earlier : sequence of (str, Calibration)
        Names, for messages, and calibrations of earlier fingers of the same build.
    sensor : Sensor
        The next finger.
    contact : str
        Its contact model.
    samples : float
        Number of readings in the mean of a typical touch; discrepancies are multiples of the noise of this mean.

    Raises
    ------
    InputError
        If a calibration is of another body, geometry, unit or contact model, has too few draws, was itself made with
        `like`, or is given twice.
    """
    check_same_build(earlier, sensor, contact)
    calibrations = [calibration for _, calibration in earlier]
    build = _elastic(calibrations, sensor)
    default, _ = FingerPriors.of(sensor)
    rng = np.random.default_rng(SEED)
    sigma, log_mu, depth = (build.prior(i, rng) for i in range(3))
    of_elements = {
        "response": _of_elements(calibrations, "response", RESPONSE_SPREAD),
        "noise_sd": _of_elements(calibrations, "noise_sd", NOISE_SPREAD),
    }
    if all(_has_discrepancies(each) for each in calibrations):
        of_elements["discrepancy_sd"] = _discrepancies(calibrations, samples)
    priors: dict[str, Prior] = {
        "sigma": StudentT(*sigma, *default.poisson_ratio.support),
        "mu": _log_student(*log_mu),
        "r_s": StudentT(*depth, *default.sensing_radius.support),
        **{name: _log_student(*each.prior(0, rng)) for name, each in of_elements.items()},
    }
    count = f"{len(earlier)} earlier finger{'s' if len(earlier) > 1 else ''}"
    said = {
        "sigma": f"sd between fingers {build.sd(0):.2g}",
        "mu": f"between fingers a factor of {np.exp(build.sd(1)):.3g}",
        "r_s": f"sd between fingers {build.sd(2):.2g} mm, between elements {build.sd(3):.2g} mm",
        **{name: _factors(each) for name, each in of_elements.items()},
    }
    return priors, tuple(f"Prior of {name} learned from {count}: {priors[name]}; {said[name]}." for name in priors)


@dataclass(frozen=True, eq=False)
class LearnedPrior:
    """Predictive distribution of the next finger, with the units of its coordinates.

    Attributes
    ----------
    following : NextFinger
        The distribution, in units of `scale` about `centre`.
    centre, scale : (d,) arrays
        Origin and unit of each coordinate.
    """

    following: NextFinger
    centre: FloatArray
    scale: FloatArray

    def prior(self, coordinate: int, rng: np.random.Generator) -> tuple[float, float, float]:
        """Centre, scale and degrees of freedom of the Student-t distribution that is closest to a coordinate."""
        centre, scale, dof = student_of(self.following.samples(coordinate, rng))
        unit = float(self.scale[coordinate])
        return float(self.centre[coordinate]) + unit * centre, unit * scale, dof

    def sd(self, component: int) -> float:
        """Median of the draws of one sd of the population; the sd of elements within a finger is last."""
        unit = self.scale[min(component, len(self.scale) - 1)]
        return float(unit * np.median(self.following.sd[:, component]))


def student_of(samples: FloatArray) -> tuple[float, float, float]:
    """Centre, scale and degrees of freedom of the Student-t distribution with the central 50 % and 95 % of samples.

    The degrees of freedom are limited to `DOF`. At a limit only the central 95 % is that of the samples.
    """
    low, quarter, centre, three, high = np.quantile(samples, [0.025, 0.25, 0.5, 0.75, 0.975])
    ratio = (high - low) / (three - quarter)

    def excess(log_dof: float) -> float:
        outer, inner = stdtrit(np.exp(log_dof), [0.975, 0.75])
        return float(outer / inner - ratio)

    ends = np.log(DOF)
    if excess(ends[0]) < 0:
        dof = DOF[0]
    elif excess(ends[1]) > 0:
        dof = DOF[1]
    else:
        dof = float(np.exp(brentq(excess, *ends)))
    return float(centre), float((high - low) / (2 * stdtrit(dof, 0.975))), dof


def evidence_of(draws: FloatArray, ess: float, prior_mean: FloatArray, prior_precision: FloatArray) -> EarlierFingers:
    """Normal likelihood of one finger: draws (n, d) of its posterior, divided by its own independent priors.

    The information is zero in directions in which the posterior is not narrower than the prior.
    """
    n, d = draws.shape
    mean, covariance = draws.mean(axis=0), np.cov(draws.T).reshape(d, d)
    # The inverse of the covariance of few draws is on average too large: it is multiplied by a factor below one.
    posterior = np.linalg.inv(covariance) * max(1 - (d + 1) / min(n, max(ess, d + 2.0)), 0.0)
    values, axes = np.linalg.eigh(posterior - np.diag(prior_precision))
    informed = values > 0
    shift = axes.T @ (posterior @ mean - prior_precision * prior_mean)
    precision = (axes * np.where(informed, values, 0.0)) @ axes.T
    return EarlierFingers(precision[None], (axes @ np.where(informed, shift, 0.0))[None])


def _elastic(calibrations: Sequence[Calibration], sensor: Sensor) -> LearnedPrior:
    """σ, log μ and the depths together: their errors are correlated in every calibration."""
    finger, (default, _) = finger_of(sensor), FingerPriors.of(sensor)
    m = finger.n_elements
    pairs = [(default.poisson_ratio, False), (default.shear_modulus, True), *[(default.sensing_radius, False)] * m]
    centre, scale = np.array([normal_approximation(*pair) for pair in pairs]).T
    found = []
    for calibration in calibrations:
        own = _priors_of(calibration.parameters)
        stated = [_precision(own["sigma"], False), _precision(own["mu"], True), *[_precision(own["r_s"], False)] * m]
        mean, precision = np.array(stated).T
        draws = np.concatenate(
            [
                _flat(calibration.posterior["sigma"])[:, None],
                np.log(_flat(calibration.posterior["mu"]))[:, None],
                _flat(calibration.posterior["r_s"]),
            ],
            axis=1,
        )
        found.append(
            evidence_of((draws - centre) / scale, _ess(calibration), (mean - centre) / scale, precision * scale**2)
        )
    return LearnedPrior(predict(Population.of(2, m), _joined(found), SEED), centre, scale)


def _of_elements(calibrations: Sequence[Calibration], name: str, spread: float) -> LearnedPrior:
    """Population of the logarithms of responses or noise.

    The default priors are relative to the readings, and files do not contain their centres. They are a hundred times as
    wide as the posteriors, so that the posterior mean is used as the centre. A dead element then adds no information.
    """
    draws = [np.log(np.abs(_flat(calibration.posterior[name]))) for calibration in calibrations]
    middle = float(np.median([each.mean(axis=0) for each in draws]))
    centres = [each.mean(axis=0) for each in draws]
    return _logarithms(calibrations, name, draws, centres, middle, spread)


def _discrepancies(calibrations: Sequence[Calibration], samples: float) -> LearnedPrior:
    """Population of the log discrepancies, as multiples of the noise of a mean of `samples` readings."""
    draws, centres = [], []
    for calibration in calibrations:
        own, _ = _precision(_priors_of(calibration.parameters)["discrepancy_sd"], True)
        counts = calibration.rows.counts
        rescaled = 0.5 * np.log(samples / np.median(counts[counts > 0]))
        centres.append(own + rescaled)
        share = _flat(calibration.posterior["discrepancy_sd"]) / _flat(calibration.posterior["noise_sd"])
        draws.append(np.log(share) + 0.5 * np.log(samples))
    return _logarithms(
        calibrations, "discrepancy_sd", draws, centres, float(np.log(DISCREPANCY.median)), DISCREPANCY.spread
    )


def _has_discrepancies(calibration: Calibration) -> bool:
    """Whether the calibration has draws of discrepancies; in a normal approximation they are constant."""
    draws = calibration.posterior.get("discrepancy_sd")
    known = "discrepancy_sd" in _priors_of(calibration.parameters)
    return known and draws is not None and bool((_flat(draws).std(axis=0) > 0).all() and (draws > 0).all())


def _logarithms(
    calibrations: Sequence[Calibration],
    name: str,
    draws: Sequence[FloatArray],
    centres: Sequence[ArrayLike],
    middle: float,
    spread: float,
) -> LearnedPrior:
    """Population of a value of each element, from draws (n, m) of its logarithm and centres of the earlier priors."""
    m = draws[0].shape[1]
    found = []
    for calibration, each, centre in zip(calibrations, draws, centres, strict=True):
        _, precision = _precision(_priors_of(calibration.parameters)[name], True)
        own = np.broadcast_to((np.asarray(centre) - middle) / spread, m)
        scaled = (each - middle) / spread
        found.append(evidence_of(scaled, _ess(calibration), own, np.full(m, precision * spread**2)))
    return LearnedPrior(predict(Population.of(0, m), _joined(found), SEED), np.full(m, middle), np.full(m, spread))


def _precision(prior: Prior, logarithmic: bool) -> tuple[float, float]:
    """Mean and precision of the normal approximation of a prior; the precision of a uniform prior is zero."""
    mean, sd = normal_approximation(prior, logarithmic)
    return mean, 0.0 if isinstance(prior, Uniform) else sd**-2.0


def _priors_of(parameters: Sequence[Parameter]) -> dict[str, Prior]:
    return {parameter.name: parameter.prior for parameter in parameters}


def _flat(draws: FloatArray) -> FloatArray:
    """Draws (n, ...) of all chains together, from (chain, draw, ...)."""
    return np.asarray(draws.reshape(-1, *draws.shape[2:]), dtype=np.float64)


def _ess(calibration: Calibration) -> float:
    """Smallest effective number of draws; all are independent if the posterior is a normal approximation."""
    return float(calibration.statistics.get("ess_bulk", np.inf))


def _joined(found: Sequence[EarlierFingers]) -> EarlierFingers:
    return EarlierFingers(np.concatenate([e.precision for e in found]), np.concatenate([e.shift for e in found]))


def _log_student(centre: float, scale: float, dof: float) -> LogStudentT:
    return LogStudentT(float(np.exp(centre)), scale, dof)


def _factors(learned: LearnedPrior) -> str:
    between, within = (np.exp(learned.sd(i)) for i in range(2))
    return f"between fingers a factor of {between:.3g}, between elements {within:.3g}"
