"""Touches that are copies of other touches, in one table or in both of a data set."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bayestouch.array_types import BoolArray, IntArray
from bayestouch.data.touches import Touches
from bayestouch.output.text import plural

_PLACES = ("angle_deg", "x_mm", "y_mm")


def copies(table: Touches, of: Touches | None = None) -> IntArray:
    """First rows of touches that are copies, and of the touches that they are copies of, (k, 2), from 0.

    A copy has the readings of all elements in all samples, the loads and the places of another touch. Readings that a
    touch may have by chance do not count: those that are all zero or at an end of the range, and samples that are all
    the same (a coarse or an exact readout) at another time.

    Parameters
    ----------
    table : Touches
        Touches that may be copies.
    of : Touches, optional
        Touches of which they may be copies; by default those above them in the same table.
    """
    source = table if of is None else of
    places = [name for name in _PLACES if all(getattr(each, name) is not None for each in (table, source))]
    seen: dict[bytes, list[IntArray]] = {}
    for rows, key in () if of is None else _keyed(of, places):
        seen.setdefault(key, []).append(rows)
    found = []
    for rows, key in _keyed(table, places):
        others = seen.get(key, [])
        first = next((each for each in others if _is_copy(table, rows, source, each)), None)
        if first is not None:
            found.append((rows[0], first[0]))
        elif of is None:
            seen.setdefault(key, []).append(rows)
    return np.array(found, dtype=np.int64).reshape(-1, 2)


def notes_on_copies(calibration: Touches | None, touches: Touches, names: tuple[str, str]) -> Iterator[str]:
    """Yield a line for each table with copies, with the rows of the first one as in the file; names of both files."""
    tables = () if calibration is None else ((calibration, names[0], None, names[0]),)
    of_both = () if calibration is None else ((touches, names[1], calibration, names[0]),)
    for table, name, of, other in (*tables, (touches, names[1], None, names[1]), *of_both):
        found = copies(table, of)
        if not len(found):
            continue
        row, first = found[0] + 2  # the first row of a file has the names of the columns
        many = f"{len(found)} of {plural(table.n_touches, 'touch')} {'is a copy' if len(found) == 1 else 'are copies'}"
        why = "which count twice" if of is None else "whose errors are those of touches that were calibrated with"
        yield (
            f"{name}, row {row}: the readings, loads and places of this touch are those of {other}, row {first}; "
            f"{many}, {why}"
        )


def _keyed(table: Touches, places: list[str]) -> Iterator[tuple[IntArray, bytes]]:
    """Rows in contact of each touch, and what a copy has in common with it; only of touches with resolved readings."""
    rows = np.flatnonzero(table.in_contact)
    rows = rows[np.argsort(table.touch[rows], kind="stable")]
    starts = np.flatnonzero(np.diff(table.touch[rows])) + 1
    resolved = _resolved(table)
    columns = [table.load, *(getattr(table, name) for name in places)]
    values = np.column_stack([table.readings, *columns]) + 0.0  # -0 and 0 are the same
    for each in sorted(np.split(rows, starts), key=lambda each: each[:1].tolist()):
        if resolved[each].any():
            yield each, values[each].tobytes()


def _resolved(table: Touches) -> BoolArray:
    """Rows with a reading that is neither zero nor at an end of the range of its element."""
    readings = table.readings
    low, high = np.fmin.reduce(readings, axis=0, initial=np.inf), np.fmax.reduce(readings, axis=0, initial=-np.inf)
    return np.asarray(((readings != 0) & (readings > low) & (readings < high)).any(axis=1))


def _is_copy(table: Touches, rows: IntArray, of: Touches, others: IntArray) -> bool:
    """Whether touches with the same readings are copies: noise differs from touch to touch, and so does the time."""
    noisy = bool((np.ptp(np.nan_to_num(table.readings[rows]), axis=0) > 0).any())
    return noisy or np.array_equal(table.time_s[rows], of.time_s[others], equal_nan=True)
