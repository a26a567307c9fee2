"""A finger's likelihood written out with numpy and scipy: what the tests of this folder hold the package against.

The prediction of a touch is the package's (`FingerChain.predict`; other tests hold it against an independent solver).
Everything after it is written out here: noise, covariance, priors, transforms and derivatives.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import stats

from bayestouch.chain.finger import FingerChain
from bayestouch.data.dataset import DataSet
from bayestouch.data.sensor import Finger, Rubber, Sensor
from bayestouch.data.touches import Touches, touches_from

CORE, OUTER, DEPTH = 9.4, 12.7, 9.9
ANGLES = (-17.6, -8.8, 0.0, 8.8, 17.6)
ELEMENTS = len(ANGLES)
#: Noise of one raw reading (counts) and of one reading of the force sensor (N/m).
NOISE, FORCE_NOISE = 12.0, 1.0
#: Central differences: response (share), depth (mm), angle (rad), Poisson's ratio, log shear modulus.
STEPS = 1e-4, 1e-3, 1e-4, 2e-4, 2e-3


def sensor(**changes: object) -> Sensor:
    """A finger of five elements as its maker describes it."""
    stated: dict[str, object] = {"force_noise_sd": FORCE_NOISE, "rubber": Rubber(0.15, 0.46)}
    return Sensor(
        name="five elements",
        body=Finger(CORE, OUTER, DEPTH, ANGLES),
        reading_unit="counts",
        reading_quantity="capacitance",
        source={},
        **(stated | changes),
    )


def true_finger(seed: int = 5) -> FingerChain:
    """The finger as it really is."""
    rng = np.random.default_rng(seed)
    return finger(
        response=rng.uniform(3.5, 6.0, ELEMENTS),
        depth=rng.normal(9.95, 0.1, ELEMENTS),
        angle=np.radians(np.array(ANGLES) + rng.normal(0, 0.5, ELEMENTS)),
        poisson_ratio=0.465,
        shear_modulus_MPa=0.14,
    )


def finger(
    response: np.ndarray, depth: np.ndarray, angle: np.ndarray, poisson_ratio: float, shear_modulus_MPa: float
) -> FingerChain:
    """A finger with these values (depths in mm, angles in rad)."""
    return FingerChain(
        core_radius_mm=CORE,
        outer_radius_mm=OUTER,
        response=response,
        sensing_radius_mm=depth,
        angle=angle,
        offset=np.zeros(len(response)),
        poisson_ratio=poisson_ratio,
        shear_modulus_MPa=shear_modulus_MPa,
        largest_load=800.0,
    )


@dataclass(frozen=True, eq=False)
class Pressed:
    """Touches as they were made: composite radius (mm), location (rad), load (N/m), all (t,)."""

    radius: np.ndarray
    angle: np.ndarray
    load: np.ndarray

    @property
    def tip(self) -> np.ndarray:
        """Radius of the probe's tip: 1/R = 1/r_b + 1/r_c."""
        with np.errstate(divide="ignore"):
            return np.where(self.radius >= OUTER, np.inf, 1 / (1 / np.maximum(self.radius, 1e-300) - 1 / OUTER))


def calibrating(rng: np.random.Generator, step: float = 2.0, reach: float = 32.0) -> Pressed:
    """Edges every `step` degrees and flats at every other place."""
    places = np.arange(-reach, reach + 0.1, step)
    angle = np.concatenate([places, places[::2]])
    radius = np.concatenate([np.zeros(len(places)), np.full(len(places[::2]), OUTER)])
    return Pressed(radius, np.radians(angle), rng.uniform(160, 240, len(angle)))


def recorded(
    chain: FingerChain,
    pressed: Pressed,
    rng: np.random.Generator,
    *,
    samples: int,
    noise: float = NOISE,
    force_noise: float = FORCE_NOISE,
    after: Callable[[np.ndarray], np.ndarray] = lambda readings: readings,
) -> Touches:
    """A table of samples with independent normal errors, a touch every ten seconds; effects come `after`."""
    clean = after(chain.predict(pressed.radius, pressed.angle, pressed.load))
    row = np.repeat(np.arange(len(pressed.load)), samples)
    tip = np.where(pressed.radius == 0, 0.0, pressed.tip)
    return touches_from(
        touch=row,
        sample=np.tile(np.arange(samples), len(pressed.load)),
        time_s=10.0 * row + np.tile(np.linspace(0, 1, samples), len(pressed.load)),
        readings=clean[row] + noise * rng.standard_normal((len(row), clean.shape[1])),
        indenter_radius_mm=tip[row],
        angle_deg=np.degrees(pressed.angle)[row],
        load=pressed.load[row] + force_noise * rng.standard_normal(len(row)),
    )


def dataset(calibration: Touches | None, touches: Touches, **changes: object) -> DataSet:
    """A data set of the five elements."""
    return DataSet(sensor(**changes), calibration, touches, None, ())


def parameters_of(values: dict[str, np.ndarray]) -> np.ndarray:
    """Response, depth (mm), angle (rad), σ and log μ in a row, of values by public name; leading axes are kept."""
    last = [np.asarray(values[name])[..., None] for name in ("sigma", "mu")]
    own = [values["response"], values["r_s"], np.radians(values["theta_s"])]
    return np.concatenate([*map(np.asarray, own), last[0], np.log(last[1])], axis=-1)


def finger_at(parameters: np.ndarray) -> FingerChain:
    """The finger of a row of `parameters_of`."""
    response, depth, angle = parameters[:-2].reshape(3, -1)
    return finger(response, depth, angle, float(parameters[-2]), float(np.exp(parameters[-1])))


def slopes(parameters: np.ndarray, pressed: Pressed) -> np.ndarray:
    """Derivative (d, t, m) of the readings over each of `parameters_of`, by central differences.

    Response, depth and angle of an element move that element alone: all elements are moved at once.
    """
    m = (len(parameters) - 2) // 3
    out = np.zeros((len(parameters), len(pressed.load), m))
    for block, step in enumerate(STEPS):
        place = slice(block * m, (block + 1) * m) if block < 3 else 3 * m + block - 3
        size = step * (parameters[place] if block == 0 else np.ones_like(parameters[place]))
        ends = []
        for sign in (1, -1):
            moved = parameters.copy()
            moved[place] += sign * size
            ends.append(finger_at(moved).predict(pressed.radius, pressed.angle, pressed.load))
        slope = (ends[0] - ends[1]) / (2 * size)
        if block < 3:
            out[np.arange(m) + block * m, :, np.arange(m)] = slope.T
        else:
            out[place] = slope
    return out


def slope_over_load(chain: FingerChain, pressed: Pressed) -> np.ndarray:
    """Derivative (t, m) of the readings over the load."""
    step = 1e-3 * pressed.load
    up, down = (chain.predict(pressed.radius, pressed.angle, pressed.load + sign * step) for sign in (1, -1))
    return (up - down) / (2 * step[:, None])


def prior_sd(parameters: np.ndarray) -> np.ndarray:
    """Standard deviations of the default priors of a finger with stated rubber, as `FingerPriors` documents them.

    Response within a factor of 3; depth within a tenth of the rubber; angle within a quarter of the pitch; σ within
    0.02; μ within a factor of 1.35.
    """
    m = (len(parameters) - 2) // 3
    own = [np.log(3.0) * parameters[:m], np.full(m, 0.1 * (OUTER - CORE)), np.full(m, np.radians(0.25 * 8.8))]
    return np.concatenate([*own, [0.02, np.log(1.35)]])


def information(slope: np.ndarray, by_load: np.ndarray, variance: np.ndarray, load_variance: float) -> np.ndarray:
    """Information (d, d) of mean readings of `variance` (m,), and of loads of `load_variance`, on the parameters."""
    total = np.zeros((len(slope), len(slope)))
    for touch in range(by_load.shape[0]):
        covariance = np.diag(variance) + load_variance * np.outer(by_load[touch], by_load[touch])
        total += slope[:, touch] @ np.linalg.solve(covariance, slope[:, touch].T)
    return total


def mean_ratio(covariance: np.ndarray, expected: np.ndarray) -> float:
    """Mean of the variances of `covariance` over those `expected`, in the directions that make the latter round.

    Of n independent normal draws in d dimensions it is 1 ± sqrt(2/(n d)).
    """
    return float(np.trace(np.linalg.solve(expected, covariance)) / len(expected))


@dataclass(frozen=True, eq=False)
class TouchByQuadrature:
    """Mean and sd of R (mm), location (rad) and load of one touch, by summing its written-out posterior over a box."""

    mean: np.ndarray
    sd: np.ndarray


def touch_posterior(
    predict: Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray],
    reading: np.ndarray,
    covariance: np.ndarray,
    measured_load: tuple[float, float] | None,
    centre: np.ndarray,
    sd: np.ndarray,
    *,
    radius_density: Callable[[np.ndarray], np.ndarray] = lambda radius: np.ones_like(radius),
    steps: int = 25,
) -> TouchByQuadrature:
    """The posterior of a touch: normal readings and load, R between 0 and r_b, uniform location and load.

    Parameters
    ----------
    predict : callable
        Readings (n, m) at R, location and load, (n,) each.
    reading : (m,) array
        What was read.
    covariance : (m, m) array
        Of the reading.
    measured_load : (float, float) or None
        Load as read and its standard error.
    centre, sd : (3,) arrays
        Middle of the box; it reaches 5.5 sd to each side. Steps of less than half an sd are exact to a thousandth.
    radius_density : callable
        Prior density of R; uniform by default.
    steps : int
        Points along each axis.
    """
    low, high = centre - 5.5 * sd, centre + 5.5 * sd
    low[0], high[0] = max(low[0], 0.0), min(high[0], OUTER)
    axes = [a + (np.arange(steps) + 0.5) * (b - a) / steps for a, b in zip(low, high, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    log = stats.multivariate_normal(reading, covariance).logpdf(predict(*points.T))
    log = log + np.log(radius_density(points[:, 0]))
    if measured_load is not None:
        log = log + stats.norm(*measured_load).logpdf(points[:, 2])
    weight = np.exp(log - log.max())
    weight /= weight.sum()
    mean = weight @ points
    return TouchByQuadrature(mean, np.sqrt(weight @ (points - mean) ** 2))
