"""Baseline correction: subtract the readings of the elements without contact."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import numpy.typing as npt
from scipy.stats import chi2

from bayestouch.array_types import FloatArray
from bayestouch.data.averages import average
from bayestouch.data.grouping import grouped_mean, groups
from bayestouch.data.sample_rows import SampleRows, reads_of_rows
from bayestouch.errors import InputError

Rows = TypeVar("Rows", bound=SampleRows)

#: Note of a table without readings at rest.
NO_REST = "no reading without contact: readings are taken as they are"
# Noise at rest counts as smaller than in contact if the readings at rest show it with this probability.
SURE = 0.95


@dataclass(frozen=True, eq=False)
class RestTally:
    """Running sums of the no-contact readings of a table that is read in pieces; m elements.

    All rows of a touch must be in the same piece.

    Attributes
    ----------
    rows : int
        Number of no-contact rows.
    touched, with_own : int
        Number of touches in contact, and of those among them that have no-contact rows of their own.
    first, excess, weight : (m,) arrays
        First reading (NaN if there is none), weighted sum of the deviations from it, and sum of the weights.
    last, last_weight : (m,) arrays
        Last reading (NaN if there is none) and its weight.
    squares, pairs : (m,) arrays
        Sum of the squares of differences between one reading and the next, each over the variance that it has for reads
        of variance one; and their number.
    """

    rows: int
    touched: int
    with_own: int
    first: FloatArray
    excess: FloatArray
    weight: FloatArray
    last: FloatArray
    last_weight: FloatArray
    squares: FloatArray
    pairs: FloatArray

    @classmethod
    def none(cls, n_elements: int) -> RestTally:
        """Return the sums before any row is added."""
        unknown, zero = np.full(n_elements, np.nan), np.zeros(n_elements)
        return cls(0, 0, 0, unknown, zero, zero, unknown, zero, zero, zero)

    def after(self, touches: SampleRows) -> RestTally:
        """Return the sums with a piece added, row by row: the division into pieces does not change the last bits."""
        away = ~touches.in_contact
        touched = np.unique(touches.touch[~away])
        first, excess, weight = self.first.copy(), self.excess.copy(), self.weight.copy()
        last, last_weight, squares, pairs = (
            each.copy() for each in (self.last, self.last_weight, self.squares, self.pairs)
        )
        if away.any():
            weights = reads_of_rows(touches)[away]
            for k, values in enumerate(touches.readings[away].T):
                some = ~np.isnan(values)
                if not some.any():
                    continue
                first[k] = values[some][0] if np.isnan(first[k]) else first[k]
                moved = weights[some] * (values[some] - first[k])
                excess[k] = np.cumsum(np.append(excess[k], moved))[-1]
                weight[k] = np.cumsum(np.append(weight[k], weights[some]))[-1]
                row, reads = values[some], weights[some]
                if not np.isnan(last[k]):
                    row, reads = np.append(last[k], row), np.append(last_weight[k], reads)
                steps = np.diff(row) ** 2 / (1 / reads[1:] + 1 / reads[:-1])
                squares[k] = np.cumsum(np.append(squares[k], steps))[-1]
                pairs[k] += len(steps)
                last[k], last_weight[k] = row[-1], reads[-1]
        return RestTally(
            rows=self.rows + int(away.sum()),
            touched=self.touched + len(touched),
            with_own=self.with_own + int(np.isin(touched, touches.touch[away]).sum()),
            first=first,
            excess=excess,
            weight=weight,
            last=last,
            last_weight=last_weight,
            squares=squares,
            pairs=pairs,
        )

    def reads(self, variance: FloatArray) -> FloatArray:
        """Reads in contact with the noise of one read at rest, (m,), 1 or more.

        `variance` (m,) is that of one read in contact, NaN if unknown. It may include what changes in contact alone, as
        creep does. One read at rest counts as less noisy only if differences from one to the next show it.
        """
        # Differences that follow each other share a reading: they are worth two thirds of their number.
        freedom = 2 / 3 * np.maximum(self.pairs, 1.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = variance * chi2.ppf(1 - SURE, freedom) / (2 / 3 * self.squares)
        # Two equal readings may be chance; three are of a readout that does not resolve the noise at rest.
        known = ~np.isnan(ratio) & (self.pairs > 0) & (np.isfinite(ratio) | (self.pairs > 1))
        return np.where(known, np.maximum(ratio, 1.0), 1.0)

    @property
    def mean(self) -> FloatArray | None:
        """Mean no-contact reading, shape (m,), NaN for an element without one; None if there is no no-contact row."""
        if not self.rows:
            return None
        zero = np.zeros(len(self.first))
        return np.asarray(self.first + np.divide(self.excess, self.weight, out=zero, where=self.weight > 0))


@dataclass(frozen=True, eq=False)
class Baseline:
    """Values that are subtracted from the readings of a table.

    Attributes
    ----------
    general : (m,) array or None
        Used for touches without no-contact rows of their own; None if the readings are not changed.
    own : bool
        Whether touches have no-contact rows of their own.
    note : str
        Description of the correction.
    reads : (m,) array or None
        Number of raw reads behind `general` if its noise counts for each touch, see `of`; None if it does not.
    before : (m,) array or None
        Number of raw reads behind the rest reading of the calibration, see `of`.
    each_read : (m,) array or float
        Reads in contact with the noise of one read at rest, see `RestTally.reads`.
    every_own : bool
        Whether every touch has no-contact rows of its own, so that none needs `general`.
    """

    general: FloatArray | None
    own: bool
    note: str
    reads: FloatArray | None = None
    before: FloatArray | None = None
    each_read: FloatArray | float = 1.0
    every_own: bool = False

    @classmethod
    def of(
        cls,
        tally: RestTally,
        rest: npt.ArrayLike | None = None,
        *,
        each: bool = False,
        before: FloatArray | None = None,
        variance: FloatArray | None = None,
    ) -> Baseline:
        """Return the baseline of the table that `tally` sums up.

        Parameters
        ----------
        tally : RestTally
            No-contact readings of the table.
        rest : (m,) array, optional
            As in `correct`.
        each : bool
            Whether the noise of a mean that touches share counts for each of them. It does where every touch is read by
            itself; in a fit of all touches it is an error that they have in common.
        before : (m,) array, optional
            Number of raw reads behind the rest reading of the calibration, if the offsets of the calibrated sensor are
            counted from it. Touches with another rest reading have the noise of both.
        variance : (m,) array, optional
            Variance of one read in contact, NaN if unknown; by default a read at rest has the same.
        """
        general = tally.mean
        if general is None and rest is not None:
            given = np.asarray(rest, dtype=np.float64)
            if given.shape != tally.first.shape:
                raise InputError(f"expected a rest reading of {len(tally.first)} elements, got shape {given.shape}")
            return cls(given, False, "the rest reading given was subtracted" + _without_rest_reading(given))
        if general is None:
            return cls(None, False, NO_REST)
        if tally.with_own == tally.touched:
            note = "each touch's own mean no-contact reading was subtracted"
        elif tally.with_own == 0:
            note = f"the mean of all {tally.rows} no-contact rows was subtracted"
        else:
            note = (
                f"the mean no-contact reading was subtracted: its own in {tally.with_own} of {tally.touched} touches, "
                "that of all no-contact rows in the others"
            )
        each_read: FloatArray | float = 1.0 if variance is None else tally.reads(variance)
        reads = np.where(tally.weight > 0, tally.weight * each_read, np.nan) if each else None
        every_own = tally.with_own == tally.touched
        return cls(general, True, note + _without_rest_reading(general), reads, before, each_read, every_own)

    @property
    def shared_variance(self) -> FloatArray | None:
        """Variance of the error that touches share by what is subtracted, over that of one read in contact, (m,).

        It is the error of `general`, if a touch needs it, and of the rest reading of the calibration. None if the noise
        of the rest reading does not count for each touch.
        """
        if self.reads is None:
            return None
        of_table = np.full(len(self.reads), np.inf) if self.every_own else self.reads
        return np.nan_to_num(1 / combined_reads(of_table, self.before))

    def subtracted(self, touches: Rows) -> Rows:
        """Return the table (or a piece of it with complete touches) with corrected readings and the note."""
        if self.general is None:
            return touches.with_(notes=(*touches.notes, self.note))
        away, shape = ~touches.in_contact, touches.readings.shape
        shared = None if self.reads is None else np.broadcast_to(combined_reads(self.reads, self.before), shape)
        if not self.own or not away.any():
            return _subtracted(touches, np.tile(self.general, (touches.n_rows, 1)), self.note, shared)
        ids, group = groups(touches.touch)
        weights, there, members = reads_of_rows(touches)[away], ~np.isnan(touches.readings[away]), group[away]
        columns = touches.readings[away].T
        own = np.stack([grouped_mean(values, members, len(ids), weights) for values in columns], axis=1)
        count = np.stack([np.bincount(members, weights * some, len(ids)) for some in there.T], axis=1)
        # Before the rows are spread: one value for each touch.
        offset, known = np.where(np.isnan(own), self.general, own), count > 0
        reads = np.where(
            known[group],
            combined_reads(np.where(known, np.maximum(count, 1.0) * self.each_read, np.nan), self.before)[group],
            np.nan if shared is None else shared,
        )
        return _subtracted(touches, offset[group], self.note, None if np.isnan(reads).all() else reads)


def combined_reads(reads: FloatArray, before: FloatArray | None) -> FloatArray:
    """Number of reads whose mean has the noise of a rest reading and of that of the calibration together, (..., m).

    `reads` (..., m) are those of the rest reading; `before` (m,) as in `Baseline.of`, NaN where it does not count.
    """
    if before is None:
        return np.asarray(reads, dtype=np.float64)
    with np.errstate(divide="ignore"):
        return np.asarray(1 / (1 / reads + np.nan_to_num(1 / before)))


def rest_reading(touches: SampleRows) -> FloatArray | None:
    """Mean no-contact reading of each element over the whole table, each row weighted by its `reads`.

    Returns
    -------
    array, shape (m,), or None
        NaN for an element without such a reading; None if the table has no no-contact row.
    """
    return RestTally.none(touches.n_elements).after(touches).mean


def shared_rest_reads(touches: SampleRows) -> FloatArray | None:
    """Number of raw reads behind the rest reading that touches share, see `correct`.

    Returns
    -------
    array, shape (m,), or None
        NaN for an element without such a reading; None if the touches share none.
    """
    tally = RestTally.none(touches.n_elements).after(touches)
    shared = tally.rows > 0 and tally.with_own < tally.touched
    return np.where(tally.weight > 0, rest_reads_of(tally, touches), np.nan) if shared else None


def rest_reads_of(tally: RestTally, touches: SampleRows) -> FloatArray:
    """Number of reads in contact with the noise of the mean no-contact reading of a table, (m,); 0 without one."""
    return np.where(tally.weight > 0, tally.weight * tally.reads(average(touches).pure_error_variance), 0.0)


def correct(touches: Rows, rest: npt.ArrayLike | None = None) -> Rows:
    """Return the touches with the no-contact readings subtracted, element by element.

    If a touch has no-contact rows of its own, their mean is subtracted. This removes drift, and adds the noise of
    that mean, the same to all samples of the touch: `Touches.rest_reads` has the number of its reads. For any other
    touch, the mean of all no-contact rows of the table is subtracted or, if the table has none, `rest`. No-contact rows
    are corrected too and kept.

    Parameters
    ----------
    touches : Touches
    rest : array, shape (m,), optional
        Reading without contact from another table, for example `Touches.rest_reading` of the calibration table.

    Returns
    -------
    Touches
        A note describes the correction.

    Raises
    ------
    InputError
        `rest` does not have one value for each element.
    """
    tally = RestTally.none(touches.n_elements).after(touches)
    variance = average(touches).pure_error_variance if tally.rows else None
    return Baseline.of(tally, rest, variance=variance).subtracted(touches)


def _without_rest_reading(general: FloatArray) -> str:
    """Text that names the elements without a no-contact reading; empty if all have one."""
    names = ", ".join(f"e{k + 1:02d}" for k in np.flatnonzero(np.isnan(general)))
    return f" ({names}: no such reading, left as it is)" if names else ""


def _subtracted(touches: Rows, offset: FloatArray, note: str, rest_reads: FloatArray | None) -> Rows:
    readings = touches.readings - np.where(np.isnan(offset), 0.0, offset)
    return touches.with_(readings=readings, rest_reads=rest_reads, notes=(*touches.notes, note))
