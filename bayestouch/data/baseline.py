"""Baseline correction: subtract the readings of the elements without contact."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from bayestouch.array_types import FloatArray
from bayestouch.data.grouping import grouped_mean, groups
from bayestouch.data.sample_rows import SampleRows
from bayestouch.errors import InputError

Rows = TypeVar("Rows", bound=SampleRows)


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
    """

    rows: int
    touched: int
    with_own: int
    first: FloatArray
    excess: FloatArray
    weight: FloatArray

    @classmethod
    def none(cls, n_elements: int) -> RestTally:
        """Return the sums before any row is added."""
        return cls(0, 0, 0, np.full(n_elements, np.nan), np.zeros(n_elements), np.zeros(n_elements))

    def after(self, touches: SampleRows) -> RestTally:
        """Return the sums with a piece added, row by row: the division into pieces does not change the last bits."""
        away = ~touches.in_contact
        touched = np.unique(touches.touch[~away])
        first, excess, weight = self.first.copy(), self.excess.copy(), self.weight.copy()
        if away.any():
            weights = _weights(touches)[away]
            for k, values in enumerate(touches.readings[away].T):
                some = ~np.isnan(values)
                if not some.any():
                    continue
                first[k] = values[some][0] if np.isnan(first[k]) else first[k]
                moved = weights[some] * (values[some] - first[k])
                excess[k] = np.cumsum(np.append(excess[k], moved))[-1]
                weight[k] = np.cumsum(np.append(weight[k], weights[some]))[-1]
        return RestTally(
            rows=self.rows + int(away.sum()),
            touched=self.touched + len(touched),
            with_own=self.with_own + int(np.isin(touched, touches.touch[away]).sum()),
            first=first,
            excess=excess,
            weight=weight,
        )

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
    """

    general: FloatArray | None
    own: bool
    note: str

    @classmethod
    def of(cls, tally: RestTally, rest: npt.ArrayLike | None = None) -> Baseline:
        """Return the baseline of the table that `tally` sums up; `rest` as in `correct`."""
        general = tally.mean
        if general is None and rest is not None:
            given = np.asarray(rest, dtype=np.float64)
            if given.shape != tally.first.shape:
                raise InputError(f"expected a rest reading of {len(tally.first)} elements, got shape {given.shape}")
            return cls(given, False, "the rest reading given was subtracted" + _without_rest_reading(given))
        if general is None:
            return cls(None, False, "no reading without contact: readings are taken as they are")
        if tally.with_own == tally.touched:
            note = "each touch's own mean no-contact reading was subtracted"
        elif tally.with_own == 0:
            note = f"the mean of all {tally.rows} no-contact rows was subtracted"
        else:
            note = (
                f"the mean no-contact reading was subtracted: its own in {tally.with_own} of {tally.touched} touches, "
                "that of all no-contact rows in the others"
            )
        return cls(general, True, note + _without_rest_reading(general))

    def subtracted(self, touches: Rows) -> Rows:
        """Return the table (or a piece of it with complete touches) with corrected readings and the note."""
        if self.general is None:
            return touches.with_(notes=(*touches.notes, self.note))
        away = ~touches.in_contact
        if not self.own or not away.any():
            return _subtracted(touches, np.tile(self.general, (touches.n_rows, 1)), self.note)
        ids, group = groups(touches.touch)
        weights = _weights(touches)[away]
        own = np.stack(
            [grouped_mean(values, group[away], len(ids), weights) for values in touches.readings[away].T], axis=1
        )
        return _subtracted(touches, np.where(np.isnan(own), self.general, own)[group], self.note)


def rest_reading(touches: SampleRows) -> FloatArray | None:
    """Mean no-contact reading of each element over the whole table, each row weighted by its `reads`.

    Returns
    -------
    array, shape (m,), or None
        NaN for an element without such a reading; None if the table has no no-contact row.
    """
    return RestTally.none(touches.n_elements).after(touches).mean


def correct(touches: Rows, rest: npt.ArrayLike | None = None) -> Rows:
    """Return the touches with the no-contact readings subtracted, element by element.

    If a touch has no-contact rows of its own, their mean is subtracted. This removes drift, and adds the noise of
    that mean, the same to all samples of the touch. For any other touch, the mean of all no-contact rows of the
    table is subtracted or, if the table has none, `rest`. No-contact rows are corrected too and kept.

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
    return Baseline.of(RestTally.none(touches.n_elements).after(touches), rest).subtracted(touches)


def _without_rest_reading(general: FloatArray) -> str:
    """Text that names the elements without a no-contact reading; empty if all have one."""
    names = ", ".join(f"e{k + 1:02d}" for k in np.flatnonzero(np.isnan(general)))
    return f" ({names}: no such reading, left as it is)" if names else ""


def _subtracted(touches: Rows, offset: FloatArray, note: str) -> Rows:
    readings = touches.readings - np.where(np.isnan(offset), 0.0, offset)
    return touches.with_(readings=readings, notes=(*touches.notes, note))


def _weights(touches: SampleRows) -> FloatArray:
    return np.ones(touches.n_rows) if touches.reads is None else np.where(np.isnan(touches.reads), 1, touches.reads)
