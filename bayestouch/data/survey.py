"""What must be known of a whole table before the first of its touches can be read."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import IntArray
from bayestouch.data.baseline import RestTally
from bayestouch.data.grouping import groups
from bayestouch.data.remarks import Tally
from bayestouch.data.touch_source import TouchSource, joined_touches
from bayestouch.data.touches import Touches

#: Touches in the sample: so many, and up to twice as many.
SAMPLED = 256


@dataclass(frozen=True, eq=False)
class Survey:
    """A table gone through once.

    Attributes
    ----------
    n_touches, n_rows : int
        Touches in contact, and their rows in contact.
    touches_without_load, rows_without_load : int
        Those of them that have no measured load.
    rest : RestTally
        Readings without contact.
    sample : Touches
        Every touch of a small table, or up to 512 spread evenly over it, with all their rows.
    notes : tuple of str
        What was handled in reading, and what is odd.
    """

    n_touches: int
    n_rows: int
    touches_without_load: int
    rows_without_load: int
    rest: RestTally
    sample: Touches
    notes: tuple[str, ...]


def survey(source: TouchSource) -> Survey:
    """Go through a table once, with one piece of it in memory.

    Raises
    ------
    InputError
        From reading it.
    Scattered
        See `TouchSource.pieces`.
    """
    rest, tally = RestTally.none(source.n_elements), None
    sampled = _Sample()
    n_rows, without, rows_without = 0, 0, 0
    notes: list[str] = []
    for piece in source.pieces():
        rest = rest.after(piece)
        tally = Tally.of(piece) if tally is None else tally + Tally.of(piece)
        contact = piece.in_contact
        ids, group = groups(piece.touch[contact])
        measured = np.bincount(group, weights=~np.isnan(piece.load[contact]), minlength=len(ids))
        without += int((measured == 0).sum())
        rows_without += int(np.isnan(piece.load[contact]).sum())
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
        rest=rest,
        sample=sampled.touches(),
        notes=tuple(dict.fromkeys(notes)),
    )


class _Sample:
    """Every so many-th touch: twice as many apart whenever there are too many."""

    def __init__(self) -> None:
        self.count = 0
        self._stride = 1
        self._parts: list[tuple[IntArray, Touches]] = []

    def add(self, piece: Touches, ids: IntArray) -> None:
        """Add a piece with its touches in contact, in order."""
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
        """The sample."""
        return joined_touches([part for _, part in self._parts]).with_(notes=())

    def _thinned(self, number: IntArray, part: Touches) -> tuple[IntArray, Touches]:
        keep = (number >= 0) & (number % self._stride == 0)
        return (number, part) if keep.all() else (number[keep], part.select(keep))
