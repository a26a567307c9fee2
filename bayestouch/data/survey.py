"""First pass over a touch table: counts, baseline and a sample of touches, needed before touches are read."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import IntArray
from bayestouch.data.baseline import RestTally
from bayestouch.data.grouping import groups
from bayestouch.data.remarks import Tally
from bayestouch.data.touch_source import TouchSource, joined_touches
from bayestouch.data.touches import Touches
from bayestouch.parallel.ahead import ahead

#: Minimum number of touches in the sample; the maximum is twice this number.
SAMPLED = 256


@dataclass(frozen=True, eq=False)
class Survey:
    """Result of the first pass over a touch table.

    Attributes
    ----------
    n_touches, n_rows : int
        Number of touches in contact, and of their rows in contact.
    touches_without_load, rows_without_load : int
        Number of those without a measured load.
    without_reading : list of int
        Numbers of the touches in contact that have no reading, in order.
    rest : RestTally
        Sums of the no-contact readings.
    sample : Touches
        All touches of a small table, or up to 512 touches at equal intervals, with all their rows.
    notes : tuple of str
        Irregularities that were corrected while reading, and unusual features of the table.
    """

    n_touches: int
    n_rows: int
    touches_without_load: int
    rows_without_load: int
    without_reading: list[int]
    rest: RestTally
    sample: Touches
    notes: tuple[str, ...]


def survey(source: TouchSource) -> Survey:
    """Return the result of one pass over a table, with one piece of it in memory at a time.

    Raises
    ------
    InputError
        The table cannot be read.
    Scattered
        See `TouchSource.pieces`.
    """
    rest, tally = RestTally.none(source.n_elements), None
    sampled = _Sample()
    n_rows, without, rows_without = 0, 0, 0
    without_reading: list[int] = []
    notes: list[str] = []
    for piece in ahead(source.pieces()):
        rest = rest.after(piece)
        tally = Tally.of(piece) if tally is None else tally + Tally.of(piece)
        contact = piece.in_contact
        ids, group = groups(piece.touch[contact])
        measured = np.bincount(group, weights=~np.isnan(piece.load[contact]), minlength=len(ids))
        without += int((measured == 0).sum())
        rows_without += int(np.isnan(piece.load[contact]).sum())
        read = np.bincount(group, weights=~np.isnan(piece.readings[contact]).all(axis=1), minlength=len(ids))
        without_reading += ids[read == 0].tolist()
        n_rows += len(group)
        sampled.add(piece, ids)
        notes += piece.notes
    assert tally is not None
    notes += source.remarks(tally)
    return Survey(
        n_touches=sampled.count,
        n_rows=n_rows,
        touches_without_load=without,
        rows_without_load=rows_without,
        without_reading=without_reading,
        rest=rest,
        sample=sampled.touches(),
        notes=tuple(dict.fromkeys(notes)),
    )


class _Sample:
    """Every k-th touch of a table; k doubles each time the sample becomes too large."""

    def __init__(self) -> None:
        self.count = 0
        self._stride = 1
        self._parts: list[tuple[IntArray, Touches]] = []

    def add(self, piece: Touches, ids: IntArray) -> None:
        """Add a piece; `ids` are its touches in contact, in order."""
        number = self.count + np.arange(len(ids))
        self.count += len(ids)
        while -(-self.count // self._stride) > 2 * SAMPLED:
            self._stride *= 2
        order = np.argsort(ids)
        place = np.searchsorted(ids, piece.touch, sorter=order).clip(max=max(len(ids) - 1, 0))
        row_number = np.full(piece.n_rows, -1)
        if len(ids):
            match = ids[order][place] == piece.touch
            row_number[match] = number[order][place[match]]
        elif not self._parts:
            self._parts.append((np.empty(0, dtype=np.int64), piece.select(slice(0, 0))))
        self._parts.append((row_number, piece))
        self._parts = [self._thinned(*part) for part in self._parts]

    def touches(self) -> Touches:
        """Return the touches of the sample."""
        return joined_touches([part for _, part in self._parts]).with_(notes=())

    def _thinned(self, number: IntArray, part: Touches) -> tuple[IntArray, Touches]:
        keep = (number >= 0) & (number % self._stride == 0)
        return (number, part) if keep.all() else (number[keep], part.select(keep))
