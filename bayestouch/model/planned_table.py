"""Tables of touches that are planned: what they state, and what the calibration says where they do not."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.data.arrays import read_once
from bayestouch.data.averages import TouchMeans
from bayestouch.data.touches import Touches, touches_from
from bayestouch.errors import InputError
from bayestouch.model.body import body_of
from bayestouch.results.data import TouchRows
from bayestouch.results.objects import Calibration

# Columns of places, of all bodies.
PLACES = ("angle_deg", "x_mm", "y_mm")


def planned_table(table: Touches, calibration: Calibration) -> TouchMeans:
    """Planned touches, one row each; the readings of the table are not used.

    The number of samples of a touch is that of its rows, each with its `reads`. Their means have the noise of a rest
    reading like that of the calibration touches, if these have rest readings of their own. Loads are as the force
    sensor reads them: with each sample, or as often in a touch as in those of the calibration. A load that is not
    stated is the mean load of the calibration, or 1 if none was measured.
    Readings are zero, and NaN for an element without readings in the calibration.

    Raises
    ------
    InputError
        The table has no touch in contact, touches of another sensor, a touch without location, or a load below zero.
    """
    body, rows = calibration.sensor.body, calibration.rows
    if table.n_elements != calibration.sensor.n_elements:
        raise InputError(f"expected touches of {calibration.sensor.n_elements} elements, got {table.n_elements}")
    for column in body.location_columns:
        values = getattr(table, column)
        if values is None or np.isnan(values).any():
            raise InputError("a planned touch needs its location", column=column)
    if (table.load < 0).any():
        raise InputError("expected loads above zero", column=body.load_column)
    alive = rows.responds
    readings = np.tile(np.where(alive, 0.0, np.nan), (table.n_rows, 1))
    means = table.with_(readings=readings, readings_sd=None).averaged()
    if means.n_touches == 0:
        raise InputError("no touch to choose from: give touches in contact")
    others = dict.fromkeys(set(PLACES) - set(body.location_columns))
    usual = usual_load(calibration)
    load = np.where(np.isnan(means.load), 1.0 if np.isnan(usual) else usual, means.load)
    rest_reads = np.tile(_own_rest_reads(rows), (means.n_touches, 1))
    planned = one_row_each(means, touch=np.arange(means.n_touches), load=load, rest_reads=rest_reads, **others)
    out, load_reads = planned.averaged(), rows.usual_load_reads
    return out if load_reads is None else replace(out, load_reads=np.minimum(load_reads, out.samples))


def _own_rest_reads(rows: TouchRows) -> FloatArray:
    """Number of raw reads behind the rest reading of a touch of its own, (m,): median; NaN where touches have none.

    n samples minus a rest reading of k reads have the noise of c reads, 1/c = 1/n + 1/k.
    """
    read = rows.counts > 0
    share = np.where(read, 1 / read_once(rows.counts) - 1 / read_once(rows.samples)[:, None], np.nan)
    out = np.full(share.shape[1], np.nan)
    alive = read.any(axis=0)
    typical = np.nanmedian(share[:, alive], axis=0)
    out[alive] = np.divide(1.0, typical, out=np.full(len(typical), np.nan), where=typical > 0)
    return out


def usual_load(calibration: Calibration) -> float:
    """Mean load of the calibration touches as the force sensor reads it, N/m or N; NaN if none was measured."""
    load = body_of(calibration.sensor).loads_as_read(calibration)
    return float(np.nanmean(load)) if np.isfinite(load).any() else float("nan")


def one_row_each(means: TouchMeans, **changed: Any) -> Touches:
    """Table with one row for each touch; `changed` columns of `Touches` replace those of the means."""
    columns: dict[str, Any] = {
        "touch": means.touch,
        "readings": means.readings,
        "time_s": means.time_s,
        "indenter_radius_mm": means.indenter_radius_mm,
        "load": means.load,
        "reads": means.samples,
        **{name: getattr(means, name) for name in PLACES},
    }
    return touches_from(contact=1.0, **(columns | changed))
