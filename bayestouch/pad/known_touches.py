"""Touches of a pad as arrays: which samples of a touch count, and what was read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.data.grouping import grouped_mean
from bayestouch.data.touches import Touches
from bayestouch.errors import InputError

SAMPLES = ("auto", "mean", "first", "last")

# Creep is told from chance at four standard errors: one data set in sixteen thousand without it would be misread.
_CREEP_SIGNIFICANCE = 4.0


@dataclass(frozen=True, eq=False)
class PadReadings:
    """Touches averaged over the samples that count; t touches, m elements, D coordinates.

    Attributes
    ----------
    touch : (t,) int array
        Identifier.
    location : (t, D) array
        Reference location, mm; NaN unknown.
    load : (t,) array
        Measured load, N; NaN where not measured.
    readings : (t, m) array
        Mean readings, rest reading subtracted; NaN missing.
    counts : (t, m) int array
        Raw readings behind each, 0 where missing.
    radius_mm : (t,) array
        Reference indenter radius.
    pure_error_variance : (m,) array
        Variance of one raw reading from repeats within touches; NaN without.
    """

    touch: IntArray
    location: FloatArray
    load: FloatArray
    readings: FloatArray
    counts: IntArray
    radius_mm: FloatArray
    pure_error_variance: FloatArray

    @property
    def n_touches(self) -> int:
        """Number of touches."""
        return len(self.touch)

    def select(self, index: NDArray[np.bool_] | IntArray) -> PadReadings:
        """Some of the touches."""
        return PadReadings(
            self.touch[index],
            self.location[index],
            self.load[index],
            self.readings[index],
            self.counts[index],
            self.radius_mm[index],
            self.pure_error_variance,
        )

    @classmethod
    def joined(cls, parts: Sequence[PadReadings]) -> PadReadings:
        """All touches of several; the pure error is that of the first."""
        names = ("touch", "location", "load", "readings", "counts", "radius_mm")
        return replace(parts[0], **{name: np.concatenate([getattr(part, name) for part in parts]) for name in names})

    def without_load(self) -> PadReadings:
        """The same touches as if no load had been measured."""
        return replace(self, load=np.full(self.n_touches, np.nan))


def pad_readings(touches: Touches, dimensions: int, samples: str) -> PadReadings:
    """Average each touch over the samples that count.

    Parameters
    ----------
    touches : Touches
        Rest reading subtracted.
    dimensions : int
        1 or 2.
    samples : {"mean", "first", "last"}
        All samples of a touch in contact, or only its first or last one.

    Raises
    ------
    InputError
        No touch is in contact.
    """
    chosen = touches if samples == "mean" else touches.select(_one_row_each(touches, samples))
    means = chosen.averaged()
    if means.n_touches == 0:
        raise InputError("no touch is in contact")
    unknown = np.full(means.n_touches, np.nan)
    columns = (means.x_mm, means.y_mm)[:dimensions]
    return PadReadings(
        touch=means.touch,
        location=np.stack([unknown if column is None else column for column in columns], axis=1),
        load=means.load,
        readings=means.readings,
        counts=np.where(np.isnan(means.readings), 0, means.counts),
        radius_mm=means.indenter_radius_mm,
        pure_error_variance=means.pure_error_variance,
    )


def choose_samples(touches: Touches) -> tuple[str, str]:
    """Which samples of a touch to use, and why in one sentence.

    A change in proportion to the signal between the first and the last sample of a touch is creep: the share
    is the slope of the change on the mean of the two, through zero, with a standard error from the scatter of
    the touches (each touch one unit, as its elements creep together). Creep makes a mean of samples depend on
    their times, and accumulates what happened before, so that the first sample in contact is used; where there
    is none, all samples are, for their mean is more precise.

    Returns
    -------
    str, str
        ``"first"`` or ``"mean"``, and the reason; the reason is empty where touches have one sample.
    """
    first = touches.select(_one_row_each(touches, "first"))
    last = touches.select(_one_row_each(touches, "last"))
    several = first.sample != last.sample
    if several.sum() < 3:
        return "mean", ""
    change = np.nan_to_num(last.readings - first.readings)[several]
    signal = np.nan_to_num(0.5 * (last.readings + first.readings))[several]
    # Readings far below the element's largest tell of offsets rather than of creep.
    signal = np.where(np.abs(signal) > 0.1 * np.abs(signal).max(axis=0), signal, 0.0)
    weight = 1 / np.maximum(np.abs(signal).max(axis=0), 1e-300) ** 2
    across, along = (weight * change * signal).sum(axis=1), (weight * signal * signal).sum(axis=1)
    if along.sum() == 0:
        return "mean", ""
    share = float(across.sum() / along.sum())
    error = float(np.sqrt(((across - share * along) ** 2).sum()) / along.sum())
    measured = f"{share:+.2%} ± {error:.2%} of the signal"
    if abs(share) > _CREEP_SIGNIFICANCE * error:
        return "first", (
            f"readings change by {measured} between the first and the last sample of a touch (creep): "
            "the first sample in contact is used"
        )
    return "mean", f"no creep between the samples of a touch ({measured}): their mean is used"


def _one_row_each(touches: Touches, which: str) -> IntArray:
    """Row of the first or last sample in contact of each touch."""
    rows = np.flatnonzero(touches.in_contact)
    order = np.lexsort((touches.sample[rows], touches.touch[rows]))
    if which == "last":
        order = order[::-1]
    _, at = np.unique(touches.touch[rows][order], return_index=True)
    return np.sort(rows[order][at])


def location_spacing(location: FloatArray) -> float:
    """Typical distance between neighbouring locations (t, D): of the spread-evenly kind, mm."""
    distinct = np.unique(location, axis=0)
    extent = np.ptp(distinct, axis=0)
    if location.shape[1] == 1:
        return float(extent[0] / max(len(distinct) - 1, 1))
    return float(np.sqrt(extent.prod() / max(len(distinct), 1)))


def highest_reading_location(readings: PadReadings) -> FloatArray:
    """Location of each element's largest signal, shape (m, D): centroid of its highest readings per load.

    The places above 80 % of the largest signal weigh in; NaN for an element that has no reading.
    """
    place, group = np.unique(readings.location, axis=0, return_inverse=True)
    load = np.where(np.isnan(readings.load), 1.0, readings.load)
    out = np.full((readings.readings.shape[1], place.shape[1]), np.nan)
    for element, column in enumerate(readings.readings.T):
        value = grouped_mean(column / load, np.asarray(group).ravel(), len(place))
        if not np.isfinite(value).any():
            continue
        value = np.nan_to_num(value - np.nanmedian(value))
        value = value if value.max() >= -value.min() else -value
        high = value >= 0.8 * value.max()
        out[element] = np.average(place[high], axis=0, weights=np.maximum(value[high], 1e-300))
    return out
