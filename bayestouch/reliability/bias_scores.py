"""Errors by indenter and location as touches show them, and how much of them a prediction explains."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bayestouch.array_types import FloatArray
from bayestouch.errors import InputError
from bayestouch.results.objects import TouchPosteriors

#: Mean of the absolute value of a normal number over its standard deviation.
MEAN_ABSOLUTE = float(np.sqrt(2 / np.pi))


@dataclass(frozen=True, eq=False)
class BiasMap:
    """Errors of estimates over k indenters and n locations.

    Attributes
    ----------
    indenters_mm : (k,) array
        r_c.
    angle_deg : (n,) array
        Reference locations.
    error : (k, n) array
        Estimate less reference, mean of the touches there; NaN where there is none. R in mm, θ_c in degree, P in N/m.
    touches : (k, n) int array
        How many.
    """

    indenters_mm: FloatArray
    angle_deg: FloatArray
    error: FloatArray
    touches: NDArray[np.int64]

    @property
    def location_rms(self) -> FloatArray:
        """Root mean square over the indenters, (n,)."""
        return np.asarray(np.sqrt(np.nanmean(self.error**2, axis=0)))

    @property
    def shared(self) -> float:
        """Mean correlation over location between indenters: near 1 where bias belongs to the location (Figure 13)."""
        return shared_by_indenters(self.error)


def observed_bias(posteriors: TouchPosteriors, name: str = "R", *, without: ArrayLike = ()) -> BiasMap:
    """Errors of posterior means on the grid of indenters and locations that were touched.

    Parameters
    ----------
    posteriors : TouchPosteriors
        Of touches on a finger with reference radius and location.
    name : {"R", "theta_c", "P"}
        Which estimate.
    without : (j,) array_like
        Indenters to leave out, r_c in mm: those that calibrated.

    Raises
    ------
    InputError
        If no touch has a reference.
    """
    radius, angle = posteriors.rows.radius_mm, posteriors.reference["theta_c"]
    error = posteriors.mean(name) - posteriors.reference[name]
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
    """Mean correlation between the rows of (k, n) errors; NaN for one indenter or one that never errs."""
    rows = error[:, np.isfinite(error).all(axis=0)]
    rows = rows[rows.std(axis=1) > 0]
    if len(rows) < 2 or rows.shape[1] < 3:
        return float(np.nan)
    return float(np.corrcoef(rows)[np.triu_indices(len(rows), 1)].mean())


@dataclass(frozen=True)
class Explained:
    """How much of a map a prediction explains.

    Attributes
    ----------
    r_squared : float
        Share of the mean square that goes away when the prediction is subtracted: of the signed errors about zero,
        of absolute ones about their mean. Below zero where the prediction is worse than none.
    rank_correlation : float
        Spearman's.
    r_squared_interval, rank_interval : (float, float)
        90 % of bootstrap samples of locations (in blocks) and indenters.
    """

    r_squared: float
    rank_correlation: float
    r_squared_interval: tuple[float, float]
    rank_interval: tuple[float, float]


def explained_sign(predicted: ArrayLike, observed: ArrayLike, *, block: int = 8, seed: int = 0) -> Explained:
    """How well signed predictions (k, n) explain errors (k, n); blocks of `block` neighbouring locations."""
    return _explained(np.asarray(predicted, float), np.asarray(observed, float), _signed_r_squared, block, seed)


def explained_size(predicted_rms: ArrayLike, observed: ArrayLike, *, block: int = 8, seed: int = 0) -> Explained:
    """How well predicted root mean squares (k, n) explain the sizes of errors (k, n).

    One error says little of its root mean square, so that even a perfect prediction explains little: see `attainable`.
    """
    predicted = MEAN_ABSOLUTE * np.asarray(predicted_rms, dtype=float)
    return _explained(predicted, np.abs(np.asarray(observed, dtype=float)), _size_r_squared, block, seed)


def attainable(predicted_rms: ArrayLike, drawn: ArrayLike) -> dict[str, tuple[float, float, float]]:
    """Scores of `explained_size` where the prediction is the truth: mean and 90 % interval over drawn maps.

    Parameters
    ----------
    predicted_rms : (k, n) array_like
        Prediction.
    drawn : (d, k, n) array_like
        Errors drawn from it.

    Returns
    -------
    dict
        ``r_squared`` and ``rank_correlation``.
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
    predicted: FloatArray,
    observed: FloatArray,
    r_squared: Callable[[FloatArray, FloatArray], float],
    block: int,
    seed: int,
    samples: int = 300,
) -> Explained:
    if predicted.shape != observed.shape or predicted.ndim != 2:
        raise InputError(f"expected maps of one shape (k, n), got {predicted.shape} and {observed.shape}")
    rng = np.random.default_rng(seed)
    k, n = observed.shape
    block = max(1, min(block, n // 2))
    scores = np.empty((samples, 2))
    for i in range(samples):
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


def covered(posteriors: TouchPosteriors, name: str = "R", probability: float = 0.9) -> FloatArray:
    """Whether each touch's central interval contains its reference, (t,): 1, 0, or NaN without a reference."""
    low, high = posteriors.interval(name, probability)
    reference = posteriors.reference[name]
    inside = ((reference >= low) & (reference <= high)).astype(float)
    return np.where(np.isfinite(reference), inside, np.nan)


def expected_coverage(noise_sd: ArrayLike, bias_rms: ArrayLike, probability: float = 0.9) -> FloatArray:
    """Coverage of intervals that know of the noise alone, where calibrations err too; broadcasts."""
    from scipy.special import ndtr, ndtri

    reach = ndtri((1 + probability) / 2) * np.asarray(noise_sd) / np.hypot(noise_sd, bias_rms)
    return np.asarray(2 * ndtr(reach) - 1)


def variance_split(averaged: TouchPosteriors, single: TouchPosteriors, name: str = "R") -> dict[str, float]:
    """Standard deviations of errors as Table 4 splits them, of posterior means.

    Parameters
    ----------
    averaged : TouchPosteriors
        One for each touch, of the mean of its samples.
    single : TouchPosteriors
        One for each sample (``each_sample``), under the touch's number.
    name : {"R", "theta_c", "P"}
        Which estimate.

    Returns
    -------
    dict
        ``total`` of single samples; ``location`` of averages; ``noise`` of single samples about their touch's average.
    """
    order = np.argsort(averaged.rows.touch)
    place = order[np.searchsorted(averaged.rows.touch[order], single.rows.touch)]
    of_single, of_average = single.mean(name), averaged.mean(name)
    reference = averaged.reference[name]
    return {
        "total": float(np.nanstd(of_single - reference[place])),
        "location": float(np.nanstd(of_average - reference)),
        "noise": float(np.nanstd(of_single - of_average[place])),
    }
