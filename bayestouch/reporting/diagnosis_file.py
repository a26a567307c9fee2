"""Reader of a diagnosis.json of unknown origin: everything that a report shows of it is checked."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bayestouch.data.files import reading
from bayestouch.diagnosis.outcome import VERDICTS
from bayestouch.errors import InputError, shown

if TYPE_CHECKING:
    from jsonschema import ValidationError

#: Limits of the file sizes. Usual files have tens of kB, and figures at most a MB; 2 MB take some seconds to check.
MAX_BYTES, MAX_FIGURE_BYTES = 2_000_000, 50_000_000
_WHAT = "the diagnosis.json of `bayestouch diagnose`"
# Numbers beyond this limit are not plausible as errors, scores or values; usual lists have tens of entries.
_LARGEST, MOST_ENTRIES = 1e30, 10_000

_Schema = dict[str, Any]


def _one_of(expected: str, kind: str, *others: str, **limits: Any) -> _Schema:
    """Schema of a value of one of these types; `expected` describes it in error messages."""
    return {"description": expected, "type": [kind, *others], **limits}


def _list_of(each: _Schema, expected: str = "a list", **limits: Any) -> _Schema:
    return _one_of(expected, "array", **{"maxItems": MOST_ENTRIES, "items": each, **limits})


def _object(rest: _Schema | bool = True, *null: str, later: Mapping[str, _Schema] = {}, **required: _Schema) -> _Schema:
    """Schema of an object with keys that are required, optional ones (`later`), and a schema for all other values."""
    counted = _one_of("an object", "object", *null, maxProperties=MOST_ENTRIES)
    return {**counted, "required": [*required], "properties": {**required, **later}, "additionalProperties": rest}


_TEXT = _one_of("text", "string")
_NUMBER = _one_of("a number", "number", exclusiveMinimum=-_LARGEST, exclusiveMaximum=_LARGEST)
_PERHAPS = {**_NUMBER, "description": "a number or null", "type": ["number", "null"]}
_HASH = _one_of("a hash or null", "string", "null", maxLength=64)
_PROBABILITY = _one_of("a probability", "number", minimum=0, maximum=1)
_FLAG = _one_of("true or false", "boolean")
_DRAWS = _one_of("a number of draws, at least 1, or null", "integer", "null", minimum=1)
_NAMES = _list_of(_TEXT, "a list of at least one name", minItems=1)
_PAIR = _list_of(_TEXT, "a list of two names", minItems=2, maxItems=2)
_ERRORS = _object(_PERHAPS, prediction_error_percent_peak=_PERHAPS)
_LIMITS = _object(low=_PERHAPS, high=_PERHAPS, expected=_NUMBER)
_EFFECT = _object(
    name=_TEXT,
    summary=_TEXT,
    parameters=_object(_object(mean=_NUMBER, sd=_PERHAPS, unit=_TEXT)),
    indistinguishable_from=_list_of(_TEXT),
)
#: JSON Schema (draft 2020-12) of what a report reads from the file.
SCHEMA = _object(
    verdict=_one_of(" or ".join(sorted(VERDICTS)), "string", enum=sorted(VERDICTS)),
    data=_object(
        elements=_NUMBER,
        held_out_touches=_NUMBER,
        later={
            "elements_left_out": _list_of(_TEXT),
            "unreferenced": _FLAG,
            "fingerprints": _object(sensor=_HASH, calibration=_HASH, touches=_HASH),
        },
    ),
    before=_ERRORS,
    after=_ERRORS,
    noise_floor_percent_peak=_PERHAPS,
    effects=_list_of(_EFFECT),
    candidates=_list_of(
        _object(name=_TEXT, stage=_TEXT, score_z=_PERHAPS, elpd_gain=_PERHAPS, explained_fraction=_PERHAPS)
    ),
    unexplained=_object(
        fraction=_NUMBER,
        where=_TEXT,
        later={"p_value": _PERHAPS, "test": _object(True, "null", later={"ratio": _PERHAPS, "low": _PERHAPS})},
    ),
    correction=_object(True, "null", before=_object(_PERHAPS)),
    measure=_object(True, "null", advice=_TEXT),
    figures=_list_of(_object(format=_TEXT, name=_TEXT, section=_TEXT, title=_TEXT, caption=_TEXT, alt=_TEXT)),
    later={
        "after_against_stated": _ERRORS,
        "change_against_stated_se": _object(_PERHAPS),
        "lack_of_fit_limits": _object(before=_LIMITS, after=_LIMITS),
        "notes": _list_of(_TEXT),
        "draws": _object(_PERHAPS, later={"kept": _DRAWS}),
        "causes": _list_of(_object(names=_NAMES, probability=_PROBABILITY)),
        "in_place": _object(_object(elpd_gain=_NUMBER, elpd_gain_se=_NUMBER), "null"),
        "not_distinguishable": _list_of(_PAIR),
        "calibration_after": _object(effects=_list_of(_TEXT), correction=_FLAG),
        "not_used": _list_of(
            _object(
                effects=_list_of(_TEXT),
                correction=_FLAG,
                references_corrected=_FLAG,
                worse=_object(_object(before=_NUMBER, after=_NUMBER)),
            )
        ),
    },
)
# What is not used is what the calibration after is without.
SCHEMA["dependentRequired"] = {"not_used": ["calibration_after"]}


def read_diagnosis(file: Path) -> dict[str, Any]:
    """Numbers of a diagnosis that `bayestouch diagnose` wrote.

    Raises
    ------
    InputError
        If the file is missing, too large, not JSON, or not as a report expects it (the message names the place).
    """
    with reading(file) as path:
        if path.stat().st_size > MAX_BYTES:
            raise InputError(f"expected {_WHAT}, of at most {MAX_BYTES} bytes", file=file)
        data = path.read_bytes()
    try:
        numbers = json.loads(data.decode("utf-8"))
        # The report stores it again as JSON in UTF-8, without infinite numbers.
        json.dumps(numbers, ensure_ascii=False, allow_nan=False).encode("utf-8")
    except (ValueError, RecursionError):
        raise InputError(f"expected {_WHAT}, got no JSON", file=file) from None
    from jsonschema import Draft202012Validator

    # Only the first error is reported.
    if wrong := next(Draft202012Validator(SCHEMA).iter_errors(numbers), None):
        raise InputError(f"expected {_WHAT}: expected {_expected(wrong)}", file=file)
    checked: dict[str, Any] = numbers
    return checked


def read_figure(folder: Path, name: str, form: str) -> bytes:
    """Figure in the folder of the diagnosis ("svg" or "png"), never from another folder.

    Raises
    ------
    InputError
        If it is missing or too large, or its name is not valid.
    """
    if not re.fullmatch(r"[\w-]{1,99}", name, re.ASCII):  # for example effect-1-crosstalk
        raise InputError(f"expected a figure's name of letters and hyphens, got {shown(name)}", file=folder)
    with reading(folder / "figures" / f"{name}.{form}") as file:
        if file.stat().st_size > MAX_FIGURE_BYTES:
            raise InputError(f"expected a figure of at most {MAX_FIGURE_BYTES} bytes", file=file)
        return file.read_bytes()


def _expected(wrong: ValidationError) -> str:
    """Text of what was expected, where, and what was found."""
    found, place = wrong.instance, wrong.json_path.removeprefix("$").lstrip(".") or "the top"
    if wrong.validator in ("required", "dependentRequired"):
        wanted = wrong.validator_value
        if isinstance(wanted, dict):
            wanted = [each for key, those in wanted.items() if key in found for each in those]
        missing = next(key for key in wanted if key not in found)
        return f"an object with {shown(missing)} at {shown(place)}, got {shown(str(sorted(found)))}"
    if wrong.validator in ("maxItems", "maxProperties") and wrong.validator_value == MOST_ENTRIES:
        return f"at most {MOST_ENTRIES} entries at {shown(place)}, got {len(found)}"
    return f"{wrong.schema['description']} at {shown(place)}, got {shown(str(found))}"
