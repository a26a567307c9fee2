"""Mean readings of the touches of a pad, and the choice of the samples that are averaged."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.data.averages import TouchMeans
from bayestouch.data.grouping import grouped_mean
from bayestouch.data.touches import Touches
from bayestouch.errors import InputError
from bayestouch.output.text import plus_minus

SAMPLES = ("auto", "mean", "first", "last")

# Creep is significant at four standard errors: one data set in sixteen thousand without creep exceeds this.
_CREEP_SIGNIFICANCE = 4.0
# Inverse variance of an intercept over that of a reading, from which it is used: two loads at one location that differ
# by a third.
LEAST_SPREAD = 0.04
# Share of the readings of an element that are beyond its faintest one: wrong readings are fewer.
FAINTEST = 0.05


def prior_of_loads(load: FloatArray) -> tuple[float, float]:
    """Mean and standard deviation (N) of the loads (n,) of a calibration: the prior of a load that is not measured.

    Loads that are all equal do not show how much others differ: the standard deviation is then the load itself.
    """
    mean = float(load.mean())
    return mean, float(load.std()) if np.ptp(load) > 0 else mean


def counted_samples(touches: Touches, samples: str) -> Touches:
    """The samples of each touch that count: all for ``"mean"``, or only the ``"first"`` or ``"last"`` in contact."""
    return touches if samples == "mean" else touches.select(np.sort(_one_row_each(touches, samples)))


def pad_readings(touches: Touches, dimensions: int, samples: str) -> TouchMeans:
    """Mean of each touch over the samples that are used; coordinates of the location are NaN where unknown.

    Parameters
    ----------
    touches : Touches
        Table with the rest reading subtracted.
    dimensions : int
        Number of coordinates of the location, 1 or 2.
    samples : {"mean", "first", "last"}
        As in `counted_samples`.

    Raises
    ------
    InputError
        No touch is in contact.
    """
    means = counted_samples(touches, samples).averaged()
    if means.n_touches == 0:
        raise InputError("no touch is in contact")
    unknown = np.full(means.n_touches, np.nan)
    return replace(
        means,
        x_mm=unknown if means.x_mm is None else means.x_mm,
        y_mm=None if dimensions == 1 else unknown if means.y_mm is None else means.y_mm,
    )


def choose_samples(touches: Touches, zero: FloatArray | float = 0.0) -> tuple[str, str]:
    """Samples of a touch to use, and the reason in one sentence.

    Creep is a change between the first and the last sample of a touch in proportion to the signal. Its share is the
    slope of the regression of the change on the mean of the two samples, through zero; the standard error is from the
    scatter between touches, since the elements of a touch creep together. With creep, a mean of samples depends on
    their times and on earlier touches, so the first sample in contact is used. Without creep all samples are used:
    their mean is more precise.

    Parameters
    ----------
    touches : Touches
        The touches.
    zero : (m,) array or float
        Readings without touch.

    Returns
    -------
    str, str
        ``"first"`` or ``"mean"``, and the reason; it is empty if touches have one sample.
    """
    first = touches.select(_one_row_each(touches, "first"))
    last = touches.select(_one_row_each(touches, "last"))
    several = first.sample != last.sample
    if several.sum() < 3:
        return "mean", ""
    change = np.nan_to_num(last.readings - first.readings)[several]
    signal = np.nan_to_num(0.5 * (last.readings + first.readings) - zero)[several]
    # The change of readings far below the largest of an element is due to offsets rather than creep.
    signal = np.where(np.abs(signal) > 0.1 * np.abs(signal).max(axis=0), signal, 0.0)
    # Elements without a signal get finite weights and do not contribute.
    weight = 1 / np.maximum(np.abs(signal).max(axis=0), 1e-150) ** 2
    across, along = (weight * change * signal).sum(axis=1), (weight * signal * signal).sum(axis=1)
    if along.sum() == 0:
        return "mean", ""
    share = float(across.sum() / along.sum())
    error = float(np.sqrt(((across - share * along) ** 2).sum()) / along.sum())
    # The error of readings without noise is the rounding of these sums.
    known = plus_minus(100 * share, 100 * error if error > 1e-12 else 0.0)
    measured = f"{'+' if share > 0 else ''}{known} % of the signal"
    if abs(share) > _CREEP_SIGNIFICANCE * error:
        return "first", (
            f"readings change by {measured} between the first and the last sample of a touch (creep): "
            "the first sample in contact is used"
        )
    return "mean", f"no creep between the samples of a touch ({measured}): their mean is used"


def _one_row_each(touches: Touches, which: str) -> IntArray:
    """Index of the row of the first or last sample in contact of each touch, by the number of the touch."""
    rows = np.flatnonzero(touches.in_contact)
    order = np.lexsort((touches.sample[rows], touches.touch[rows]))
    if which == "last":
        order = order[::-1]
    _, at = np.unique(touches.touch[rows][order], return_index=True)
    return rows[order][at]


def location_spacing(location: FloatArray) -> float:
    """Distance between neighbouring locations (t, D) if they were evenly spread over their range, mm."""
    distinct = np.unique(location, axis=0)
    extent = np.ptp(distinct, axis=0)
    if location.shape[1] == 1:
        return float(extent[0] / max(len(distinct) - 1, 1))
    return float(np.sqrt(extent.prod() / max(len(distinct), 1)))


def faintest_readings(touches: Touches, rest: FloatArray | None) -> FloatArray:
    """Readings without touch, (m,), near enough to see how large a signal is; 0 if `rest` was subtracted.

    An element reads least of all under touches that are far from it: its faintest reading is the one beyond which are a
    twentieth of its readings, on the side of their median where they differ less.
    """
    readings = touches.averaged().readings
    faintest = np.zeros(readings.shape[1])
    for element, column in enumerate(readings.T):
        read = column[np.isfinite(column)]
        if rest is None and len(read):
            low, middle, high = np.quantile(read, (FAINTEST, 0.5, 1 - FAINTEST))
            faintest[element] = low if middle - low <= high - middle else high
    return faintest


def readings_without_load(known: TouchMeans) -> FloatArray:
    """Reading of each element without touch, (m,), from readings from which no rest reading was subtracted.

    It is the common intercept of straight lines over the load, with a slope for each location. Where loads do not vary
    at any location, it is the median reading: most locations are far from an element then. NaN without readings.
    """
    _, group = np.unique(known.location, axis=0, return_inverse=True)
    out = np.full(known.n_elements, np.nan)
    for element, column in enumerate(known.readings.T):
        here = np.isfinite(column) & np.isfinite(known.load)
        place, load, reading = np.asarray(group).ravel()[here], known.load[here], column[here]
        size = np.maximum(np.bincount(place, weights=load**2), 1e-300)
        # What the load leaves of a constant and of the readings, with a slope for each location.
        by_load = load * (np.bincount(place, weights=load) / size)[place]
        left = 1 - by_load
        if len(left) and left.sum() > LEAST_SPREAD:
            out[element] = float(left @ reading) / float(left.sum())
        elif np.isfinite(column).any():
            out[element] = float(np.nanmedian(column))
    return out


def highest_reading_location(known: TouchMeans) -> FloatArray:
    """Location of the largest signal of each element in mm, (m, D): centroid of its highest readings per load.

    Locations with at least 80 % of the largest signal are used; NaN for an element without readings.
    """
    place, group = np.unique(known.location, axis=0, return_inverse=True)
    load = np.where(np.isnan(known.load), 1.0, known.load)
    out = np.full((known.n_elements, place.shape[1]), np.nan)
    for element, column in enumerate(known.readings.T):
        value = grouped_mean(column / load, np.asarray(group).ravel(), len(place))
        if not np.isfinite(value).any():
            continue
        value = np.nan_to_num(value - np.nanmedian(value))
        value = value if value.max() >= -value.min() else -value
        high = value >= 0.8 * value.max()
        out[element] = np.average(place[high], axis=0, weights=np.maximum(value[high], 1e-300))
    return out
