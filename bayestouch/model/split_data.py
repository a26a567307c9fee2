"""Split of a data set into touches for fits with effects and touches held out for the estimate of errors."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray, IntArray
from bayestouch.data.dataset import DataSet
from bayestouch.data.grouping import beginnings, first_of, groups
from bayestouch.data.loads import loads_vary
from bayestouch.data.splits import with_calibration
from bayestouch.data.touches import Touches, numbered
from bayestouch.effects.effect import Setting
from bayestouch.errors import InputError
from bayestouch.model.body import body_of
from bayestouch.model.observations import Observations, history_of
from bayestouch.model.shared_rest import RestOffsets, shared_rest
from bayestouch.model.silent import means_by_table, silent_elements
from bayestouch.model.timing import Timing, one_clock, typical_gap
from bayestouch.model.usable_touches import have_references, of_measured_load, remarks_on, without_references

# Smallest number of touches with references for a split of the touches to be read, and for a split of the calibration.
ENOUGH_READ, ENOUGH_CALIBRATION = 20, 40
TOO_FEW = "too few touches to hold any out: errors are not estimated"
# The same where `touches.csv` gives none of its touches a known tip and place.
NO_REFERENCES = (
    "no touch to be read has references ({columns}), and too few calibration touches have them to hold any out: errors "
    "are not estimated"
)
NOTHING_KNOWN = (
    "no touch that presses has a known indenter, location and reading, so that there is nothing to fit: give "
    "indenter_radius_mm (on a finger) and the location for some touches at least"
)
CORRECTED_REST = (
    "the rest reading that touches share is the mean of few no-contact rows: it is corrected by what these touches show"
)
# Number of blocks of consecutive touches into which a scan is split.
BLOCKS = 40


@dataclass(frozen=True, eq=False)
class SplitData:
    """Touches of a data set, on one clock, split into training and held-out touches.

    Attributes
    ----------
    dataset : DataSet
        The data set; if it has no calibration touches, these are split off.
    table : Touches
        All rows, calibration first, minus the rest reading; touches are numbered from 0 over both tables.
    time_s, held_s : (n,) arrays
        Time of each row, and time since its touch began, in `unit`.
    unit : str
        Unit of the times.
    rest : (m,) array or None
        Rest reading that was subtracted from the rows of the calibration.
    session : (n,) int array
        Session of each row; drifts are independent between sessions. A second table is a session of its own, 1, unless
        its touches interleave in time with those of the first.
    training, held_out : (n,) bool arrays
        Rows of the touches used in fits, calibrations and choices of effects, and of the touches used in none of them.
    notes : tuple of str
        Notes on how the data set was split, and on assumptions.
    rest_source : (n,) int array
        Rest reading that was subtracted from each row and that its touch shares with others: 0 that of the calibration,
        1 that of the touches to be read; -1 where the touch has its own, or none was subtracted.
    shared_reads : (2, m) array
        Number of raw reads behind these two rest readings; 0 without one.
    chosen : (n,) bool array or None
        The training rows that the search for effects uses; None for all.
    removed : (2, m) array or None
        Errors of the two rest readings that were taken out, see `without_rest_errors`; None for none.
    unreferenced : bool
        Whether no touch to be read has references, so that none of them can be held out.
    """

    dataset: DataSet
    table: Touches
    time_s: FloatArray
    held_s: FloatArray
    unit: str
    rest: FloatArray | None
    session: IntArray
    training: BoolArray
    held_out: BoolArray
    notes: tuple[str, ...]
    rest_source: IntArray
    shared_reads: FloatArray
    chosen: BoolArray | None = None
    removed: FloatArray | None = None
    unreferenced: bool = False

    @property
    def searched(self) -> BoolArray:
        """Rows (n,) of the touches that the search for effects uses."""
        return self.training if self.chosen is None else self.chosen

    @classmethod
    def of(cls, dataset: DataSet, fold: int = 2) -> SplitData:
        """Split of a data set.

        Every second touch of each tip of ``touches.csv`` with references is fitted together with the calibration
        touches, so that fits cover all radii and the whole time; the others are held out. If too few have references,
        every fourth calibration touch of each tip is held out. Without a calibration table, every fourth touch of each
        tip of a finger is held out, on a pad every fourth block of consecutive touches: number `fold`, 0 to 3, of every
        four.

        Raises
        ------
        InputError
            No touch has the references that a calibration needs.
        """
        if dataset.calibration is None:
            return cls._of_one_table(dataset, fold)
        calibration, touches = dataset.calibration, dataset.touches
        first, second, interleaved = one_clock(calibration, touches)
        rest = calibration.rest_reading()
        parts = (calibration.baseline_corrected(), touches.baseline_corrected(rest))
        table = without_dead(joined_tables(*parts))
        body = body_of(dataset.sensor)
        known = have_references(table, body.references)
        ids, group = groups(table.touch)
        read = np.bincount(group, weights=np.arange(table.n_rows) >= calibration.n_rows, minlength=len(ids)) > 0
        held = np.zeros(len(ids), dtype=bool)
        if int((known & read).sum()) >= ENOUGH_READ:
            held[known & read] = _turns(table, known & read) % 2 == 1
            fitted = "the rest is fitted" + (" with the calibration" if (known & ~read).any() else "")
            how = f"every other touch to be read that has references is held out; {fitted}"
        elif int((known & ~read).sum()) >= ENOUGH_CALIBRATION:
            held[known & ~read] = _turns(table, known & ~read) % 4 == 2
            how = "too few touches to be read have references: every fourth calibration touch is held out"
        else:
            columns = " and ".join(name for name in body.references if getattr(table, name) is not None)
            how = TOO_FEW if (known & read).any() else NO_REFERENCES.format(columns=columns)
        if not (known & ~held).any():
            raise InputError(NOTHING_KNOWN)
        training, left_out = of_measured_load(table, (known & ~held)[group], needs_load=body.needs_load)
        unused = without_references(table, body.references, ~read)
        about = (*unused, *left_out, *remarks_on(table, training), *silent_elements(dataset, means_by_table(dataset)))
        source, reads = shared_rest(calibration, touches)
        return cls(
            dataset=dataset,
            table=table,
            time_s=np.concatenate([first.time_s, second.time_s]),
            held_s=np.concatenate([first.held_s, second.held_s]),
            unit=first.unit,
            rest=rest,
            session=((np.arange(table.n_rows) >= calibration.n_rows) & (not interleaved)).astype(np.int64),
            training=training,
            held_out=held[group],
            notes=tuple(dict.fromkeys(note for note in (*dataset.notes, how, *about, first.note, second.note) if note)),
            rest_source=source,
            shared_reads=reads,
            unreferenced=not (known & read).any(),
        )

    @classmethod
    def of_calibration(cls, dataset: DataSet) -> SplitData:
        """The calibration touches only, with none held out.

        Raises
        ------
        InputError
            No touch has the references that a calibration needs.
        """
        dataset = with_calibration(dataset)
        calibration = dataset.calibration
        assert calibration is not None
        timing = Timing.of(calibration)
        table = without_dead(joined_tables(calibration.baseline_corrected()))
        body = body_of(dataset.sensor)
        known = have_references(table, body.references)
        _, group = groups(table.touch)
        if not known.any():
            raise InputError(NOTHING_KNOWN)
        training, left_out = of_measured_load(table, known[group], needs_load=body.needs_load)
        notes = (*dataset.notes, *left_out, *remarks_on(table, training), timing.note)
        source, reads = shared_rest(calibration)
        return cls(
            dataset=dataset,
            table=table,
            time_s=timing.time_s,
            held_s=timing.held_s,
            unit=timing.unit,
            rest=calibration.rest_reading(),
            session=np.zeros(table.n_rows, dtype=np.int64),
            training=training,
            held_out=np.zeros(table.n_rows, dtype=bool),
            notes=tuple(dict.fromkeys(note for note in notes if note)),
            rest_source=source,
            shared_reads=reads,
        )

    @classmethod
    def _of_one_table(cls, dataset: DataSet, fold: int) -> SplitData:
        """Split of a data set with one table, by time."""
        whole = dataset.touches
        clock, table = Timing.of(whole), without_dead(whole.baseline_corrected())
        _, group = groups(table.touch)
        body = body_of(dataset.sensor)
        known = have_references(table, body.references)
        size = max(2, int(known.sum()) // BLOCKS) if body.scanned else 1
        held = np.zeros(len(known), dtype=bool)
        if known.sum() >= ENOUGH_CALIBRATION:
            begin = beginnings(clock.time_s, table.in_contact, group, len(known))
            turns = _rank(begin[known]) // size if body.scanned else _turns(table, known)
            held[known] = turns % 4 == fold
        training = (known & ~held)[group]
        if not training.any():
            raise InputError(NOTHING_KNOWN)
        training, left_out = of_measured_load(table, training, needs_load=body.needs_load)
        how = "every fourth touch is held out"
        if body.scanned:
            how = f"every fourth block of {size} touches that follow each other is held out"
        if not held.any():
            how = TOO_FEW
        about = (*left_out, *remarks_on(table, training), *silent_elements(dataset, means_by_table(dataset)))
        notes = (*dataset.notes, *table.notes, how, *about, clock.note)
        source, reads = shared_rest(whole)
        return cls(
            dataset=replace(dataset, calibration=whole.select(~held[group]), touches=whole.select(held[group])),
            table=table,
            time_s=clock.time_s,
            held_s=clock.held_s,
            unit=clock.unit,
            rest=whole.rest_reading(),
            session=np.zeros(table.n_rows, dtype=np.int64),
            training=training,
            held_out=held[group],
            notes=tuple(dict.fromkeys(note for note in notes if note)),
            rest_source=source,
            shared_reads=reads,
        )

    @property
    def n_held_out(self) -> int:
        """Number of held-out touches."""
        return len(np.unique(self.table.touch[self.held_out]))

    def observations(self, rows: BoolArray) -> Observations:
        """Observations of some rows; their history has all earlier touches, training and held out."""
        history = history_of(self.table, self.time_s)
        span = (float(self.time_s.min()), float(self.time_s.max()))
        return Observations.of(
            self.table.select(rows), self.time_s[rows], self.held_s[rows], self.unit, history, span, self._sessions
        )

    @property
    def _sessions(self) -> tuple[tuple[float, float], ...]:
        """First and last time of each session, in `unit`, in the order of time."""
        times = [self.time_s[self.session == each] for each in np.unique(self.session)]
        return tuple(sorted((float(time.min()), float(time.max())) for time in times))

    def thinned(self, most: int | None, seed: int) -> SplitData:
        """The split with at most `most` touches in the search, chosen at random; None for no limit."""
        ids = np.unique(self.table.touch[self.training])
        if most is None or len(ids) <= most:
            return self
        chosen = np.random.default_rng(seed).choice(ids, most, replace=False)
        note = (
            f"the search uses {most:,} of {len(ids):,} touches that are not held out, chosen at random; "
            "calibrations use all"
        )
        return replace(self, chosen=self.training & np.isin(self.table.touch, chosen), notes=(*self.notes, note))

    def source_of_touches(self, touch: IntArray) -> IntArray:
        """`rest_source` of touches (t,), by their numbers in `table`."""
        ids, first = np.unique(self.table.touch, return_index=True)
        return np.asarray(self.rest_source[first][np.searchsorted(ids, touch)])

    def rest_offsets(self, touch: IntArray) -> RestOffsets | None:
        """Offsets of touches (t,), by their numbers in `table`; None if they share no rest reading with noise."""
        source = self.source_of_touches(touch)
        reads = self._of_source(self.shared_reads, source)
        if not (np.isfinite(reads) & (reads > 0)).any():
            return None
        return RestOffsets(
            reads, np.zeros_like(reads) if self.removed is None else self._of_source(self.removed, source)
        )

    @staticmethod
    def _of_source(values: FloatArray, source: IntArray) -> FloatArray:
        """Values (2, m) by rest reading as an array (n, m) by row or touch; zero where none is shared."""
        return np.where(source[:, None] < 0, 0.0, values[np.maximum(source, 0)])

    def without_rest_errors(self, errors: FloatArray) -> SplitData:
        """The split with the errors (2, m) of shared rest readings taken out of readings and rest reading."""
        return replace(
            self,
            table=self.table.with_(readings=self.table.readings - self._of_source(errors, self.rest_source)),
            rest=None if self.rest is None else self.rest + errors[0],
            notes=(*self.notes, CORRECTED_REST),
            removed=errors,
        )

    @property
    def _own_rest(self) -> bool:
        """Whether every touch of the fits has rows without contact of its own."""
        touched, contact = self.table.touch, self.table.in_contact
        return bool(np.isin(touched[self.training & contact], touched[~contact]).all())

    def setting(self, contact: str, reference_load: float) -> Setting:
        """Setting from which effects choose their priors and probes."""
        sensor, table = self.dataset.sensor, self.table.select(self.training)
        places = [axis for axis in (getattr(table, name) for name in sensor.body.location_columns) if axis is not None]
        contact_rows = self.table.in_contact
        return Setting(
            n_elements=sensor.n_elements,
            place_range=tuple(sensor.body.extent(axis) for axis in places),
            reference_load=reference_load,
            load_unit=sensor.body.load_unit,
            has_edges=bool((table.indenter_radius_mm == 0).any()),
            hold_s=float(self.held_s[contact_rows].max(initial=0.0)),
            gap_s=typical_gap(self.time_s[contact_rows], self.held_s[contact_rows]),
            span_s=float(np.ptp(self.time_s)),
            time_unit=self.unit,
            loads_vary=loads_vary(table.load[table.in_contact]),
            own_rest=self._own_rest,
            any_rest=not contact_rows.all(),
            **body_of(sensor).setting(sensor.body, contact),
        )


def joined_tables(*tables: Touches) -> Touches:
    """Rows of all tables, touches numbered from 0; columns that a table does not have are NaN."""

    def numbers(name: str) -> FloatArray | None:
        parts = [getattr(table, name) for table in tables]
        if all(part is None for part in parts):
            return None
        by_element = name in ("readings_sd", "rest_reads")
        shapes = [table.readings.shape if by_element else (table.n_rows,) for table in tables]
        return np.concatenate(
            [np.full(s, np.nan) if part is None else part for s, part in zip(shapes, parts, strict=True)]
        )

    touch, start = [], 0
    for table in tables:
        ids, group = groups(table.touch)
        touch.append(group + start)
        start += len(ids)
    names = ("time_s", "indenter_radius_mm", "angle_deg", "x_mm", "y_mm", "load", "depth_mm", "contact")
    return replace(
        tables[0],
        touch=np.concatenate(touch),
        sample=np.concatenate([table.sample for table in tables]),
        readings=np.concatenate([table.readings for table in tables]),
        extra={},
        notes=tuple(dict.fromkeys(note for table in tables for note in table.notes)),
        **{name: numbers(name) for name in (*names, "readings_sd", "reads", "rest_reads")},  # type: ignore[arg-type]  # named arrays
    )


def without_dead(table: Touches) -> Touches:
    """The table without the readings of elements that are constant over all rows: they carry no information."""
    return table.with_(readings=np.where(table.usable_elements, table.readings, np.nan))


def _rank(times: FloatArray) -> IntArray:
    """Place of each of k times in their order, (k,)."""
    return np.asarray(np.argsort(np.argsort(times, kind="stable"), kind="stable"))


def _turns(table: Touches, chosen: BoolArray) -> IntArray:
    """Numbers by which the k `chosen` touches of (t,) are held out in turn, (k,): consecutive within each tip.

    Numbers of all touches would hold out one tip only where tips alternate. Those of a tip begin with the number of its
    first touch, so that touches of one tip after the other have their number in the table.
    """
    ids, group = groups(table.touch)
    tip_mm = first_of(np.where(table.in_contact, table.indenter_radius_mm, np.nan), group, len(ids))
    _, first, tip = np.unique(tip_mm[chosen], return_index=True, return_inverse=True)
    return np.asarray(first[tip] + numbered(tip))
