"""Mean readings of each touch over its samples, and the pure error (scatter between the samples of a touch)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import BoolArray, FloatArray, IntArray
from bayestouch.data.arrays import turned
from bayestouch.data.grouping import all_equal, first_of, grouped_mean, groups
from bayestouch.data.sample_rows import SampleRows, reads_of_rows
from bayestouch.errors import InputError
from bayestouch.output.summary import Summarised


@dataclass(frozen=True, eq=False, repr=False)
class TouchMeans(Summarised):
    """Means over the samples in contact, one row per touch; t touches, m elements.

    Touches are in the order of their first row in contact. A touch without such a row is left out.

    Attributes
    ----------
    touch : int array, shape (t,)
    readings : array, shape (t, m)
        Mean readings; NaN where a touch has no reading of an element.
    counts : array, shape (t, m)
        Number of raw reads with the noise of each mean. A row counts once, or `reads` times where it is an average.
        Where a rest reading of k reads was subtracted, n reads count as n k/(n + k), see `Touches.rest_reads`.
    pure_error_variance : array, shape (m,)
        Variance of ONE raw read, pooled over touches; divide by `counts` for the variance of a mean. NaN where
        no touch has an element's reading twice, or where all that has are equal: a readout that does not resolve the
        noise, or copied rows, say nothing of it.
    pure_error_dof : array, shape (m,)
        Degrees of freedom of `pure_error_variance`; 0 where it is NaN.
    load, indenter_radius_mm, depth_mm, time_s : array, shape (t,)
        Means over the rows that state them (load in N/m or N); NaN where no row does.
    angle_deg, x_mm, y_mm : array, shape (t,), or None
        Mean location (angles across ±180° are averaged around the circle).
    load_reads : array, shape (t,), or None
        Number of raw reads behind each mean load; 0 where no load was read. Equal loads in all rows of a touch are one
        load that was written into all of them: they have the reads of one row.
    load_error_variance, load_error_dof : float
        Variance of ONE read of the load within touches, and its degrees of freedom; NaN and 0 where no load of a touch
        was read twice.
    repeats_equal : bool
        Whether there are readings that were made again, and none of them ever differs.
    raw_reads : array, shape (t,), or None
        Number of raw reads of the element that was read most, without regard to the noise of a rest reading; None if
        it is that of `counts`.
    sample : int array, shape (t,), or None
        Number of the sample within its touch if each row is one sample; None if each row is a touch.
    """

    touch: IntArray
    readings: FloatArray
    counts: FloatArray
    pure_error_variance: FloatArray
    pure_error_dof: FloatArray
    load: FloatArray
    indenter_radius_mm: FloatArray
    depth_mm: FloatArray
    time_s: FloatArray
    angle_deg: FloatArray | None
    x_mm: FloatArray | None
    y_mm: FloatArray | None
    load_reads: FloatArray | None = None
    load_error_variance: float = np.nan
    load_error_dof: float = 0.0
    repeats_equal: bool = False
    raw_reads: FloatArray | None = None
    sample: IntArray | None = None

    @property
    def n_touches(self) -> int:
        """Number of touches."""
        return len(self.touch)

    @property
    def n_elements(self) -> int:
        """Number of elements."""
        return int(self.readings.shape[1])

    @property
    def reads_of_load(self) -> FloatArray:
        """Number of raw reads of each mean load, (t,), at least 1; that of the readings where it is not known."""
        known = self.samples if self.load_reads is None else self.load_reads
        return np.asarray(np.maximum(np.where(known > 0, known, self.samples), 1.0))

    @property
    def samples(self) -> FloatArray:
        """Number of raw reads of each touch, (t,): its samples, each with its `reads`."""
        return np.asarray(self.counts.max(axis=1) if self.raw_reads is None else self.raw_reads, dtype=np.float64)

    @cached_property
    def location(self) -> FloatArray:
        """Location of each touch on a pad in mm, shape (t, D): x, and y in two dimensions; NaN unknown."""
        return np.stack([axis for axis in (self.x_mm, self.y_mm) if axis is not None], axis=1)

    def select(self, index: IntArray | BoolArray) -> TouchMeans:
        """Return the selected touches; the pure error remains that of all touches."""
        columns: dict[str, Any] = {name: values[index] for name, values in self._columns().items()}
        return replace(self, **columns)

    @classmethod
    def joined(cls, parts: Sequence[TouchMeans]) -> TouchMeans:
        """Return the touches of several tables as one table; the pure error is that of the first table."""
        if len(parts) == 1:
            return parts[0]
        columns: dict[str, Any] = {
            name: np.concatenate([getattr(part, name) for part in parts]) for name in parts[0]._columns()
        }
        return replace(parts[0], **columns)

    def without_load(self) -> TouchMeans:
        """Return the same touches with every load unknown (NaN)."""
        return replace(self, load=np.full(self.n_touches, np.nan))

    def _columns(self) -> dict[str, NDArray[Any]]:
        """Attributes that have one row per touch, by name."""
        values = {each.name: getattr(self, each.name) for each in fields(self)}
        return {
            name: value
            for name, value in values.items()
            if isinstance(value, np.ndarray) and not name.startswith("pure_error")
        }


def average(touches: SampleRows) -> TouchMeans:
    """Return the means of each touch over its samples in contact.

    A row that is itself an average of r raw reads (`reads`) has weight r. With ȳ the mean of the touch, the
    sum of squares within it is Σ r (y − ȳ)² between its rows plus Σ (r − 1) s² inside them, where s is
    the row's `eNN_sd`, the standard deviation of the raw reads (with r − 1 in its denominator) and not of
    their mean. Degrees of freedom are one less than the number of rows, plus Σ (r − 1) over the rows that
    give s. A row with s but without r counts as one read, and its s as one degree of freedom. An element whose
    scatter is exactly zero counts as read once.

    Raises
    ------
    InputError
        A touch has rows with two different indenters.
    """
    rows = np.flatnonzero(touches.in_contact)
    ids, group = groups(touches.touch[rows])
    n = len(ids)
    reads = reads_of_rows(touches)[rows]
    values = touches.readings[rows]
    sd = np.full(values.shape, np.nan) if touches.readings_sd is None else touches.readings_sd[rows]
    known_reads = touches.reads is not None and ~np.isnan(touches.reads[rows])
    inner = np.where(known_reads, reads - 1, 1.0)

    m = touches.n_elements
    means, counts, raw_reads = np.full((n, m), np.nan), np.zeros((n, m)), np.zeros(n)
    variance, dof, equal = np.full(m, np.nan), np.zeros(m), np.zeros(m, dtype=bool)
    for k in range(m):
        some = ~np.isnan(values[:, k])
        means[:, k] = grouped_mean(values[:, k], group, n, reads)
        counts[:, k] = np.bincount(group[some], weights=reads[some], minlength=n)
        raw_reads = np.maximum(raw_reads, counts[:, k])
        if touches.rest_reads is not None:
            of_rest = first_of(touches.rest_reads[rows, k], group, n)
            counts[:, k] = np.where(np.isnan(of_rest), counts[:, k], counts[:, k] / (1 + counts[:, k] / of_rest))
        deviation = values[some, k] - means[group[some], k]
        inside = some & ~np.isnan(sd[:, k])
        squares = np.sum(reads[some] * deviation**2) + np.sum(inner[inside] * sd[inside, k] ** 2)
        freedom = some.sum() - len(np.unique(group[some])) + inner[inside].sum()
        # The readings themselves are compared: a mean of equal ones differs from them by rounding.
        differ = (values[some, k] != first_of(values[:, k], group, n)[group[some]]).any()
        equal[k] = freedom > 0 and not differ and not (sd[inside, k] > 0).any()
        if freedom > 0 and not equal[k]:
            variance[k], dof[k] = squares / freedom, freedom

    def mean(column: FloatArray) -> FloatArray:
        return grouped_mean(column[rows], group, n, reads)

    load_reads, load_variance, load_dof = _load_error(touches.load[rows], group, n, reads)
    return TouchMeans(
        touch=ids,
        readings=means,
        counts=counts,
        pure_error_variance=variance,
        pure_error_dof=dof,
        load=mean(touches.load),
        indenter_radius_mm=_one_indenter(touches.indenter_radius_mm[rows], ids, group),
        depth_mm=mean(touches.depth_mm),
        time_s=mean(touches.time_s),
        angle_deg=None if touches.angle_deg is None else _mean_angle(touches.angle_deg[rows], group, n, reads),
        x_mm=None if touches.x_mm is None else mean(touches.x_mm),
        y_mm=None if touches.y_mm is None else mean(touches.y_mm),
        load_reads=load_reads,
        load_error_variance=load_variance,
        load_error_dof=load_dof,
        repeats_equal=bool(equal.any()) and not dof.any(),
        raw_reads=raw_reads,
    )


def _load_error(load: FloatArray, group: IntArray, n: int, reads: FloatArray) -> tuple[FloatArray, float, float]:
    """Number of reads of each mean load; variance of one read within touches; its degrees of freedom."""
    some, one_load = ~np.isnan(load), all_equal(load, group, n)
    count = np.asarray(np.bincount(group[some], weights=reads[some], minlength=n), dtype=np.float64)
    count = np.where(one_load, first_of(np.where(some, reads, np.nan), group, n), count)
    again = some & ~one_load[group]
    deviation = (load - grouped_mean(load, group, n, reads)[group])[again]
    squares = float(np.sum(reads[again] * deviation**2))
    dof = float(again.sum() - len(np.unique(group[again])))
    return (count, squares / dof, dof) if dof > 0 else (count, np.nan, 0.0)


def _mean_angle(angle: FloatArray, group: IntArray, n: int, weights: FloatArray) -> FloatArray:
    first = first_of(angle, group, n)
    return first + grouped_mean(turned(angle - first[group]), group, n, weights)


def _one_indenter(radius: FloatArray, ids: IntArray, group: IntArray) -> FloatArray:
    first = first_of(radius, group, len(ids))
    wrong = np.flatnonzero(~np.isnan(radius) & (radius != first[group]))
    if len(wrong):
        two = f"{first[group[wrong[0]]]:g} and {radius[wrong[0]]:g} mm"
        raise InputError(f"touch {ids[group[wrong[0]]]} is made with two indenters, {two}", column="indenter_radius_mm")
    return first
