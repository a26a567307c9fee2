"""Touches of a table that fits can use, and remarks on what they cannot use."""

from __future__ import annotations

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray
from bayestouch.data.averages import average
from bayestouch.data.grouping import first_of, groups
from bayestouch.data.sample_rows import reads_of_rows
from bayestouch.data.touches import Touches
from bayestouch.errors import few
from bayestouch.output.text import plural

#: Why an element is left out.
DEAD = "no readings, or the same one in every row"


def have_references(table: Touches, references: tuple[str, ...]) -> BoolArray:
    """Whether each touch presses, with all `references`, (t,).

    A column that the table does not have is not required (a pad along a line has no y); but some location is.
    """
    known = _presses(table)
    if table.angle_deg is None and table.x_mm is None:
        return np.zeros_like(known)
    for name in references:
        if getattr(table, name) is not None:
            known &= ~np.isnan(_first_in_contact(table, name))
    return np.asarray(known)


def without_references(table: Touches, references: tuple[str, ...], calibrating: BoolArray) -> tuple[str, ...]:
    """A note on the calibration touches, a mask (t,), that press but are not used, with the columns that they lack."""
    pressed = _presses(table) & calibrating
    lacking = {
        name: pressed & np.isnan(_first_in_contact(table, name))
        for name in references
        if getattr(table, name) is not None
    }
    unused = np.any([*lacking.values(), np.zeros_like(pressed)], axis=0)
    if not unused.any():
        return ()
    columns = " or ".join(name for name, rows in lacking.items() if rows.any())
    return (f"{unused.sum()} of {pressed.sum()} calibration touches are without {columns}: they are not used",)


def of_measured_load(table: Touches, rows: BoolArray, *, needs_load: bool) -> tuple[BoolArray, tuple[str, ...]]:
    """Rows (n,) of touches to fit without those of touches that lack a load, if one is needed; and a note."""
    ids, group = groups(table.touch)
    measured = np.bincount(group[rows & table.in_contact & np.isfinite(table.load)], minlength=len(ids)) > 0
    lacking = np.unique(group[rows & ~measured[group]])
    if not (needs_load and measured.any() and len(lacking)):
        return rows, ()
    return rows & measured[group], (without_load(len(lacking)),)


def without_load(count: int) -> str:
    """A note on touches of a fit, of one table or of two, that lack a load."""
    return f"{plural(count, 'touch')} without a load above zero: left out of the fit"


def remarks_on(table: Touches, rows: BoolArray) -> tuple[str, ...]:
    """Remarks on readings and samples that are missing in `rows`, the rows used in fits."""
    out = []
    if dead := left_out_elements(table, rows):
        out.append(f"{few(dead)}: {DEAD}; left out")
    seen = table.touch[rows & table.in_contact]
    once = len(np.unique(seen)) == len(seen)
    noise = "the noise is that of readings far from the touch, and effects of the noise"
    if once and not (reads_of_rows(table) > 1).any():
        out.append(f"no touch was read twice: {noise}, and those that change while a touch is held, cannot be seen")
    elif not once and average(table.select(rows)).repeats_equal:
        out.append(f"the samples of each touch are all equal: {noise} cannot be seen")
    return tuple(out)


def left_out_elements(table: Touches, rows: BoolArray) -> list[str]:
    """Names of the elements without readings in `rows`, of a table without those of dead elements."""
    return [f"e{k + 1:02d}" for k in np.flatnonzero(np.isnan(table.readings[rows]).all(axis=0))]


def _presses(table: Touches) -> BoolArray:
    """Whether each touch has a row in contact with a reading, and with a load that is not zero or less, (t,)."""
    ids, group = groups(table.touch)
    return np.asarray(np.bincount(group[_pressing(table)], minlength=len(ids)) > 0)


def _pressing(table: Touches) -> BoolArray:
    return np.asarray(table.in_contact & ~np.isnan(table.readings).all(axis=1) & ~(table.load <= 0))


def _first_in_contact(table: Touches, name: str) -> FloatArray:
    """First value of a column in rows of each touch that press, (t,); NaN for none."""
    ids, group = groups(table.touch)
    return first_of(np.where(_pressing(table), getattr(table, name), np.nan), group, len(ids))
