"""The data of a report: what they are and where they come from."""

from __future__ import annotations

from typing import Any

import numpy as np

from bayestouch.checking.tables import table_facts, touches_by_indenter
from bayestouch.data.sensor import Finger, Sensor
from bayestouch.reporting.evidence import Evidence


def about_data(evidence: Evidence) -> dict[str, Any]:
    """Sensor, source and contents of the touch tables."""
    sensor, dataset = evidence.sensor, evidence.dataset
    tables = {"to calibrate with": dataset.calibration, "to be read": dataset.touches}
    return {
        "name": sensor.name,
        "body": "finger" if evidence.is_finger else "pad",
        "folder": None if dataset.path is None else dataset.path.resolve().name,
        "simulated": evidence.simulated,
        "sensor": _sensor(sensor),
        "source": [{"key": key, "text": str(text)} for key, text in sensor.source.items()],
        "tables": [table_facts(use, touches) for use, touches in tables.items() if touches is not None],
        "touches_by_indenter": touches_by_indenter(dataset.calibration, dataset.touches),
        "notes": _notes(evidence),
    }


def _sensor(sensor: Sensor) -> list[dict[str, Any]]:
    """Rows of quantity, value, unit; value None where not stated."""
    body = sensor.body
    rows: list[tuple[str, Any, str]] = [("elements", body.n_elements, "")]
    if isinstance(body, Finger):
        angles = np.sort(body.element_angles_deg)
        pitch = float(np.median(np.diff(angles))) if len(angles) > 1 else None
        arc = None if pitch is None else round(float(np.radians(pitch)) * body.outer_radius_mm, 3)
        rows += [
            ("core radius r_a", body.core_radius_mm, "mm"),
            ("sensing radius r_s, design", body.sensing_radius_mm, "mm"),
            ("outer radius r_b", body.outer_radius_mm, "mm"),
            ("angle between neighbouring elements", pitch, "degree"),
            ("the same along the surface", arc, "mm"),
        ]
    else:
        rows += [("thickness", body.thickness_mm, "mm"), ("depth of the elements", body.depth_mm, "mm")]
        for axis, places in (("x", body.element_x_mm), ("y", body.element_y_mm)):
            if places is not None:
                rows += [(f"elements from {axis} =", min(places), "mm"), (f"to {axis} =", max(places), "mm")]
    rows += [
        ("shear modulus μ, nominal", sensor.rubber.shear_modulus_MPa, "MPa"),
        ("Poisson's ratio σ, nominal", sensor.rubber.poisson_ratio, ""),
        ("noise of the force sensor", sensor.force_noise_sd, body.load_unit),
    ]
    text = [
        ("quantity read", sensor.reading_quantity or None, ""),
        ("unit of the readings", sensor.reading_unit or None, ""),
    ]
    return [{"quantity": name, "value": value, "unit": unit} for name, value, unit in [*rows, *text]]


def _notes(evidence: Evidence) -> list[str]:
    notes = (*evidence.dataset.notes, *evidence.calibration.notes, *evidence.posteriors.notes)
    return list(dict.fromkeys(_sentence(note) for note in notes if note.strip()))


def _sentence(note: str) -> str:
    """The note with a capital and a full stop, whoever wrote it; a file's name keeps its letters."""
    first = note.split(maxsplit=1)[0]
    start = note if "." in first.rstrip(".:,") else note[:1].upper() + note[1:]
    return start.rstrip(".") + "."
