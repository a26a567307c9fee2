"""Properties of a data set, and advice based on them."""

from __future__ import annotations

from typing import Any

import numpy as np

from bayestouch.checking.lacking import lacking
from bayestouch.checking.tables import table_facts, touches_by_indenter
from bayestouch.data.averages import TouchMeans
from bayestouch.data.dataset import DataSet
from bayestouch.data.json_values import strict
from bayestouch.data.touches import Touches
from bayestouch.model.silent import means_by_table


def dataset_facts(dataset: DataSet) -> dict[str, Any]:
    """Return all results that `bayestouch check` shows."""
    sensor, body = dataset.sensor, dataset.sensor.body
    tables = {"calibration": dataset.calibration, "touches": dataset.touches}
    means = means_by_table(dataset)
    facts: dict[str, Any] = {
        "sensor": {
            "name": sensor.name,
            "body": body.kind,
            "elements": body.n_elements,
            "reading_unit": sensor.reading_unit or None,
            "load_unit": body.load_unit,
        },
        "tables": [_table(name, table) for name, table in tables.items() if table is not None],
        "indenters": touches_by_indenter(dataset.calibration, dataset.touches),
        "elements": _elements(means),
        "advice": list(lacking(dataset, means)),
    }
    return dict(strict(facts))


def _table(name: str, touches: Touches) -> dict[str, Any]:
    facts = table_facts(name, touches)
    _, samples = np.unique(touches.touch[touches.in_contact], return_counts=True)
    facts["samples_per_touch"] = {
        "lowest": int(samples.min()) if samples.size else None,
        "highest": int(samples.max()) if samples.size else None,
    }
    return facts


def _elements(means: dict[str, TouchMeans]) -> list[dict[str, Any]]:
    """Peak (largest absolute mean reading without the no-contact reading) and noise of one reading, by element."""
    readings = np.concatenate([table.readings for table in means.values()])
    some = np.isfinite(readings)
    largest = np.max(np.where(some, np.abs(readings), -np.inf), axis=0, initial=-np.inf)
    peak = np.where(some.any(axis=0), largest, np.nan)
    # noise from the table with the most repeated readings
    noisiest = max(means.values(), key=lambda table: float(np.sum(table.pure_error_dof)))
    noise = np.sqrt(noisiest.pure_error_variance)
    return [
        {"element": f"e{e + 1:02d}", "peak": peak[e], "noise": noise[e], "missing": int((~some[:, e]).sum())}
        for e in range(readings.shape[1])
    ]
