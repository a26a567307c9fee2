"""The page, rendered from the numbers alone."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from bayestouch.reporting.pictures import Picture
from bayestouch.reporting.text import exact, number, percent, plus_minus

_TEMPLATES = Path(__file__).parent / "templates"
_TYPES = {"svg": "image/svg+xml", "png": "image/png"}
_SYMBOLS = {"theta_c": "θ_c", "region": "location, region of highest density"}
_LARGEST_RADIUS_MM = 100


def render(numbers: dict[str, Any], pictures: Sequence[Picture]) -> str:
    """One HTML page that needs nothing beside itself.

    Parameters
    ----------
    numbers : dict
        What `report.json` holds.
    pictures : sequence of Picture
        Embedded as data.
    """
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(_TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update(at=_at, shown=_shown, span=_span, radius=_radius, plus_minus=plus_minus, symbol=_symbol)
    environment.globals["numbers"] = numbers
    environment.globals["images"] = {picture.file: data_uri(picture) for picture in pictures}
    return environment.get_template("index.html").render()


def data_uri(picture: Picture) -> str:
    """The picture's file inside an address."""
    return f"data:{_TYPES[picture.format]};base64,{base64.b64encode(picture.content).decode('ascii')}"


def _at(row: dict[str, Any], key: str) -> Any:
    """``row["a"]["b"]`` for the key ``a.b``."""
    value: Any = row
    for part in key.split("."):
        value = value[part]
    return value


def _shown(value: Any, form: str) -> str:
    if form == "percent":
        return "–" if value is None else percent(value)
    if form == "exact":
        return exact(value)
    return number(value, {"number2": 2, "number4": 4}.get(form, 3))


def _span(values: dict[str, Any]) -> str:
    """From the lowest to the highest value."""
    low, high = values["lowest"], values["highest"]
    if low is None:
        return "–"
    return _place(low) if low == high else f"{_place(low)} to {_place(high)}"


def _place(value: float) -> str:
    """Four digits at most, no zeros behind."""
    return f"{value:.4g}".replace("-", "−")


def _radius(estimate: dict[str, Any]) -> str:
    """An estimate of r_c; near a flat it means nothing but that it is large."""
    radius = estimate["r_c_mm"]
    return f"> {_LARGEST_RADIUS_MM}" if radius is None or radius > _LARGEST_RADIUS_MM else number(radius)


def _symbol(name: str) -> str:
    return _SYMBOLS.get(name, name)
