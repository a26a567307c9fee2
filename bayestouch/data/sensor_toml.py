"""Reading and writing of `sensor.toml`."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import tomli_w

from bayestouch.data.geometry import BODIES, geometries
from bayestouch.data.sensor import Rubber, Sensor
from bayestouch.data.toml_text import read_toml_text, tables_from_toml
from bayestouch.errors import InputError, misspelt, nearest, shown

_RUBBER = ("shear_modulus_MPa", "poisson_ratio")
_READINGS = ("unit", "quantity")


def read_sensor(path: str | Path) -> Sensor:
    """Return the sensor that a `sensor.toml` describes.

    Parameters
    ----------
    path : str or Path
        The file. A sensor without a name gets the name of its folder.

    Raises
    ------
    InputError
        The file is missing or not TOML, or a value is missing, of the wrong type or out of range.
    """
    text, notes = read_toml_text(path)
    file = Path(path)
    sensor = sensor_from_toml(text, file=file, default_name=file.resolve().parent.name)
    return replace(sensor, notes=(*notes, *sensor.notes))


def sensor_from_toml(text: str, *, file: str | Path = "sensor.toml", default_name: str = "sensor") -> Sensor:
    """Return the sensor that the text of a `sensor.toml` describes; `file` is its name in error messages.

    Raises
    ------
    InputError
        As `read_sensor`, with the line number of the wrong value if it can be found.
    """
    tables = tables_from_toml(text, file)
    try:
        return _sensor(tables, default_name, Path(file).name)
    except InputError as error:
        row = _line_of(text, error.column)
        raise InputError(error.message, file=file, row=row, column=error.column) from None


def sensor_to_toml(sensor: Sensor) -> str:
    """Return the text of the `sensor.toml` of a sensor; `sensor_from_toml` returns the same sensor."""
    body = sensor.body
    kept = dict(sensor.extra)

    def table(name: str, values: Mapping[str, object]) -> dict[str, object]:
        unused = kept.pop(name, {})
        return {k: v for k, v in values.items() if v is not None} | dict(unused)

    tables: dict[str, Any] = {"name": sensor.name, "body": body.kind}
    named = {
        "geometry": table("geometry", {key: _plain(getattr(body, key)) for key in body.geometry_keys}),
        "rubber": table("rubber", {key: getattr(sensor.rubber, key) for key in _RUBBER}),
        "force_sensor": table("force_sensor", {body.force_noise_key: sensor.force_noise_sd}),
        "readings": table(
            "readings", {"unit": sensor.reading_unit or None, "quantity": sensor.reading_quantity or None}
        ),
        "source": dict(sensor.source),
    }
    return tomli_w.dumps(tables | kept | {name: values for name, values in named.items() if values})


def sensor_writer(sensor: Sensor) -> Callable[[Path], None]:
    """Return a function that writes this sensor to a path (see `bayestouch.data.files.write_together`).

    Raises
    ------
    InputError
        The sensor contains text that cannot be written.
    """
    try:
        data = sensor_to_toml(sensor).encode()
    except (UnicodeEncodeError, TypeError) as error:
        raise InputError(f"the sensor cannot be written as TOML: {error}") from None

    def write(path: Path) -> None:
        path.write_bytes(data)

    return write


def _sensor(tables: dict[str, Any], default_name: str, file: str) -> Sensor:
    kind = tables.pop("body", next(iter(BODIES)))
    if not isinstance(kind, str) or kind not in BODIES:
        kinds = " or ".join(f'"{each}"' for each in BODIES)
        raise InputError(f"expected {kinds}, got {shown(kind)}{nearest(str(kind), BODIES)}", column="body")
    body = geometries()[kind]
    name = tables.pop("name", default_name)
    geometry = _take(tables, "geometry", body.geometry_keys)
    others = [other for name, other in geometries().items() if name != kind]
    for key in body.required_keys:
        if key not in geometry:
            given = tables.get("geometry", {})
            fitting = [other.kind for other in others if other.elements_key in given]
            hint = "".join(f', or body = "{other}" at the top' for other in fitting)
            needed = ", ".join(body.required_keys) + f" under [geometry]{hint or misspelt(key, given)}"
            raise InputError(f"missing; a {kind} needs {needed}", column=f"geometry.{key}")
    rubber = _take(tables, "rubber", _RUBBER)
    force = _take(tables, "force_sensor", (body.force_noise_key,))
    for key in (other.force_noise_key for other in others):
        if not force and key in tables.get("force_sensor", {}):
            raise InputError(f"expected {body.force_noise_key} on a {kind}", column=f"force_sensor.{key}")
    readings = _take(tables, "readings", _READINGS)
    source = _take(tables, "source", None)
    table_of = dict.fromkeys(body.geometry_keys, "geometry") | dict.fromkeys(_RUBBER, "rubber")
    table_of |= dict.fromkeys(_READINGS, "readings") | {body.force_noise_key: "force_sensor"}
    with _within(table_of):
        return Sensor(
            name=name,
            body=body(**geometry),
            rubber=Rubber(**rubber),
            force_noise_sd=force.get(body.force_noise_key),
            reading_unit=readings.get("unit", ""),
            reading_quantity=readings.get("quantity", ""),
            source={key: value if isinstance(value, str) else str(value) for key, value in source.items()},
            extra=tables,
            notes=tuple(
                f"{file}: {key} is not known here, kept and not used{_question(key, table_of)}"
                for key in _leaves(tables)
            ),
        )


@contextmanager
def _within(tables: Mapping[str, str]) -> Iterator[None]:
    """Add the name of the table to the key that an error names."""
    try:
        yield
    except InputError as error:
        key = (error.column or "").partition("[")[0]
        column = f"{tables[key]}.{error.column}" if key in tables else error.column
        raise InputError(error.message, column=column) from None


def _take(tables: dict[str, Any], name: str, keys: tuple[str, ...] | None) -> dict[str, Any]:
    """Remove the keys of a table (all if `keys` is None) and return them; other keys remain in `tables`."""
    table = tables.pop(name, {})
    if not isinstance(table, dict):
        raise InputError(f"expected a table [{name}], got {shown(table)}", column=name)
    unused = {} if keys is None else {key: value for key, value in table.items() if key not in keys}
    if unused:
        tables[name] = unused
    return {key: value for key, value in table.items() if key not in unused}


def _leaves(tables: Mapping[str, Any]) -> list[str]:
    known = (*BODIES, "geometry", "rubber", "force_sensor", "readings")
    return [
        leaf
        for name, value in tables.items()
        for leaf in ([f"{name}.{key}" for key in value] if name in known and isinstance(value, dict) else [name])
    ]


def _question(unknown: str, table_of: Mapping[str, str]) -> str:
    """Question with the key of the same table, or the table, that an unknown name is most similar to; or nothing."""
    table, _, key = unknown.rpartition(".")
    keys = [each for each, of in table_of.items() if of == table]
    return nearest(key, keys if table else ("name", "body", *table_of.values()))


def _plain(value: object) -> object:
    return list(value) if isinstance(value, tuple) else value


def _line_of(text: str, column: str | None) -> int | None:
    """Line number of `table.key`, or of `table`; None if the key is dotted or in an inline table."""
    if column is None:
        return None
    table, _, key = column.partition("[")[0].rpartition(".")
    current = ""
    for number, line in enumerate(text.split("\n"), start=1):
        if heading := re.match(r"\s*\[\s*([\w-]+)\s*\]", line):
            current = heading[1]
            if not table and key == current:
                return number
        elif current == table and re.match(rf"\s*[\"']?{re.escape(key)}[\"']?\s*=", line):
            return number
    return None
