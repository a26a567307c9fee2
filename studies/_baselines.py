"""Touches of a pad read by regression without physics: what a model of the sensor has to be better than.

A regression gives each element's reading as a function of location and load: a Gaussian process, or a polynomial with
a penalty on its coefficients. Neither knows where an element is, or that an unloaded pad reads nothing. It is inverted
on a grid of locations and loads, so that a touch gets a posterior as from a calibration.

Needs scikit-learn (`pip install bayestouch[baselines]`).
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayestouch.model.observations import Observations
from bayestouch.model.split_data import SplitData

Floats = NDArray[np.float64]
#: Touches by which the lengths of a Gaussian process are chosen (it then uses all touches), and starts of that search.
MOST_CHOSEN, STARTS = 400, 2
#: Degrees among which the polynomial is chosen, and the largest number of its terms.
DEGREES, MOST_TERMS = (1, 2, 3, 4, 5, 6, 8, 10, 12), 200
#: Grid: locations along one axis and along each of two, loads, and how far it goes beyond the known touches.
LOCATIONS, LOADS, BEYOND = {1: 601, 2: 121}, 161, 0.05
#: Noise of a force sensor whose noise is not stated, over the mean load: as a calibration assumes.
FORCE_NOISE = 0.005
FOLDS, COVERED, CHUNK = 5, 0.9, 2000


@dataclass(frozen=True)
class Known:
    """Touches with known location; t touches, m elements.

    Attributes
    ----------
    location : (t, D) array
        Locations, mm.
    load : (t,) array or None
        Loads, N; None if they were not measured.
    readings : (t, m) array
        Mean readings of touches over the peak of each element; NaN missing.
    """

    location: Floats
    load: Floats | None
    readings: Floats

    @classmethod
    def of(cls, observed: Observations, peak: Floats) -> Known:
        """Touches of a fit, or those held out of it."""
        means = observed.means
        load = means.load if np.isfinite(means.load).all() else None
        return cls(means.location, load, means.readings / peak)

    @property
    def inputs(self) -> Floats:
        """Location, and load if it was measured, (t, D or D + 1)."""
        return self.location if self.load is None else np.column_stack([self.location, self.load])


@dataclass(frozen=True)
class Regression:
    """A regression for each element: mean and standard deviation of a reading at inputs (k, D or D + 1).

    Attributes
    ----------
    name : str
        Its name in tables.
    of_elements : tuple of callables
        Mean (k,) and standard deviation (k,) of a reading of one touch, noise included.
    left_out_percent : float
        Error of readings of known touches that were left out, percent of the peak: mean of the elements.
    """

    name: str
    of_elements: tuple[Callable[[Floats], tuple[Floats, Floats]], ...]
    left_out_percent: float

    def __call__(self, inputs: Floats) -> tuple[Floats, Floats]:
        """Means and standard deviations, (k, m) each."""
        parts = [[each(inputs[i : i + CHUNK]) for each in self.of_elements] for i in range(0, len(inputs), CHUNK)]
        both = np.concatenate([np.array(part) for part in parts], axis=2)
        return both[:, 0].T, both[:, 1].T


@dataclass(frozen=True)
class Read:
    """Posteriors of held-out touches, read by a regression; t touches.

    Attributes
    ----------
    residual : (t, m) array
        Reading minus prediction at the reference, over the peak.
    location, location_sd : (t, D) arrays
        Posterior mean and standard deviation, mm, with the load given where it was measured.
    location_inside : (t,) bool array
        Whether the smallest region with 90 % of the posterior has the reference.
    load, load_sd : (t,) arrays
        The same of the load inferred from readings alone, N; NaN if loads were not measured.
    load_interval : (t, 2) array
        Central 90 % interval of the load, N.
    """

    residual: Floats
    location: Floats
    location_sd: Floats
    location_inside: NDArray[np.bool_]
    load: Floats
    load_sd: Floats
    load_interval: Floats


def gaussian_process(known: Known, seed: int = 0) -> Regression:
    """Gaussian process for each element, with a length for each input and a noise, by its marginal likelihood."""
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel

    centre, scale = known.inputs.mean(axis=0), known.inputs.std(axis=0)
    few = np.random.default_rng(seed).permutation(len(known.inputs))[:MOST_CHOSEN]

    def one(element: int) -> tuple[Callable[[Floats], tuple[Floats, Floats]], float]:
        seen = np.isfinite(known.readings[:, element])
        x, y = ((known.inputs - centre) / scale)[seen], known.readings[seen, element]
        kernel = ConstantKernel(1.0, (1e-4, 1e6)) * Matern([0.5] * x.shape[1], (1e-2, 1e2), nu=2.5)
        kernel = kernel + WhiteKernel(1e-3, (1e-8, 1.0))
        chosen = GaussianProcessRegressor(kernel, normalize_y=True, n_restarts_optimizer=STARTS - 1, random_state=seed)
        part = few[seen[few]]
        with warnings.catch_warnings():
            # A length or a noise at its bound: an input, or a noise, that this element does not show.
            warnings.simplefilter("ignore", ConvergenceWarning)
            chosen.fit(((known.inputs - centre) / scale)[part], known.readings[part, element])
        fitted = GaussianProcessRegressor(chosen.kernel_, optimizer=None, normalize_y=True).fit(x, y)
        # Rasmussen and Williams (2006), equation 5.12, in the units of the readings.
        precision = np.linalg.inv(fitted.kernel_(x))
        left_out = fitted.alpha_.ravel() / np.diag(precision) * y.std()
        return (
            lambda inputs: fitted.predict((inputs - centre) / scale, return_std=True),
            float(np.sqrt(np.mean(left_out**2))),
        )

    return _of_all("Gaussian process", [one(element) for element in range(known.readings.shape[1])])


def polynomial(known: Known) -> Regression:
    """Polynomial of location and load for each element, its degree and penalty chosen by readings left out."""
    from sklearn.linear_model import RidgeCV
    from sklearn.model_selection import KFold, cross_val_predict
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import MinMaxScaler, PolynomialFeatures, StandardScaler

    def terms(degree: int) -> int:
        from math import comb

        return comb(known.inputs.shape[1] + degree, degree)

    def one(element: int) -> tuple[Callable[[Floats], tuple[Floats, Floats]], float]:
        seen = np.isfinite(known.readings[:, element])
        x, y = known.inputs[seen], known.readings[seen, element]
        tried: list[tuple[float, Any]] = []
        for degree in DEGREES:
            if terms(degree) > min(MOST_TERMS, len(x) / 2):
                continue
            made = make_pipeline(
                MinMaxScaler((-1, 1)),
                PolynomialFeatures(degree, include_bias=False),
                StandardScaler(),
                RidgeCV(np.logspace(-8, 2, 11)),
            )
            left_out = y - cross_val_predict(made, x, y, cv=KFold(FOLDS, shuffle=True, random_state=0))
            tried.append((float(np.sqrt(np.mean(left_out**2))), made))
        error, best = min(tried, key=lambda each: each[0])
        best.fit(x, y)
        return lambda inputs: (best.predict(inputs), np.full(len(inputs), error)), error

    return _of_all("polynomial", [one(element) for element in range(known.readings.shape[1])])


def _of_all(name: str, made: list[tuple[Callable[[Floats], tuple[Floats, Floats]], float]]) -> Regression:
    return Regression(name, tuple(each for each, _ in made), 100 * float(np.mean([error for _, error in made])))


def read(regression: Regression, known: Known, held: Known, force_sd: float | None = None) -> Read:
    """Read touches by a regression of known touches; prior uniform over the region and the loads of these.

    Parameters
    ----------
    regression : Regression
        The regression.
    known, held : Known
        Touches that it was fitted to, and the touches to be read.
    force_sd : float, optional
        Noise of the force sensor, N; by default a share of the mean load.
    """
    axes = [_axis(column, LOCATIONS[known.location.shape[1]]) for column in known.location.T]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))
    residual = held.readings - regression(held.inputs)[0]
    if known.load is None or held.load is None:
        weight = _weights(_log_likelihood(held.readings, *regression(places)))
        none = np.full(len(held.readings), np.nan)
        return Read(residual, *_of_location(weight, places, axes, held.location), none, none, np.stack([none] * 2, 1))
    loads = _axis(known.load, LOADS)
    grid = np.column_stack([np.repeat(places, LOADS, axis=0), np.tile(loads, len(places))])
    mean, sd = (each.reshape(len(places), LOADS, -1) for each in regression(grid))
    force_sd = FORCE_NOISE * float(known.load.mean()) if force_sd is None else force_sd
    of_location, of_load = [], []
    for reading, load in zip(held.readings, held.load, strict=True):
        # Far below the step of the grid: the load as it was read, its noise as that of readings.
        at = np.clip(np.interp(load, loads, np.arange(LOADS)), 0, LOADS - 1.001)
        low, share = int(at), at - int(at)
        here, spread = ((1 - share) * each[:, low] + share * each[:, low + 1] for each in (mean, sd))
        slope = (mean[:, low + 1] - mean[:, low]) / (loads[1] - loads[0])
        of_location.append(_log_likelihood(reading[None], here, np.hypot(spread, slope * force_sd))[0])
        both = _log_likelihood(reading[None], mean.reshape(len(grid), -1), sd.reshape(len(grid), -1))[0]
        of_load.append(np.logaddexp.reduce(both.reshape(len(places), LOADS), axis=0))
    weight, of_loads = _weights(np.array(of_location)), _weights(np.array(of_load))
    load_mean = of_loads @ loads
    load_sd = np.sqrt(np.maximum(of_loads @ loads**2 - load_mean**2, 0.0))
    below = np.cumsum(of_loads, axis=1) - 0.5 * of_loads
    tail = (1 - COVERED) / 2
    interval = np.array([np.interp([tail, 1 - tail], each, loads) for each in below])
    return Read(residual, *_of_location(weight, places, axes, held.location), load_mean, load_sd, interval)


def _axis(values: Floats, count: int) -> Floats:
    margin = BEYOND * np.ptp(values)
    return np.linspace(values.min() - margin, values.max() + margin, count)


def _log_likelihood(readings: Floats, mean: Floats, sd: Floats) -> Floats:
    """Log density of readings (t, m) at grid points (k, m), shape (t, k); readings that are missing say nothing."""
    out = np.zeros((len(readings), len(mean)))
    for column, centre, spread in zip(readings.T, mean.T, sd.T, strict=True):
        seen = np.isfinite(column)
        out[seen] -= 0.5 * ((column[seen, None] - centre) / spread) ** 2 + np.log(spread)
    return out


def _weights(log_density: Floats) -> Floats:
    weight = np.exp(log_density - log_density.max(axis=1, keepdims=True))
    return weight / weight.sum(axis=1, keepdims=True)


def _of_location(
    weight: Floats, places: Floats, axes: list[Floats], reference: Floats
) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    """Mean, standard deviation, and whether the reference is in the smallest region with 90 % of the posterior."""
    mean = weight @ places
    sd = np.sqrt(np.maximum(weight @ places**2 - mean**2, 0.0))
    steps = [
        np.clip(np.rint((x - axis[0]) / (axis[1] - axis[0])), 0, len(axis) - 1)
        for x, axis in zip(reference.T, axes, strict=True)
    ]
    node = np.ravel_multi_index(tuple(step.astype(int) for step in steps), tuple(len(axis) for axis in axes))
    own = weight[np.arange(len(weight)), node]
    above = np.where(weight > own[:, None], weight, 0.0).sum(axis=1)
    return mean, sd, above + 0.5 * own <= COVERED


def baselines(data: SplitData, held_out: Observations, peak: Floats) -> list[tuple[Regression, Read]]:
    """Both regressions of all touches that are not held out, and the held-out touches as they read them."""
    known, held = Known.of(data.observations(data.training), peak), Known.of(held_out, peak)
    noise = data.dataset.sensor.force_noise_sd
    return [(each, read(each, known, held, noise)) for each in (gaussian_process(known), polynomial(known))]
