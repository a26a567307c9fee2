"""Does each element still read what it read when the sensor was calibrated? Score tests on the residuals of touches.

Every touch is fitted with all elements and the force sensor; a *column* is one of them. If a column is at fault, its
residuals go one way over many touches. What a touch's own location, load and radius can absorb of a residual is
projected out, so that a column is held against what the others say of the touch (leave one out, in linear order).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray

#: Changes of gain (share) and offsets (share of the peak) of an element below the first, and force factors nearer to 1
#: than the second, are not looked for: a model that is a little wrong, or a radius at the end of its range, shifts
#: whole columns by tenths of a per cent.
TOLERANCE, FORCE_TOLERANCE = 0.01, 0.005
#: Touches that tell of a column's gain are those under which it reads this share of its peak: on its far tails a model
#: that is a little wrong is wrong by a large share.
SIGNAL_SHARE = 0.2
#: Standard deviations beyond the tolerance that make a fault: 33 two-sided tests at 4 go off in 1 of 500 tables, less
#: often for the tolerance.
THRESHOLD = 4.0
#: A column whose residuals scatter this many times wider than those of the median column is at fault.
SCATTER = 2.5
#: Fewer touches than this with information on a column, or than the second with a signal of it, tell nothing of it.
FEWEST, FEWEST_SIGNALS = 8, 3
_NORMAL_QUARTILE = 0.6744897501960817


@dataclass(frozen=True, eq=False)
class SensorMisfit:
    """Residuals of fitted touches; t touches, k columns (the elements, then the force sensor).

    Attributes
    ----------
    score : (t, k) array
        Inverse covariance times (reading minus prediction) at the mode of each touch.
    information : (t, k) array
        Inverse variance of each reading about what the other columns predict; 0 where not read or not told by them.
    signal : (t, k) array
        Predicted readings; of the force sensor the load.
    signal_sd : (t, k) array
        What the touch, as fitted, leaves open of them.
    shared : callable
        Variance (k,) that the calibration's errors, the same in all touches, give to sums over touches of a
        direction (t, k) times the score.
    discrepancy : (k,) array
        What the calibrated model missed each column by, in calibration, beyond noise; a share of `scale`.
    scale : (k,) array
        Peak reading of each column: that of an edge right above the element; of the force sensor a typical load.
    """

    score: FloatArray
    information: FloatArray
    signal: FloatArray
    signal_sd: FloatArray
    shared: Callable[[FloatArray], FloatArray]
    discrepancy: FloatArray
    scale: FloatArray

    @property
    def n_elements(self) -> int:
        """Number of elements, k less the force sensor."""
        return len(self.scale) - 1


@dataclass(frozen=True, eq=False)
class ColumnTests:
    """What the residuals say of each column; (k,) arrays, NaN where they say nothing.

    Attributes
    ----------
    gain, gain_sd : arrays
        Reading over what it should be, and its standard deviation.
    offset, offset_sd : arrays
        Reading less what it should be as a share of `SensorMisfit.scale`; NaN for the force sensor.
    scatter : array
        Robust standard deviation of the standardised residuals, over that of the median column (1 at the least).
    drop : array
        Sum of squared standardised residuals: how much better everything fits without the column.
    faulty : bool array
        Gain, offset or scatter beyond what chance and tolerance allow.
    differ : bool
        Sound elements differ among each other in gain or offset by more than the tolerance.
    usual : float
        Robust standard deviation of the standardised residuals of the median element, 1 at the least.
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
        """Whether nothing is wrong with the columns that were fitted."""
        return not self.differ and not bool(self.faulty.any())


def tested(misfit: SensorMisfit) -> ColumnTests:
    """Test every column for a changed gain, an offset and a scatter of its own."""
    information, scale = misfit.information, misfit.scale
    told = information > 0
    z = np.where(told, misfit.score / np.sqrt(np.where(told, information, 1.0)), 0.0)
    enough = told.sum(axis=0) >= FEWEST
    elements = np.arange(len(scale)) < misfit.n_elements
    spread = _robust_sd(z, told)
    usual = max(1.0, float(np.nan_to_num(_median(spread[enough & elements]), nan=1.0)))
    share = misfit.signal / scale
    share = np.where(np.abs(share) > SIGNAL_SHARE, share, 0.0)
    signals = ((share != 0) & told).sum(axis=0) >= FEWEST_SIGNALS
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
        # Where the model is a little wrong, sound elements differ among each other by more than their sds.
        unlike, chance = _excess(value[known & elements], sd[known & elements])
        differ |= not chance and unlike > float(np.median(tolerance))
        total = np.sqrt(sd**2 + unlike**2)
        faulty |= known & (np.abs(value) - tolerance > THRESHOLD * total)
    faulty |= enough & (spread > SCATTER * usual)
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
    """How far each column moves along a direction (t, k), and its sd; inf where the touches do not tell."""
    weight = misfit.information * direction**2
    total = weight.sum(axis=0)
    told = total > 0
    safe = np.where(told, total, 1.0)
    value = (direction * misfit.score).sum(axis=0) / safe
    sd = np.sqrt(usual**2 / safe + misfit.shared(direction) / safe**2)
    return np.where(told, value, 0.0), np.where(told, sd, np.inf)


def _robust_sd(z: FloatArray, told: NDArray[np.bool_]) -> FloatArray:
    """Median of |z| over that of a standard normal, by column; NaN where nothing is told."""
    return np.array([_median(np.abs(column[there])) for column, there in zip(z.T, told.T, strict=True)]) / (
        _NORMAL_QUARTILE
    )


def _excess(value: FloatArray, sd: FloatArray) -> tuple[float, bool]:
    """Standard deviation among columns beyond their own sds, by medians, and whether chance could make it.

    Fewer than five columns say nothing.
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
