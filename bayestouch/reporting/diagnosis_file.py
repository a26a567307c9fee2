"""diagnosis.json from anyone: nothing that a report tells of it is taken on trust."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

from bayestouch.data.files import reading
from bayestouch.diagnosis.outcome import VERDICTS
from bayestouch.errors import InputError, shown

#: Ours have some tens of kB, and figures a MB at most.
MAX_BYTES, MAX_FIGURE_BYTES = 16_000_000, 50_000_000
_WHAT = "the diagnosis.json of `bayestouch diagnose`"
# Beyond this no number is an error, a score or a value of an effect.
_LARGEST = 1e30

_NUMBER, _PERHAPS, _TEXT = "a number", "a number or null", "text"
_FIGURE = dict.fromkeys(("format", "name", "section", "title", "caption", "alt"), _TEXT)
# What a report reads. A list holds any number of what it names; a key ... stands for all; a set, a choice of texts.
_SHAPE: dict[Any, Any] = {
    "verdict": set(VERDICTS),
    "data": {"elements": _NUMBER, "held_out_touches": _NUMBER},
    "before": {...: _PERHAPS, "prediction_error_percent_peak": _PERHAPS},
    "after": {...: _PERHAPS, "prediction_error_percent_peak": _PERHAPS},
    "noise_floor_percent_peak": _PERHAPS,
    "effects": [
        {
            "name": _TEXT,
            "summary": _TEXT,
            "parameters": {...: {"mean": _NUMBER, "sd": _PERHAPS, "unit": _TEXT}},
            "indistinguishable_from": [_TEXT],
        }
    ],
    "candidates": [
        {
            "name": _TEXT,
            "stage": _TEXT,
            "score_z": _PERHAPS,
            "elpd_gain": _PERHAPS,
            "explained_fraction": _PERHAPS,
        }
    ],
    "unexplained": {"fraction": _NUMBER, "where": _TEXT},
    "correction": (None, {"before": {...: _PERHAPS}}),
    "measure": (None, {"advice": _TEXT}),
    "figures": [_FIGURE],
}
_LIMITS = {"low": _PERHAPS, "high": _PERHAPS, "expected": _NUMBER}
# The same of keys that a file may do without.
_LATER: dict[Any, Any] = {
    "after_against_stated": {...: _PERHAPS, "prediction_error_percent_peak": _PERHAPS},
    "change_against_stated_se": {...: _PERHAPS},
    "lack_of_fit_limits": {"before": _LIMITS, "after": _LIMITS},
    "notes": [_TEXT],
}


def read_diagnosis(file: Path) -> dict[str, Any]:
    """Numbers of a diagnosis as `bayestouch diagnose` wrote them.

    Raises
    ------
    InputError
        The file is missing, too large, no JSON, or not what a report expects, with the place that is not.
    """
    with reading(file) as path:
        if path.stat().st_size > MAX_BYTES:
            raise InputError(f"expected {_WHAT}, of at most {MAX_BYTES} bytes", file=file)
        data = path.read_bytes()
    try:
        numbers = json.loads(data.decode("utf-8"))
        # The report holds it again: as JSON without infinity, in UTF-8.
        json.dumps(numbers, ensure_ascii=False, allow_nan=False).encode("utf-8")
    except (ValueError, RecursionError):
        raise InputError(f"expected {_WHAT}, got no JSON", file=file) from None
    try:
        later = {key: shape for key, shape in _LATER.items() if isinstance(numbers, dict) and key in numbers}
        _check(numbers, _SHAPE | later, "")
    except InputError as error:
        raise InputError(f"expected {_WHAT}: {error.message}", file=file) from None
    checked: dict[str, Any] = numbers
    return checked


def read_figure(folder: Path, name: str, form: str) -> bytes:
    """A figure beside the diagnosis, "svg" or "png"; never one of another folder.

    Raises
    ------
    InputError
        It is missing or too large, or its name is none.
    """
    if not re.fullmatch(r"[\w-]{1,99}", name, re.ASCII):  # such as effect-1-crosstalk
        raise InputError(f"expected a figure's name of letters and hyphens, got {shown(name)}", file=folder)
    with reading(folder / "figures" / f"{name}.{form}") as file:
        if file.stat().st_size > MAX_FIGURE_BYTES:
            raise InputError(f"expected a figure of at most {MAX_FIGURE_BYTES} bytes", file=file)
        return file.read_bytes()


def _check(value: Any, shape: Any, place: str) -> None:
    """Refuse a value that is not of a shape, with its place."""
    match shape:
        case dict():
            _wanted(isinstance(value, dict), "an object", value, place)
            for key in (key for key in shape if key is not ...):
                _wanted(key in value, f"an object with {shown(key)}", sorted(value), place)
            for key, each in value.items():
                if (wanted := shape.get(key, shape.get(...))) is not None:
                    _check(each, wanted, f"{place}.{key}")
        case list():
            _wanted(isinstance(value, list), "a list", value, place)
            for number, each in enumerate(value):
                _check(each, shape[0], f"{place}[{number}]")
        case tuple():
            if value is not None:
                _check(value, shape[1], place)
        case set():
            _wanted(isinstance(value, str) and value in shape, " or ".join(sorted(shape)), value, place)
        case "text":
            _wanted(isinstance(value, str), shape, value, place)
        case _:
            number = isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < _LARGEST
            _wanted(number or (shape == _PERHAPS and value is None), shape, value, place)


def _wanted(holds: bool, expected: str, value: Any, place: str) -> None:
    if not holds:
        raise InputError(f"expected {expected} at {shown(place.lstrip('.') or 'the top')}, got {shown(str(value))}")
