"""Two regressions of the readings of a pad on location and load: a Gaussian process and a polynomial."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import comb
from typing import Any

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.errors import InputError
from bayestouch.model.observations import Observations

#: Touches by which the lengths of a Gaussian process are chosen (it then uses all touches), and starts of that search.
MOST_CHOSEN, STARTS = 400, 2
#: Degrees among which the polynomial is chosen, and the largest number of its terms.
DEGREES, MOST_TERMS = (1, 2, 3, 4, 5, 6, 8, 10, 12), 200
#: Folds by which its degree is chosen.
FOLDS = 5
#: Seed for the touches by which lengths are chosen, and for the starts of that search: each fit gives the same.
SEED = 0
#: Touches that a regression predicts at once, so that memory stays below 100 MB.
CHUNK = 2000

#: Mean (k,) and standard deviation (k,) of one element's reading at inputs (k, D or D + 1).
OfElement = Callable[[FloatArray], tuple[FloatArray, FloatArray]]


@dataclass(frozen=True, eq=False)
class RegressionTouches:
    """Touches with known location; t touches, m elements, D dimensions.

    Attributes
    ----------
    location : (t, D) array
        Locations, mm.
    load : (t,) array or None
        Loads, N; None if they were not measured.
    readings : (t, m) array
        Mean readings of touches over the peak of each element; NaN missing.
    reads_of_load : (t,) array or None
        Number of readings of the force sensor of which each load is the mean; None if it is one.
    """

    location: FloatArray
    load: FloatArray | None
    readings: FloatArray
    reads_of_load: FloatArray | None = None

    @classmethod
    def of(cls, observed: Observations, peak: FloatArray, *, loaded: bool = True) -> RegressionTouches:
        """Touches of a fit, or those held out of it.

        Parameters
        ----------
        observed : Observations
            The touches, minus the rest reading.
        peak : (m,) array
            Peak reading of each element, in the unit of the readings.
        loaded : bool
            Use the loads, if that of each touch was measured.
        """
        means = observed.means
        load = means.load if loaded and np.isfinite(means.load).all() else None
        return cls(means.location, load, means.readings / peak, means.reads_of_load)

    @property
    def inputs(self) -> FloatArray:
        """Location in mm, and load in N if it was measured, (t, D or D + 1)."""
        return self.location if self.load is None else np.column_stack([self.location, self.load])


@dataclass(frozen=True, eq=False)
class Regression:
    """A regression for each element: mean and standard deviation of a reading at inputs (k, D or D + 1).

    Attributes
    ----------
    name : str
        Its name in tables.
    of_elements : tuple of callables
        Mean (k,) and standard deviation (k,) of a reading of one touch over the peak, noise included. NaN for an
        element that is too seldom read for a regression, or whose readings are all the same.
    left_out_percent : float
        Error of readings of known touches that were left out, percent of the peak: mean of the elements.
    """

    name: str
    of_elements: tuple[OfElement, ...]
    left_out_percent: float

    def __call__(self, inputs: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Means and standard deviations of readings over the peak, (k, m) each."""
        parts = [[each(inputs[i : i + CHUNK]) for each in self.of_elements] for i in range(0, len(inputs), CHUNK)]
        both = np.concatenate([np.array(part) for part in parts], axis=2)
        return both[:, 0].T, both[:, 1].T


def require_scikit_learn() -> None:
    """Raise an error if scikit-learn is not installed.

    Raises
    ------
    InputError
        It is not installed; the message says how to install it.
    """
    try:
        import sklearn  # noqa: F401
    except ImportError:
        raise InputError(
            "regression without physics needs scikit-learn, which is not installed: pip install 'bayestouch[baselines]'"
        ) from None


def gaussian_process(known: RegressionTouches) -> Regression:
    """Gaussian process for each element, with a length for each input and a noise, by its marginal likelihood.

    Parameters
    ----------
    known : RegressionTouches
        Touches that it is fitted to.

    Returns
    -------
    Regression
        Matérn covariance of smoothness 5/2. Readings left out follow from equation 5.12 of Rasmussen and Williams,
        Gaussian Processes for Machine Learning (2006).

    Raises
    ------
    InputError
        scikit-learn is not installed.
    """
    require_scikit_learn()
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel

    centre, spread = known.inputs.mean(axis=0), known.inputs.std(axis=0)
    # An input that is the same in all touches has no scale, and says nothing.
    scale = np.where(spread > 0, spread, 1.0)
    order = np.random.default_rng(SEED).permutation(len(known.inputs))

    def one(element: int) -> tuple[OfElement, float]:
        if not _can_be_fitted(known, element):
            return _unknown, np.nan
        seen = np.isfinite(known.readings[:, element])
        x, y = ((known.inputs - centre) / scale)[seen], known.readings[seen, element]
        kernel = ConstantKernel(1.0, (1e-4, 1e6)) * Matern([0.5] * x.shape[1], (1e-2, 1e2), nu=2.5)
        kernel = kernel + WhiteKernel(1e-3, (1e-8, 1.0))
        chosen = GaussianProcessRegressor(kernel, normalize_y=True, n_restarts_optimizer=STARTS - 1, random_state=SEED)
        part = order[seen[order]][:MOST_CHOSEN]
        with warnings.catch_warnings():
            # A length or a noise at its bound: an input, or a noise, that this element does not show.
            warnings.simplefilter("ignore", ConvergenceWarning)
            chosen.fit(((known.inputs - centre) / scale)[part], known.readings[part, element])
        fitted = GaussianProcessRegressor(chosen.kernel_, optimizer=None, normalize_y=True).fit(x, y)
        # Rasmussen and Williams (2006), equation 5.12, in the units of the readings.
        precision = np.linalg.inv(fitted.kernel_(x))
        left_out = fitted.alpha_.ravel() / np.diag(precision) * y.std()
        return partial(_by_process, fitted, centre, scale), float(np.sqrt(np.mean(left_out**2)))

    return _of_all("Gaussian process", [one(element) for element in range(known.readings.shape[1])])


def polynomial(known: RegressionTouches) -> Regression:
    """Polynomial of location and load for each element, its degree and penalty chosen by readings left out.

    Parameters
    ----------
    known : RegressionTouches
        Touches that it is fitted to.

    Returns
    -------
    Regression
        Its standard deviation is the same everywhere: the error of readings that were left out.

    Raises
    ------
    InputError
        scikit-learn is not installed.
    """
    require_scikit_learn()
    from sklearn.linear_model import RidgeCV
    from sklearn.model_selection import KFold, cross_val_predict
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import MinMaxScaler, PolynomialFeatures, StandardScaler

    def one(element: int) -> tuple[OfElement, float]:
        if not _can_be_fitted(known, element):
            return _unknown, np.nan
        seen = np.isfinite(known.readings[:, element])
        x, y = known.inputs[seen], known.readings[seen, element]
        tried: list[tuple[float, Any]] = []
        for degree in DEGREES:
            if _terms(known, degree) > min(MOST_TERMS, len(x) / 2):
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
        return partial(_by_polynomial, best, error), error

    return _of_all("polynomial", [one(element) for element in range(known.readings.shape[1])])


def _by_process(
    fitted: Any, centre: FloatArray, scale: FloatArray, inputs: FloatArray
) -> tuple[FloatArray, FloatArray]:
    mean, sd = fitted.predict((inputs - centre) / scale, return_std=True)
    return mean, sd


def _by_polynomial(fitted: Any, error: float, inputs: FloatArray) -> tuple[FloatArray, FloatArray]:
    return fitted.predict(inputs), np.full(len(inputs), error)


def _terms(known: RegressionTouches, degree: int) -> int:
    return comb(known.inputs.shape[1] + degree, degree)


def _can_be_fitted(known: RegressionTouches, element: int) -> bool:
    """Whether an element has enough readings: twice the terms of a plane, one in each fold, and not all the same."""
    column = known.readings[:, element]
    read = column[np.isfinite(column)]
    return bool(len(read) >= max(2 * _terms(known, 1), FOLDS) and np.ptp(read) > 0)


def _unknown(inputs: FloatArray) -> tuple[FloatArray, FloatArray]:
    return np.full(len(inputs), np.nan), np.full(len(inputs), np.nan)


def _of_all(name: str, made: list[tuple[OfElement, float]]) -> Regression:
    errors = [error for _, error in made if np.isfinite(error)]
    left_out = 100 * float(np.mean(errors)) if errors else float("nan")
    return Regression(name, tuple(each for each, _ in made), left_out)
