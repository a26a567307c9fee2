"""Description of the data of a report: content and source."""

from __future__ import annotations

from typing import Any

from bayestouch.checking.tables import table_facts, touches_by_indenter
from bayestouch.data.copies import copies
from bayestouch.data.sensor import Sensor
from bayestouch.reporting.evidence import Evidence


def about_data(evidence: Evidence) -> dict[str, Any]:
    """Numbers of ``report.json`` about the data: sensor, source, content of the touch tables."""
    sensor, dataset = evidence.sensor, evidence.dataset
    tables = {"to calibrate with": dataset.calibration, "to be read": dataset.touches}
    copied = 0 if dataset.calibration is None else len(copies(dataset.touches, dataset.calibration))
    return {
        "name": sensor.name,
        "body": sensor.body.kind,
        "folder": None if dataset.path is None else dataset.path.resolve().name,
        "simulated": evidence.simulated,
        "sensor": _sensor(sensor),
        "source": [{"key": key, "text": str(text)} for key, text in sensor.source.items()],
        "tables": [table_facts(use, touches) for use, touches in tables.items() if touches is not None],
        "touches_by_indenter": touches_by_indenter(dataset.calibration, dataset.touches),
        "copied_percent": 100 * copied / max(dataset.touches.n_touches, 1),
        "without_reading": evidence.without_reading,
        "notes": _notes(evidence),
    }


def _sensor(sensor: Sensor) -> list[dict[str, Any]]:
    """Rows of quantity, value and unit; the value is None if it is not stated."""
    body = sensor.body
    rows: list[tuple[str, Any, str]] = [
        ("elements", body.n_elements, ""),
        *body.as_built(),
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
    # Of a finger, the calibration adds to a note of the tables what it means there: the longer one is enough.
    longer = [note for note in notes if not any(other.startswith(f"{note};") for other in notes)]
    return list(dict.fromkeys(_sentence(note) for note in longer if note.strip()))


def _sentence(note: str) -> str:
    """Note with a capital letter and a full stop; a file name at its beginning is not changed."""
    first = note.split(maxsplit=1)[0]
    start = note if "." in first.rstrip(".:,") else note[:1].upper() + note[1:]
    return start.rstrip(".") + "."
