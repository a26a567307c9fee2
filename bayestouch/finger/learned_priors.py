"""Priors of a finger that are learned from calibrations of earlier fingers of the same build."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq
from scipy.special import stdtrit

from bayestouch.array_types import FloatArray
from bayestouch.data.sensor import Sensor, finger_of
from bayestouch.errors import InputError
from bayestouch.finger.layout import normal_approximation
from bayestouch.finger.population import Evidence, NextFinger, Population, predict
from bayestouch.finger.priors import FingerPriors
from bayestouch.priors.parameters import LogStudentT, Parameter, Prior, StudentT, Uniform
from bayestouch.results.keys import LIKE
from bayestouch.results.objects import Calibration

# Half-normal scales of the sds of log responses and log noise; the default priors of one finger have these sds.
RESPONSE_SPREAD, NOISE_SPREAD = float(np.log(3.0)), float(np.log(10.0))
# Chains with normal proposals stick in heavier tails than those of 4 degrees of freedom; with 200 the prior is normal.
DOF = 4.0, 200.0
# Draws of an earlier calibration for each of the m + 2 coordinates whose covariance is needed.
LEAST_DRAWS = 5
SEED = 0


def learned_priors(
    earlier: Sequence[tuple[str, Calibration]], sensor: Sensor, contact: str
) -> tuple[dict[str, Prior], tuple[str, ...]]:
    """Priors of the next finger by name, and notes on what was learned.

    Learned are σ, log μ and the depths of the elements together, log responses, and the log noise of the readings.
    What is specific to a finger (angles, discrepancies) or to the rig (force noise) keeps its default prior.

    Parameters
    ----------
    earlier : sequence of (str, Calibration)
        Names, for messages, and calibrations of earlier fingers of the same build.
    sensor : Sensor
        The next finger.
    contact : str
        Its contact model.

    Raises
    ------
    InputError
        A calibration is of another body, geometry, unit or contact model, was itself made with `like`, or is given
        twice.
    """
    for i, (name, calibration) in enumerate(earlier):
        _check(name, calibration, sensor, contact)
        for other, before in earlier[:i]:
            if _same(calibration, before):
                raise InputError(f"like: {name} and {other} are the same calibration; its touches would count twice")
    calibrations = [calibration for _, calibration in earlier]
    build = _elastic(calibrations, sensor)
    default, _ = FingerPriors.of(sensor)
    rng = np.random.default_rng(SEED)
    sigma, log_mu, depth = (build.prior(i, rng) for i in range(3))
    response = _of_elements(calibrations, "response", RESPONSE_SPREAD)
    noise = _of_elements(calibrations, "noise_sd", NOISE_SPREAD)
    priors: dict[str, Prior] = {
        "sigma": StudentT(*sigma, *default.poisson_ratio.support),
        "mu": _log_student(*log_mu),
        "r_s": StudentT(*depth, *default.sensing_radius.support),
        "response": _log_student(*response.prior(0, rng)),
        "noise_sd": _log_student(*noise.prior(0, rng)),
    }
    count = f"{len(earlier)} earlier finger{'s' if len(earlier) > 1 else ''}"
    said = {
        "sigma": f"sd between fingers {build.sd(0):.2g}",
        "mu": f"between fingers a factor of {np.exp(build.sd(1)):.3g}",
        "r_s": f"sd between fingers {build.sd(2):.2g} mm, between elements {build.sd(3):.2g} mm",
        "response": _factors(response),
        "noise_sd": _factors(noise),
    }
    return priors, tuple(f"Prior of {name} learned from {count}: {priors[name]}; {said[name]}." for name in priors)


@dataclass(frozen=True, eq=False)
class Learned:
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
        """Median of an sd of the population; those of elements are last."""
        unit = self.scale[min(component, len(self.scale) - 1)]
        return float(unit * np.median(self.following.sd[:, component]))


def student_of(samples: FloatArray) -> tuple[float, float, float]:
    """Centre, scale and degrees of freedom of the Student-t distribution with the central 50 % and 95 % of samples.

    If it needed fewer degrees of freedom than the least of `DOF`, it has the central 95 % alone, and is wider inside.
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


def evidence_of(draws: FloatArray, ess: float, prior_mean: FloatArray, prior_precision: FloatArray) -> Evidence:
    """Normal likelihood of one finger from draws (n, d) of its posterior; its own independent priors are divided out.

    Directions in which the posterior is not narrower than the prior have no information.
    """
    n, d = draws.shape
    mean, covariance = draws.mean(axis=0), np.cov(draws.T).reshape(d, d)
    # The mean of the inverse of the covariance of few draws is larger than the inverse of the covariance.
    posterior = np.linalg.inv(covariance) * max(1 - (d + 1) / min(n, max(ess, d + 2.0)), 0.0)
    values, axes = np.linalg.eigh(posterior - np.diag(prior_precision))
    informed = values > 0
    shift = axes.T @ (posterior @ mean - prior_precision * prior_mean)
    precision = (axes * np.where(informed, values, 0.0)) @ axes.T
    return Evidence(precision[None], (axes @ np.where(informed, shift, 0.0))[None])


def _elastic(calibrations: Sequence[Calibration], sensor: Sensor) -> Learned:
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
    return Learned(predict(Population.of(2, m), _joined(found), SEED), centre, scale)


def _of_elements(calibrations: Sequence[Calibration], name: str, spread: float) -> Learned:
    """Logarithms of a value of each element."""
    draws = [np.log(np.abs(_flat(calibration.posterior[name]))) for calibration in calibrations]
    middle = float(np.median([each.mean(axis=0) for each in draws]))
    found = []
    for calibration, each in zip(calibrations, draws, strict=True):
        # The default priors are relative to the readings, and the file does not have their centre; they are a hundred
        # times as wide as the posterior. For a dead element both are equal, and nothing is left.
        _, precision = _precision(_priors_of(calibration.parameters)[name], True)
        scaled = (each - middle) / spread
        m = scaled.shape[1]
        own = np.full(m, precision * spread**2)
        found.append(evidence_of(scaled, _ess(calibration), scaled.mean(axis=0), own))
    m = draws[0].shape[1]
    return Learned(predict(Population.of(0, m), _joined(found), SEED), np.full(m, middle), np.full(m, spread))


def _precision(prior: Prior, logarithmic: bool) -> tuple[float, float]:
    """Mean and precision of the normal approximation of a prior; a uniform prior has no precision to divide out."""
    mean, sd = normal_approximation(prior, logarithmic)
    return mean, 0.0 if isinstance(prior, Uniform) else sd**-2.0


def _priors_of(parameters: Sequence[Parameter]) -> dict[str, Prior]:
    return {parameter.name: parameter.prior for parameter in parameters}


def _flat(draws: FloatArray) -> FloatArray:
    """Draws (n, ...) of all chains."""
    return np.asarray(draws.reshape(-1, *draws.shape[2:]), dtype=np.float64)


def _ess(calibration: Calibration) -> float:
    """Smallest effective number of draws; all are independent if the posterior is a normal approximation."""
    return float(calibration.statistics.get("ess_bulk", np.inf))


def _joined(found: Sequence[Evidence]) -> Evidence:
    return Evidence(np.concatenate([e.precision for e in found]), np.concatenate([e.shift for e in found]))


def _log_student(centre: float, scale: float, dof: float) -> LogStudentT:
    return LogStudentT(float(np.exp(centre)), scale, dof)


def _factors(learned: Learned) -> str:
    between, within = (np.exp(learned.sd(i)) for i in range(2))
    return f"between fingers a factor of {between:.3g}, between elements {within:.3g}"


def _check(name: str, calibration: Calibration, sensor: Sensor, contact: str) -> None:
    """Raise `InputError` if a calibration says nothing of this sensor."""
    if calibration.sensor.body.kind != sensor.body.kind:
        raise InputError(f"like: {name} is of a {calibration.sensor.body.kind}, this sensor is a {sensor.body.kind}")
    theirs, ours = finger_of(calibration.sensor), finger_of(sensor)
    if theirs.n_elements != ours.n_elements:
        raise InputError(f"like: {name} has {theirs.n_elements} elements, this finger {ours.n_elements}")
    for what in ("core_radius_mm", "outer_radius_mm", "sensing_radius_mm"):
        if getattr(theirs, what) != getattr(ours, what):
            raise InputError(
                f"like: {name} is of another build: {what} is {getattr(theirs, what):g}, here {getattr(ours, what):g}"
            )
    if not np.allclose(theirs.element_angles_deg, ours.element_angles_deg):
        raise InputError(f"like: {name} is of another build: the angles of its elements are others")
    if calibration.sensor.reading_unit != sensor.reading_unit:
        raise InputError(
            f"like: {name} has readings in {calibration.sensor.reading_unit}, this finger in {sensor.reading_unit}"
        )
    draws = calibration.posterior["sigma"].size
    if draws < (needed := LEAST_DRAWS * (ours.n_elements + 2)):
        raise InputError(f"like: {name} has {draws} draws; expected {needed} or more for their covariance")
    used = str(calibration.settings["contact"])
    if used != contact:
        raise InputError(f"like: {name} has contact model {used!r}, this calibration {contact!r}")
    if calibration.settings.get(LIKE):
        raise InputError(
            f"like: {name} was itself calibrated with like; its posterior has what earlier fingers say, which would "
            "count twice: calibrate it without like"
        )


def _same(one: Calibration, other: Calibration) -> bool:
    """Whether two calibrations are of the same touches."""
    return bool(
        one.rows.observed.shape == other.rows.observed.shape
        and np.array_equal(one.rows.observed, other.rows.observed, equal_nan=True)
    )
