"""Observed errors by indenter and location, and scores of how well a prediction explains them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bayestouch.array_types import FloatArray
from bayestouch.data.arrays import nearest_turn
from bayestouch.data.grouping import index_among
from bayestouch.errors import InputError
from bayestouch.output.summary import Summarised
from bayestouch.results.objects import TouchPosteriors

#: Mean absolute value of a normal variable divided by its standard deviation.
MEAN_ABSOLUTE = float(np.sqrt(2 / np.pi))
#: Bootstrap samples for the intervals of scores: 15 of them are beyond each end.
BOOTSTRAPS = 300
#: Neighbouring locations that a bootstrap draws together, because they have nearly the same error.
BLOCK = 8
#: Probability of the intervals whose coverage is asked.
PROBABILITY = 0.9


@dataclass(frozen=True, eq=False, repr=False)
class BiasMap(Summarised):
    """Errors of estimates for k indenters at n locations.

    Attributes
    ----------
    indenters_mm : (k,) array
        Indenter radii r_c.
    angle_deg : (n,) array
        Reference locations.
    error : (k, n) array
        Mean over touches of estimate minus reference; NaN without touches. R in mm, θ_c in degree, P in N/m.
    touches : (k, n) int array
        Number of touches.
    """

    indenters_mm: FloatArray
    angle_deg: FloatArray
    error: FloatArray
    touches: NDArray[np.int64]

    @property
    def location_rms(self) -> FloatArray:
        """Root mean square error over the indenters at each location, (n,)."""
        return np.asarray(np.sqrt(np.nanmean(self.error**2, axis=0)))

    @property
    def shared(self) -> float:
        """Mean correlation over location between indenters; near 1 if the bias belongs to the location (Figure 13)."""
        return shared_by_indenters(self.error)


def observed_bias(posteriors: TouchPosteriors, name: str = "R", *, without: ArrayLike = ()) -> BiasMap:
    """Errors of posterior means by indenter and location.

    Parameters
    ----------
    posteriors : TouchPosteriors
        Posteriors of touches on a finger with reference radius and location.
    name : {"R", "theta_c", "P"}
        The estimated quantity.
    without : (j,) array_like
        Indenters to leave out, r_c in mm: those of the calibration.

    Raises
    ------
    InputError
        If no touch has a reference.
    """
    radius, angle = posteriors.rows.radius_mm, posteriors.reference["theta_c"]
    mean = posteriors.mean(name)
    error = mean - _reference(posteriors.reference[name], mean, name)
    kept = np.isfinite(error) & ~np.isnan(radius) & np.isfinite(angle)
    kept &= ~np.isin(radius, np.asarray(without, dtype=float))
    if not kept.any():
        raise InputError("no touch has a reference radius, location and load to hold its estimate against")
    tips, row = np.unique(radius[kept], return_inverse=True)
    places, column = np.unique(np.round(angle[kept], 6), return_inverse=True)
    touches = np.zeros((len(tips), len(places)), dtype=np.int64)
    total = np.zeros(touches.shape)
    np.add.at(touches, (row, column), 1)
    np.add.at(total, (row, column), error[kept])
    mean = np.divide(total, touches, out=np.full(total.shape, np.nan), where=touches > 0)
    return BiasMap(tips, places, mean, touches)


def shared_by_indenters(error: FloatArray) -> float:
    """Mean correlation between the rows of errors (k, n); NaN if fewer than two rows vary."""
    rows = error[:, np.isfinite(error).all(axis=0)]
    rows = rows[rows.std(axis=1) > 0]
    if len(rows) < 2 or rows.shape[1] < 3:
        return float(np.nan)
    return float(np.corrcoef(rows)[np.triu_indices(len(rows), 1)].mean())


@dataclass(frozen=True, repr=False)
class Explained(Summarised):
    """Scores of a prediction of a map of errors.

    Attributes
    ----------
    r_squared : float
        Relative decrease of the mean square when the prediction is subtracted: of signed errors about zero, of absolute
        errors about their mean. Below zero if the prediction is worse than none.
    rank_correlation : float
        Rank correlation of Spearman.
    r_squared_interval, rank_interval : (float, float)
        Central 90 % over bootstrap samples of locations (in blocks) and indenters.
    """

    r_squared: float
    rank_correlation: float
    r_squared_interval: tuple[float, float]
    rank_interval: tuple[float, float]


def explained_sign(predicted: ArrayLike, observed: ArrayLike) -> Explained:
    """Scores of signed predictions (k, n) of errors (k, n)."""
    return _explained(np.asarray(predicted, float), np.asarray(observed, float), _signed_r_squared)


def explained_size(predicted_rms: ArrayLike, observed: ArrayLike) -> Explained:
    """Scores of predicted root mean squares (k, n) as predictions of the absolute errors (k, n).

    A single error varies widely about its root mean square, so even a perfect prediction has low scores: see
    `attainable`.
    """
    predicted = MEAN_ABSOLUTE * np.asarray(predicted_rms, dtype=float)
    return _explained(predicted, np.abs(np.asarray(observed, dtype=float)), _size_r_squared)


def attainable(predicted_rms: ArrayLike, drawn: ArrayLike) -> dict[str, tuple[float, float, float]]:
    """Scores of `explained_size` for a correct prediction: mean and 90 % interval over simulated maps.

    Parameters
    ----------
    predicted_rms : (k, n) array_like
        Predicted root mean squares.
    drawn : (d, k, n) array_like
        Errors drawn from the prediction.

    Returns
    -------
    dict
        Mean, lower and upper limit for ``r_squared`` and ``rank_correlation``.
    """
    predicted = MEAN_ABSOLUTE * np.asarray(predicted_rms, dtype=float)
    sizes = np.abs(np.asarray(drawn, dtype=float))
    scores = {
        "r_squared": [_size_r_squared(predicted, one) for one in sizes],
        "rank_correlation": [_rank(predicted, one) for one in sizes],
    }
    return {name: (float(np.mean(v)), *_interval(np.asarray(v))) for name, v in scores.items()}


def _signed_r_squared(predicted: FloatArray, observed: FloatArray) -> float:
    return float(1 - np.nansum((observed - predicted) ** 2) / np.nansum(observed**2))


def _size_r_squared(predicted: FloatArray, observed: FloatArray) -> float:
    return float(1 - np.nansum((observed - predicted) ** 2) / np.nansum((observed - np.nanmean(observed)) ** 2))


def _rank(predicted: FloatArray, observed: FloatArray) -> float:
    from scipy.stats import rankdata

    some = np.isfinite(predicted) & np.isfinite(observed)
    first, second = rankdata(predicted[some]), rankdata(observed[some])
    if np.ptp(first) == 0 or np.ptp(second) == 0:
        return float(np.nan)
    return float(np.corrcoef(first, second)[0, 1])


def _explained(
    predicted: FloatArray, observed: FloatArray, r_squared: Callable[[FloatArray, FloatArray], float]
) -> Explained:
    if predicted.shape != observed.shape or predicted.ndim != 2:
        raise InputError(f"expected maps of one shape (k, n), got {predicted.shape} and {observed.shape}")
    rng = np.random.default_rng(0)
    k, n = observed.shape
    block = max(1, min(BLOCK, n // 2))
    scores = np.empty((BOOTSTRAPS, 2))
    for i in range(BOOTSTRAPS):
        starts = rng.integers(n, size=-(-n // block))
        places = (starts[:, None] + np.arange(block)).ravel()[:n] % n
        chosen = np.ix_(rng.integers(k, size=k), places)
        scores[i] = r_squared(predicted[chosen], observed[chosen]), _rank(predicted[chosen], observed[chosen])
    return Explained(
        r_squared(predicted, observed), _rank(predicted, observed), _interval(scores[:, 0]), _interval(scores[:, 1])
    )


def _interval(values: FloatArray) -> tuple[float, float]:
    some = values[np.isfinite(values)]
    if not some.size:
        return float(np.nan), float(np.nan)
    low, high = np.quantile(some, [0.05, 0.95])
    return float(low), float(high)


def covered(posteriors: TouchPosteriors, name: str = "R") -> FloatArray:
    """1 if the central 90 % interval of a touch contains its reference, 0 if not, NaN without a reference; (t,)."""
    low, high = posteriors.interval(name, PROBABILITY)
    reference = _reference(posteriors.reference[name], (low + high) / 2, name)
    inside = ((reference >= low) & (reference <= high)).astype(float)
    return np.where(np.isfinite(reference), inside, np.nan)


def _reference(stated: FloatArray, estimate: FloatArray, name: str) -> FloatArray:
    """Reference values as stated, of a location within half a turn of its estimate."""
    return nearest_turn(stated, estimate) if name == "theta_c" else stated


def expected_coverage(noise_sd: ArrayLike, bias_rms: ArrayLike) -> FloatArray:
    """Coverage of 90 % intervals that include only the noise although calibrations have errors too; broadcasts."""
    from scipy.special import ndtr, ndtri

    reach = ndtri((1 + PROBABILITY) / 2) * np.asarray(noise_sd) / np.hypot(noise_sd, bias_rms)
    return np.asarray(2 * ndtr(reach) - 1)


def variance_split(averaged: TouchPosteriors, single: TouchPosteriors, name: str = "R") -> dict[str, float]:
    """Standard deviations of the errors of posterior means, divided as in Table 4.

    Parameters
    ----------
    averaged : TouchPosteriors
        Posteriors of touches, each from the mean of its samples.
    single : TouchPosteriors
        Posteriors of single samples (``each_sample``), with the numbers of their touches.
    name : {"R", "theta_c", "P"}
        The estimated quantity.

    Returns
    -------
    dict
        ``total``: errors of single samples. ``location``: errors of averages. ``noise``: differences of single samples
        from the average of their touch.
    """
    place = index_among(averaged.rows.touch, single.rows.touch)
    of_single, of_average = single.mean(name), averaged.mean(name)
    reference = averaged.reference[name]
    return {
        "total": float(np.nanstd(of_single - _reference(reference[place], of_single, name))),
        "location": float(np.nanstd(of_average - _reference(reference, of_average, name))),
        "noise": float(np.nanstd(of_single - of_average[place])),
    }
