"""Subtracting what the elements read while nothing touches them."""

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
    """No-contact readings of a table, summed up over pieces of it that hold their touches whole; m elements.

    Attributes
    ----------
    rows : int
        No-contact rows.
    touched, with_own : int
        Touches in contact, and those of them that have no-contact rows of their own.
    first, excess, weight : (m,) arrays
        The first reading (NaN without), the weighted sum of all about it, and their weight.
    """

    rows: int
    touched: int
    with_own: int
    first: FloatArray
    excess: FloatArray
    weight: FloatArray

    @classmethod
    def none(cls, n_elements: int) -> RestTally:
        """Of nothing yet."""
        return cls(0, 0, 0, np.full(n_elements, np.nan), np.zeros(n_elements), np.zeros(n_elements))

    def after(self, touches: SampleRows) -> RestTally:
        """The tally with a piece added. Sums go on row by row: the same bits however the table is cut."""
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
        """Mean reading at rest, (m,), NaN for an element without; None where no row is without contact."""
        if not self.rows:
            return None
        zero = np.zeros(len(self.first))
        return np.asarray(self.first + np.divide(self.excess, self.weight, out=zero, where=self.weight > 0))


@dataclass(frozen=True, eq=False)
class Baseline:
    """What to subtract from the readings of a table.

    Attributes
    ----------
    general : (m,) array or None
        For touches without no-contact rows of their own; None takes the readings as they are.
    own : bool
        Whether touches have no-contact rows of their own.
    note : str
        What is done.
    """

    general: FloatArray | None
    own: bool
    note: str

    @classmethod
    def of(cls, tally: RestTally, rest: npt.ArrayLike | None = None) -> Baseline:
        """Of the table that was tallied; `rest` as in `correct`."""
        general = tally.mean
        if general is None and rest is not None:
            given = np.asarray(rest, dtype=np.float64)
            if given.shape != tally.first.shape:
                raise InputError(f"expected a rest reading of {len(tally.first)} elements, got shape {given.shape}")
            return cls(given, False, "the rest reading given was subtracted" + _left(given))
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
        return cls(general, True, note + _left(general))

    def subtracted(self, touches: Rows) -> Rows:
        """The table, or a piece of it that holds its touches whole, with the readings corrected and the note."""
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
    """Mean no-contact reading of each element over the whole table, averaged rows by their `reads`.

    Returns
    -------
    array, shape (m,), or None
        NaN for an element that has none; None where the table has no no-contact row.
    """
    return RestTally.none(touches.n_elements).after(touches).mean


def correct(touches: Rows, rest: npt.ArrayLike | None = None) -> Rows:
    """Subtract the no-contact readings, element by element.

    A touch with no-contact rows of its own has their mean subtracted (this takes out drift, and adds the
    noise of that mean to all its samples alike). Any other touch has the mean of all no-contact rows of
    the table subtracted or, where the table has none, `rest`. No-contact rows are corrected too and kept.

    Parameters
    ----------
    touches : Touches
    rest : array, shape (m,), optional
        Reading at rest from elsewhere (`Touches.rest_reading` of the calibration table, say).

    Returns
    -------
    Touches
        With a note of what was done.

    Raises
    ------
    InputError
        `rest` has not one value for each element.
    """
    return Baseline.of(RestTally.none(touches.n_elements).after(touches), rest).subtracted(touches)


def _left(general: FloatArray) -> str:
    """Which elements have no reading at rest."""
    names = ", ".join(f"e{k + 1:02d}" for k in np.flatnonzero(np.isnan(general)))
    return f" ({names}: no such reading, left as it is)" if names else ""


def _subtracted(touches: Rows, offset: FloatArray, note: str) -> Rows:
    readings = touches.readings - np.where(np.isnan(offset), 0.0, offset)
    return touches.with_(readings=readings, notes=(*touches.notes, note))


def _weights(touches: SampleRows) -> FloatArray:
    return np.ones(touches.n_rows) if touches.reads is None else np.where(np.isnan(touches.reads), 1, touches.reads)
