"""The touch table in memory: one row per sample, one array per column.

See `bayestouch.data.touch_table` for reading and writing, `bayestouch.data.averages` for means per touch.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from bayestouch.array_types import BoolArray, FloatArray, IntArray, ObjectArray
from bayestouch.data.arrays import float_array, read_only, responding, text_rows, whole_array
from bayestouch.errors import InputError, few, shown, unknown_name
from bayestouch.output.summary import Summarised, size_in_short, span
from bayestouch.output.text import plural

if TYPE_CHECKING:
    from bayestouch.data.averages import TouchMeans

_PER_ROW = ("time_s", "indenter_radius_mm", "load", "depth_mm", "contact")
_MAYBE_PER_ROW = ("angle_deg", "x_mm", "y_mm", "reads")


@dataclass(frozen=True, eq=False, repr=False)
class Touches(Summarised):
    """Samples of touches; n rows, m elements. `touches_from` fills in absent columns.

    Arrays are read-only. Those that are given are copied, unless they are read-only themselves.

    Attributes
    ----------
    touch : int array, shape (n,)
        Id of the touch.
    sample : int array, shape (n,)
        Number of the sample within the touch.
    time_s : array, shape (n,)
        Time of the sample; NaN unknown.
    indenter_radius_mm : array, shape (n,)
        Reference radius r_c: 0 a knife edge, inf a flat, NaN unknown.
    angle_deg, x_mm, y_mm : array, shape (n,), or None
        Reference location: the angle on a finger, x (and y in two dimensions) on a pad; None if the
        table does not have the column, NaN in rows without a value.
    load : array, shape (n,)
        Reading of the force sensor, N/m on a finger and N on a pad; NaN not measured.
    depth_mm : array, shape (n,)
        Commanded indentation; NaN unknown.
    contact : array, shape (n,)
        1 in contact, 0 not in contact, NaN not stated (see `in_contact`).
    readings : array, shape (n, m)
        Raw readings in the sensor's own unit; NaN missing.
    readings_sd : array, shape (n, m), or None
        Standard deviation of the raw reads behind an averaged reading; NaN unknown.
    reads : array, shape (n,), or None
        Number of raw reads behind an averaged reading; NaN unknown.
    rest_reads : array, shape (n, m), or None
        Number of raw reads at rest, the mean of which was subtracted from the readings of a touch and has a noise that
        no other touch has; NaN where none was subtracted, or one that many touches share.
    extra : mapping of str to object array of str, shape (n,)
        Columns without a meaning here, as text; kept but not used.
    notes : tuple of str
        Irregularities that were corrected while reading, for the report.

    Raises
    ------
    InputError
        The shapes of the arrays do not agree.

    Examples
    --------
    >>> import bayestouch
    >>> design = bayestouch.FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=10.0)
    >>> dataset = bayestouch.simulate(design, seed=3).dataset
    >>> table = dataset.touches
    >>> table.n_touches, table.readings.shape  # samples, elements
    (45, (900, 4))
    >>> one_tip = table.select(table.indenter_radius_mm == 3.9)
    >>> one_tip.n_touches, one_tip.angle_deg[::20].tolist()  # degree
    (5, [-20.0, -10.0, 0.0, 10.0, 20.0])
    """

    touch: IntArray
    sample: IntArray
    time_s: FloatArray
    indenter_radius_mm: FloatArray
    angle_deg: FloatArray | None
    x_mm: FloatArray | None
    y_mm: FloatArray | None
    load: FloatArray
    depth_mm: FloatArray
    contact: FloatArray
    readings: FloatArray
    readings_sd: FloatArray | None = None
    reads: FloatArray | None = None
    rest_reads: FloatArray | None = None
    extra: Mapping[str, ObjectArray] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        def put(name: str, value: object) -> None:
            object.__setattr__(self, name, value)

        n, m = len(np.atleast_1d(self.touch)), np.shape(self.readings)[-1] if np.ndim(self.readings) else 0
        put("touch", whole_array(self.touch, "touch", n))
        put("sample", whole_array(self.sample, "sample", n))
        for name in (*_PER_ROW, *_MAYBE_PER_ROW):
            value = getattr(self, name)
            if value is not None or name in _PER_ROW:
                put(name, float_array(value, name, (n,)))
        put("readings", float_array(self.readings, "readings", (n, m)))
        for name in ("readings_sd", "rest_reads"):
            if getattr(self, name) is not None:
                put(name, float_array(getattr(self, name), name, (n, m)))
        if not isinstance(self.extra, Mapping):
            raise InputError(f"extra: expected columns by their names, got {shown(self.extra)}")
        put("extra", {name: text_rows(values, name, n) for name, values in self.extra.items()})
        put("notes", tuple(self.notes))

    @property
    def n_rows(self) -> int:
        """Number of rows (samples)."""
        return len(self.touch)

    @property
    def n_elements(self) -> int:
        """Number of elements."""
        return int(self.readings.shape[1])

    @property
    def n_touches(self) -> int:
        """Number of distinct touch ids."""
        return len(np.unique(self.touch))

    @property
    def in_contact(self) -> BoolArray:
        """True for rows in contact, shape (n,): False if contact, depth or load is exactly 0."""
        away = (self.contact == 0) | (self.depth_mm == 0) | (self.load == 0)
        return np.asarray(~away, dtype=np.bool_)

    @property
    def usable_elements(self) -> BoolArray:
        """True for usable elements, shape (m,): False without readings, or if two or more readings are all equal."""
        return responding(self.readings)

    def select(self, rows: npt.ArrayLike | slice) -> Touches:
        """Return the rows that a mask of shape (n,), indices or a slice select."""
        index = rows if isinstance(rows, slice) else np.asarray(rows)
        if not isinstance(index, slice) and index.size == 0 and index.dtype != np.bool_:
            index = index.astype(np.int64)  # an empty list becomes an array of floats
        if not isinstance(index, slice) and (index.ndim != 1 or index.dtype.kind not in "biu"):
            raise InputError(f"expected a mask of the rows, their indices or a slice, got {shown(rows)}")
        if not isinstance(index, slice) and index.dtype == np.bool_ and index.shape != (self.n_rows,):
            raise InputError(f"expected a mask of {self.n_rows} rows, got shape {index.shape}")
        changes: dict[str, Any] = {"extra": {name: read_only(values[index]) for name, values in self.extra.items()}}
        for each in fields(self):
            value = getattr(self, each.name)
            if isinstance(value, np.ndarray):
                changes[each.name] = read_only(value[index])  # so that it is not copied once more
        return replace(self, **changes)

    def with_(self, **changes: Any) -> Touches:
        """Return a copy with other values of some attributes."""
        return replace(self, **changes)

    def with_wires(self, order: IntArray) -> Touches:
        """Return the touches with the readings of the elements in another order, (m,): columns of this table."""
        by_element = {name: getattr(self, name) for name in ("readings", "readings_sd", "rest_reads")}
        return self.with_(**{name: values[:, order] for name, values in by_element.items() if values is not None})

    def averaged(self) -> TouchMeans:
        """Mean of each touch over its samples in contact; see `bayestouch.data.averages.average`."""
        from bayestouch.data.averages import average

        return average(self)

    def rest_reading(self) -> FloatArray | None:
        """Mean no-contact reading of each element, shape (m,); see `bayestouch.data.baseline.rest_reading`."""
        from bayestouch.data.baseline import rest_reading

        return rest_reading(self)

    def baseline_corrected(self, rest: npt.ArrayLike | None = None) -> Touches:
        """Return the touches with the no-contact readings subtracted; see `bayestouch.data.baseline.correct`."""
        from bayestouch.data.baseline import correct

        return correct(self, rest)

    def summary_lines(self) -> list[str]:
        """Lines of the ``repr``."""
        counts = [plural(self.n_touches, "touch"), plural(self.n_rows, "row"), plural(self.n_elements, "element")]
        lines = [f"Touches: {', '.join(counts)}"]
        radii = np.unique(self.indenter_radius_mm[~np.isnan(self.indenter_radius_mm)])
        if radii.size:
            lines.append(f"indenters r_c: {few([size_in_short(radius) for radius in radii], 12)} mm")
        # a table of a finger has angles, one of a pad has positions; without either the body is not known
        on_pad, on_finger = self.x_mm is not None, self.angle_deg is not None
        load_unit = " N/m" if on_finger else " N" if on_pad else ""
        columns = {
            "angle": (self.angle_deg, "°"),
            "x": (self.x_mm, " mm"),
            "y": (self.y_mm, " mm"),
            "load": (self.load, load_unit),
        }
        spans = [f"{name}{known}{unit}" for name, (column, unit) in columns.items() if (known := _span_of(column))]
        missing = int(np.isnan(self.readings).sum())
        return [*lines, *filter(None, [", ".join(spans)]), f"readings{span(self.readings)}, {missing} missing"]


def touches_from(
    touch: npt.ArrayLike, readings: npt.ArrayLike, *, sample: npt.ArrayLike | None = None, **columns: Any
) -> Touches:
    """Return `Touches` from arrays or columns of a data frame; n rows (samples), m elements.

    Parameters
    ----------
    touch : int array, shape (n,)
        Id of the touch of each row.
    readings : array, shape (n, m)
        Raw readings in the sensor's own unit, one column an element; NaN missing.
    sample : int array, shape (n,), optional
        Number of the sample within the touch. By default the rows of each touch are numbered in order.
    **columns
        Any other attribute of `Touches`, such as ``load`` (N/m on a finger, N on a pad), ``angle_deg``, ``x_mm``,
        ``y_mm``, ``indenter_radius_mm`` or ``time_s``: an array of shape (n,), or a number for every row. What is not
        given, or None, is unknown.

    Returns
    -------
    Touches
        The table, its arrays read-only.

    Raises
    ------
    InputError
        A column has another name or another number of rows, or is not numeric.

    Examples
    --------
    Four samples of two touches on a finger of three elements:

    >>> import bayestouch
    >>> readings = [[210.0, 80.0, 12.0], [211.0, 79.0, 13.0], [35.0, 190.0, 60.0], [36.0, 191.0, 58.0]]
    >>> table = bayestouch.touches_from([0, 0, 1, 1], readings, load=200.0, angle_deg=[-8.0, -8.0, 1.0, 1.0])
    >>> table.sample.tolist(), table.load.tolist()  # N/m
    ([0, 1, 0, 1], [200.0, 200.0, 200.0, 200.0])

    A data frame of `DataSet.to_dataframe`, back to touches:

    >>> design = bayestouch.FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=10.0)
    >>> frame = bayestouch.simulate(design, seed=3).dataset.to_dataframe().query("table == 'touches'")
    >>> names = ["touch", "sample", "time_s", "indenter_radius_mm", "angle_deg"]
    >>> elements = frame.filter(regex="^e[0-9]+$")
    >>> bayestouch.touches_from(readings=elements, load=frame["load_N_per_m"], **frame[names]).n_touches
    45
    """
    known = [each.name for each in fields(Touches)]
    for name in columns:
        if name not in known:
            raise unknown_name("column of touches", name, known)
    columns = {name: values for name, values in columns.items() if values is not None}
    ids = whole_array(touch, "touch", len(np.atleast_1d(np.asarray(touch))))
    n = len(ids)
    given = {
        name: np.full(n, value) if np.ndim(value) == 0 and value is not None else value
        for name, value in columns.items()
        if name in (*_PER_ROW, *_MAYBE_PER_ROW)
    }
    unknown = {name: np.full(n, np.nan) for name in _PER_ROW} | dict.fromkeys(("angle_deg", "x_mm", "y_mm"))
    always = {"touch": ids, "sample": numbered(ids) if sample is None else sample, "readings": readings}
    return Touches(**{**unknown, **columns, **given, **always})


def numbered(touch: IntArray) -> IntArray:
    """Return the number of each row within its touch, 0, 1, 2 …, in the order of the rows. Shape (n,)."""
    order = np.argsort(touch, kind="stable")
    sorted_ids = touch[order]
    first = np.flatnonzero(np.r_[True, sorted_ids[1:] != sorted_ids[:-1]]) if len(touch) else np.array([], dtype=int)
    lengths = np.diff(np.r_[first, len(touch)])
    result = np.empty(len(touch), dtype=np.int64)
    result[order] = np.arange(len(touch)) - np.repeat(first, lengths)
    return result


def _span_of(column: FloatArray | None) -> str:
    return "" if column is None else span(column)
