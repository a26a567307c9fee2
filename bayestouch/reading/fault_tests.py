"""Score tests on the residuals of touches: does each element still read as it did in the calibration?

Every touch is fitted with all elements and the force sensor; each of these is a *column*. If a column is faulty, its
residuals have the same sign over many touches. The part of a residual that location, load and radius of the touch can
absorb is projected out. The test thus compares a column with the prediction by the other columns (leave one out, to
first order).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray

#: Smallest changes that are looked for: change of gain (share) and offset (share of the peak) of an element, and
#: deviation of the force factor from 1. Small model errors, or a radius at the limit of its range, shift whole columns
#: by tenths of a per cent.
TOLERANCE, FORCE_TOLERANCE = 0.01, 0.005
#: A touch is used for the gain of a column if the column reads at least this share of its peak. Below it, a small model
#: error is a large share of the reading.
SIGNAL_SHARE = 0.2
#: Number of standard deviations beyond the tolerance that make a fault. With 33 two-sided tests at 4, a false alarm
#: occurs in 1 of 500 tables; the tolerance makes it rarer.
THRESHOLD = 4.0
#: A column is faulty if its residuals scatter this many times wider than those of the median column.
SCATTER = 2.5
#: A column is not tested with fewer touches with information on it than the first number, or with fewer touches with a
#: signal of it than the second.
FEWEST, FEWEST_SIGNALS = 8, 3
_NORMAL_QUARTILE = 0.6744897501960817


@dataclass(frozen=True, eq=False)
class SensorMisfit:
    """Residuals of fitted touches and what is needed to test them; t touches, k columns (elements, then force sensor).

    Attributes
    ----------
    score : (t, k) array
        Inverse covariance times (reading minus prediction) at the mode of each touch.
    information : (t, k) array
        Inverse variance of the difference between each reading and its prediction by the other columns; 0 where there
        is no reading or no such prediction.
    signal : (t, k) array
        Predicted readings; for the force sensor the load.
    signal_sd : (t, k) array
        Standard deviation of `signal` that is left by the uncertainty of the fitted touch.
    shared : callable
        Function of a direction (t, k): variance (k,) of the sum over touches of direction times score that is caused by
        errors of the calibration, which all touches share.
    discrepancy : (k,) array
        Model error of each column beyond noise in the calibration, as a share of `scale`.
    scale : (k,) array
        Peak reading of each column, under an edge right above the element; for the force sensor a typical load.
    rest_variance : (m,) array or None
        Variance of the error that all readings of an element share by the rest reading, a part of `shared`; None if
        there is none.
    """

    score: FloatArray
    information: FloatArray
    signal: FloatArray
    signal_sd: FloatArray
    shared: Callable[[FloatArray], FloatArray]
    discrepancy: FloatArray
    scale: FloatArray
    rest_variance: FloatArray | None = None

    @cached_property
    def tests(self) -> ColumnTests:
        """Tests of every column for a changed gain, an offset and a scatter of its own."""
        return tested(self)

    @property
    def n_elements(self) -> int:
        """Number of elements: k without the force sensor."""
        return len(self.scale) - 1

    def rest_sd_of(self, column: int) -> float:
        """Standard deviation of the error of the rest reading of a column; 0 for the force sensor, or without one."""
        if self.rest_variance is None or column >= self.n_elements:
            return 0.0
        return float(np.sqrt(self.rest_variance[column]))

    @property
    def expected(self) -> tuple[FloatArray, FloatArray]:
        """Reading minus what the other columns say, and its variance, (t, m) both; 0 and infinite if they say nothing.

        Of the elements, without the force sensor.
        """
        score, information = self.score[:, :-1], self.information[:, :-1]
        told = information > 0
        variance = np.where(told, 1 / np.where(told, information, 1.0), np.inf)
        return np.where(told, score * np.where(told, variance, 0.0), 0.0), variance


def with_rest_errors(
    shared: Callable[[FloatArray], FloatArray], left: FloatArray, rest_variance: FloatArray | None
) -> Callable[[FloatArray], FloatArray]:
    """`SensorMisfit.shared` with the error of the rest reading, by which all readings of an element are off.

    `left` (t, k, m) is the derivative of each column's score over each reading; `rest_variance` (m,) is the variance of
    the error, None if there is none.
    """
    if rest_variance is None:
        return shared

    def variance(direction: FloatArray) -> FloatArray:
        of_elements = np.einsum("ta,tai->ai", direction, left)
        return np.asarray(shared(direction) + of_elements**2 @ rest_variance)

    return variance


@dataclass(frozen=True, eq=False)
class ColumnTests:
    """Results of the tests of each column; (k,) arrays, NaN where there is too little information.

    Attributes
    ----------
    gain, gain_sd : arrays
        Reading divided by the expected reading, and its standard deviation.
    offset, offset_sd : arrays
        Reading minus the expected reading as a share of `SensorMisfit.scale`; NaN for the force sensor.
    scatter : array
        Robust standard deviation of the standardised residuals, divided by that of the median column (at least 1).
    drop : array
        Sum of squared standardised residuals: the decrease of the total misfit if the column is left out.
    faulty : bool array
        True if gain, offset or scatter deviates by more than chance and tolerance allow.
    differ : bool
        True if elements without a fault differ from each other in gain or offset by more than the tolerance.
    usual : float
        Robust standard deviation of the standardised residuals of the median element, at least 1.
    """

    gain: FloatArray
    gain_sd: FloatArray
    offset: FloatArray
    offset_sd: FloatArray
    scatter: FloatArray
    drop: FloatArray
    faulty: NDArray[np.bool_]
    differ: bool
    usual: float

    @property
    def agree(self) -> bool:
        """True if no fault was found in the columns that were fitted."""
        return not self.differ and not bool(self.faulty.any())


def tested(misfit: SensorMisfit) -> ColumnTests:
    """Test every column for a changed gain, an offset and a scatter of its own."""
    information, scale = misfit.information, misfit.scale
    informative = information > 0
    z = np.where(informative, misfit.score / np.sqrt(np.where(informative, information, 1.0)), 0.0)
    enough = informative.sum(axis=0) >= FEWEST
    elements = np.arange(len(scale)) < misfit.n_elements
    spread = _robust_sd(z, informative)
    usual = max(1.0, float(np.nan_to_num(_median(spread[enough & elements]), nan=1.0)))
    share = misfit.signal / scale
    share = np.where(np.abs(share) > SIGNAL_SHARE, share, 0.0)
    signals = ((share != 0) & informative).sum(axis=0) >= FEWEST_SIGNALS
    gain, gain_sd = _coefficient(misfit, share, usual)
    gain_sd = np.where(signals, gain_sd, np.inf)
    offset, offset_sd = _coefficient(misfit, np.ones_like(misfit.signal), usual)
    gain, gain_sd = gain / scale, gain_sd / scale
    offset, offset_sd = offset / scale, np.where(elements, offset_sd / scale, np.nan)
    faulty = np.zeros(len(scale), dtype=bool)
    tolerance = np.where(elements, TOLERANCE, FORCE_TOLERANCE) + 2 * misfit.discrepancy
    differ = False
    for value, sd in ((gain, gain_sd), (offset, offset_sd)):
        known = enough & np.isfinite(sd)
        # If the model has a small error, sound elements differ from each other by more than their sds.
        spread_among, chance = _excess(value[known & elements], sd[known & elements])
        differ |= not chance and spread_among > float(np.median(tolerance))
        total = np.sqrt(sd**2 + spread_among**2)
        faulty |= known & (np.abs(value) - tolerance > THRESHOLD * total)
    faulty |= enough & (spread > np.maximum(SCATTER * usual, THRESHOLD * _rest_spread(misfit)))
    return ColumnTests(
        gain=np.where(enough & signals, 1 + gain, np.nan),
        gain_sd=np.where(enough & signals, gain_sd, np.nan),
        offset=np.where(enough & elements, offset, np.nan),
        offset_sd=np.where(enough, offset_sd, np.nan),
        scatter=np.where(enough, spread / usual, np.nan),
        drop=(z * z).sum(axis=0),
        faulty=faulty,
        differ=differ,
        usual=usual,
    )


def _coefficient(misfit: SensorMisfit, direction: FloatArray, usual: float) -> tuple[FloatArray, FloatArray]:
    """Deviation of each column along a direction (t, k), and its sd; inf where the touches give no information."""
    weight = misfit.information * direction**2
    total = weight.sum(axis=0)
    informative = total > 0
    safe = np.where(informative, total, 1.0)
    value = (direction * misfit.score).sum(axis=0) / safe
    sd = np.sqrt(usual**2 / safe + misfit.shared(direction) / safe**2)
    return np.where(informative, value, 0.0), np.where(informative, sd, np.inf)


def _rest_spread(misfit: SensorMisfit) -> FloatArray:
    """`_robust_sd` (k,) of standardised residuals that are all off by one sd of the error of the rest reading."""
    if misfit.rest_variance is None:
        return np.zeros(len(misfit.scale))
    informative = misfit.information > 0
    mean = misfit.information.sum(axis=0) / np.maximum(informative.sum(axis=0), 1)
    return np.asarray(np.sqrt(mean * np.append(misfit.rest_variance, 0.0)) / _NORMAL_QUARTILE)


def _robust_sd(z: FloatArray, informative: NDArray[np.bool_]) -> FloatArray:
    """Median of |z| divided by that of a standard normal, by column; NaN for a column without information."""
    return np.array([_median(np.abs(column[there])) for column, there in zip(z.T, informative.T, strict=True)]) / (
        _NORMAL_QUARTILE
    )


def _excess(value: FloatArray, sd: FloatArray) -> tuple[float, bool]:
    """Standard deviation among columns beyond their own sds, from medians, and True if chance can explain it.

    With fewer than five columns the result is 0 and True.
    """
    precise = sd < 3 * _median(sd)
    n = int(precise.sum())
    if n < 5:
        return 0.0, True
    about = np.abs(value[precise] - np.median(value[precise]))
    variance = (_median(about) / _NORMAL_QUARTILE) ** 2 - _median(sd[precise] ** 2)
    ratio = _median(about / sd[precise]) / _NORMAL_QUARTILE
    # an sd from the median of n absolute values is itself uncertain by 1.17/sqrt(n) of its size
    return float(np.sqrt(max(0.0, variance))), ratio < 1 + THRESHOLD * 1.17 / np.sqrt(n)


def _median(values: FloatArray) -> float:
    finite = values[np.isfinite(values)]
    return float(np.median(finite)) if len(finite) else float("nan")
