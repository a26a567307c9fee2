"""Elements that read touches near them at first, and nothing of later ones."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.data.averages import TouchMeans
from bayestouch.data.dataset import DataSet
from bayestouch.data.touches import Touches
from bayestouch.model.body import body_of
from bayestouch.model.misplaced import LIGHT, element_distances
from bayestouch.model.timing import Timing, one_clock

# Fewest touches near an element before and after: chance, or an odd touch, has no part in as many.
ENOUGH = 5
# An element responds to a touch if it reads this share of what it reads most for the same load, and it reads nothing
# below the smaller share. A flat is read half as much as an edge; gains that change with the load change less.
RESPONDS, NOTHING = 0.25, 0.1
# An element responds up to the distance within which it read this share of the touches before. Later touches count up
# to a part of that distance, so that an element that is off its stated place is not silent.
SEEN, PART = 0.9, 0.7
# Name of each table in a sentence.
WHICH = {"calibration": "calibration", "touches": "touches to be read"}


def means_by_table(dataset: DataSet) -> dict[str, TouchMeans]:
    """Mean readings of the touches of each table, by its name, without the rest reading.

    As `infer` does, a table without readings at rest has the rest reading of the calibration.
    """
    rest = None if dataset.calibration is None else dataset.calibration.rest_reading()
    return {name: table.baseline_corrected(rest).averaged() for name, table in _tables(dataset).items()}


def silent_elements(dataset: DataSet, by_table: Mapping[str, TouchMeans]) -> tuple[str, ...]:
    """A line for each element that reads nothing from some touch on, although it read touches as near as those before.

    Touches are in the order of time, or of the tables without good times. Those with a measured load and a location
    count, and of them the ones near the element: of others it rightly reads nothing.

    Parameters
    ----------
    dataset : DataSet
        The data set.
    by_table : mapping
        Its `means_by_table`.
    """
    tables = {name: table for name, table in _tables(dataset).items() if table.in_contact.any()}
    if not tables:
        return ()
    means = [by_table[name] for name in tables]
    load = np.concatenate([each.load for each in means])
    pressed = load > 0
    pressed &= load > LIGHT * load[pressed].mean() if pressed.any() else pressed
    read, raw = (
        np.abs(np.concatenate(values)) / np.where(pressed, load, np.nan)[:, None]
        for values in ([each.readings for each in means], [_first_rows(each).readings for each in tables.values()])
    )
    distance = _distances(dataset, means)
    order = np.argsort(np.concatenate(_beginnings(list(tables.values()))), kind="stable")
    several = len(tables) > 1
    label = [
        f"{touch} of the {WHICH[name]}" if several else f"{touch}"
        for name, each in zip(tables, means, strict=True)
        for touch in each.touch
    ]
    out = []
    for e, near in enumerate(distance):
        known = order[np.isfinite(read[order, e]) & np.isfinite(near[order])]
        # With a rest reading of the whole table, the readings of an element that is disconnected are zero before it
        # only.
        least = np.fmin(read[known, e], raw[known, e])
        silent = known[silent_touches(near[known], read[known, e], least)]
        if len(silent):
            out.append(
                f"e{e + 1:02d} reads nothing from touch {label[silent[0]]} on ({len(silent)} touches near it), and "
                "read touches as near before: was it disconnected?; leave its readings empty from there on"
            )
    return tuple(out)


def silent_touches(distance: FloatArray, per_load: FloatArray, least: FloatArray) -> IntArray:
    """Indices of the touches at the end that an element should read and does not; empty if it reads one of them.

    Parameters
    ----------
    distance : (t,) array
        Distance of each touch from the element, in the order of time.
    per_load : (t,) array
        Absolute reading per load.
    least : (t,) array
        The same, or less where the reading may be zero without the rest reading.
    """
    none = np.zeros(0, dtype=np.int64)
    if len(distance) < 2 * ENOUGH:
        return none
    # So that a few odd touches have no part in it.
    most = np.sort(per_load)[-ENOUGH]
    read = np.flatnonzero(least >= NOTHING * most)
    start = int(read[-1]) + 1 if len(read) else 0
    nearest = np.argsort(distance[:start], kind="stable")
    share = np.cumsum(per_load[nearest] > RESPONDS * most) / np.arange(1, start + 1)
    within = np.flatnonzero(share >= SEEN)
    if not len(within) or within[-1] + 1 < ENOUGH:
        return none
    late = start + np.flatnonzero(distance[start:] <= PART * distance[nearest[within[-1]]])
    return late if len(late) >= ENOUGH else none


def _tables(dataset: DataSet) -> dict[str, Touches]:
    both = {"calibration": dataset.calibration, "touches": dataset.touches}
    return {name: table for name, table in both.items() if table is not None}


def _first_rows(table: Touches) -> Touches:
    """The first row in contact of each touch, in the order of the means."""
    rows = np.flatnonzero(table.in_contact)
    _, first = np.unique(table.touch[rows], return_index=True)
    return table.select(rows[np.sort(first)])


def _beginnings(tables: list[Touches]) -> list[FloatArray]:
    """Time of the first row in contact of each touch, (t,), by table; all on one clock."""
    clocks = one_clock(*tables)[:2] if len(tables) > 1 else (Timing.of(tables[0]),)
    timed = (table.with_(time_s=clock.time_s) for table, clock in zip(tables, clocks, strict=True))
    return [_first_rows(each).time_s for each in timed]


def _distances(dataset: DataSet, means: list[TouchMeans]) -> FloatArray:
    """Distances (m, t) of touches from elements; NaN without a location."""
    body = dataset.sensor.body
    setting = body_of(dataset.sensor).setting(body, body.default_contact)
    places = np.stack(setting["element_place"], axis=1)
    columns = [[getattr(each, name) for name in body.location_columns] for each in means]
    located = [
        np.stack([np.full(each.n_touches, np.nan) if axis is None else axis for axis in axes], axis=1)
        for each, axes in zip(means, columns, strict=True)
    ]
    return element_distances(places, np.concatenate(located), setting["finger"])
