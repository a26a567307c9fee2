"""Contents of touch tables: numbers of touches, ranges, and indenters by name."""

from __future__ import annotations

from typing import Any

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.data.grouping import first_of, groups
from bayestouch.data.touches import Touches


def table_facts(use: str, touches: Touches) -> dict[str, Any]:
    """Return numbers of touches, rows and missing readings of a table, and ranges of location, load and depth."""
    contact = touches.in_contact
    load = touches.load[contact]
    return {
        "use": use,
        "touches": len(np.unique(touches.touch[contact])),
        "rows": touches.n_rows,
        "rows_without_contact": int((~contact).sum()),
        "missing_readings": int(np.isnan(touches.readings).sum()),
        "locations": [
            {"name": name, "unit": unit, **_range(values[contact])}
            for name, unit, values in (
                ("θ", "degree", touches.angle_deg),
                ("x", "mm", touches.x_mm),
                ("y", "mm", touches.y_mm),
            )
            if values is not None
        ],
        "load": _range(load),
        "depth": _range(touches.depth_mm[contact]),
    }


def _range(values: Any) -> dict[str, Any]:
    some = values[np.isfinite(values)]
    if not some.size:
        return {"lowest": None, "highest": None}
    return {"lowest": float(some.min()), "highest": float(some.max())}


def touches_by_indenter(calibration: Touches | None, touches: Touches) -> list[dict[str, Any]]:
    """Return the number of touches with each indenter, in the calibration table and in the touches to be read."""
    counts: dict[float, list[int]] = {}
    unknown = [0, 0]
    for column, table in enumerate((calibration, touches)):
        if table is None:
            continue
        rows = table.in_contact
        ids, group = groups(table.touch[rows])
        radius = first_of(table.indenter_radius_mm[rows], group, len(ids))
        for value in known_indenters(radius):
            counts.setdefault(float(value), [0, 0])[column] = int((radius == value).sum())
        if np.isnan(radius).any():
            unknown[column] = int(np.isnan(radius).sum())
    named = [(indenter_name(value), counts[value]) for value in sorted(counts)]
    if any(unknown):
        named.append((indenter_name(float("nan")), unknown))
    return [{"indenter": name, "to_calibrate": both[0], "to_be_read": both[1]} for name, both in named]


def indenter_name(radius_mm: float) -> str:
    """Return the name of an indenter from its radius r_c in mm."""
    if np.isnan(radius_mm):
        return "unknown"
    if radius_mm == 0:
        return "knife edge"
    return "flat" if np.isinf(radius_mm) else f"{radius_mm:.4g} mm"


def known_indenters(radius_mm: FloatArray) -> FloatArray:
    """Return the distinct reference radii, ascending: 0 a knife edge, inf a flat."""
    return np.unique(radius_mm[~np.isnan(radius_mm)])
