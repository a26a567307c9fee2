"""HTML page of a report, made only from its numbers and figures."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bayestouch.diagnosis.outcome import probable_causes
from bayestouch.output.pictures import Picture
from bayestouch.output.text import exact, number, percent, plural, plus_minus
from bayestouch.reporting.baseline_table import beside_regressions
from bayestouch.reporting.bodies import PAGES
from bayestouch.reporting.live import Live
from bayestouch.reporting.loop_bars import (
    after_in_words,
    before_after,
    has_errors_of_touches,
    loop_bars,
    references_corrected,
)
from bayestouch.reporting.phrases import calibrated_with
from bayestouch.reporting.trust import grade_rows

if TYPE_CHECKING:
    from jinja2 import Environment

_TEMPLATES = Path(__file__).parent / "templates"
_TYPES = {"svg": "image/svg+xml", "png": "image/png"}
_SYMBOLS = {"theta_c": "θ_c", "region": "location, region of highest density"}
_LARGEST_RADIUS_MM = 100


def render(numbers: dict[str, Any], pictures: Sequence[Picture], live: Live | None = None) -> str:
    """HTML of a page that needs no other files.

    Parameters
    ----------
    numbers : dict
        Content of ``report.json``.
    pictures : sequence of Picture
        Figures, embedded as data.
    live : Live, optional
        Interactive figures; without them the page has no script.
    """
    environment = new_environment(numbers, pictures)
    environment.globals["live"] = live
    environment.globals["sketch"] = PAGES[numbers["data"]["body"]].sketch(numbers)
    environment.globals["loops"] = loop_bars(numbers["diagnosis"])
    return environment.get_template("index.html").render()


def new_environment(numbers: dict[str, Any], pictures: Sequence[Picture]) -> Environment:
    """Template environment with the filters of the pages, these numbers and these figures."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(_TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update(at=_at, shown=_shown, span=_span, radius=_radius, plus_minus=plus_minus, symbol=_symbol)
    environment.filters["plural"] = plural
    environment.filters["place"] = _place
    environment.filters["calibrated_with"] = calibrated_with
    environment.filters["after_in_words"] = after_in_words
    environment.filters["before_after"] = before_after
    environment.filters["has_errors_of_touches"] = has_errors_of_touches
    environment.filters["references_corrected"] = references_corrected
    environment.filters["beside_regressions"] = beside_regressions
    environment.filters["probable_causes"] = probable_causes
    environment.filters["grade_rows"] = grade_rows
    environment.globals["numbers"] = numbers
    environment.globals["images"] = {picture.file: data_uri(picture) for picture in pictures}
    return environment


def data_uri(picture: Picture) -> str:
    """Figure as a data address."""
    return f"data:{_TYPES[picture.format]};base64,{base64.b64encode(picture.content).decode('ascii')}"


def _at(row: dict[str, Any], key: str) -> Any:
    """Value ``row["a"]["b"]`` for the key ``a.b``."""
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
    """Text of the range from the lowest to the highest value."""
    low, high = values["lowest"], values["highest"]
    if low is None:
        return "–"
    return _place(low) if low == high else f"{_place(low)} to {_place(high)}"


def _place(value: float) -> str:
    """Number with at most four digits, without trailing zeros."""
    return f"{value:.4g}".replace("-", "−")


def _radius(estimate: dict[str, Any]) -> str:
    """Text of an estimate of r_c; near a flat only a lower limit makes sense."""
    radius = estimate["r_c_mm"]
    return f"> {_LARGEST_RADIUS_MM}" if radius is None or radius > _LARGEST_RADIUS_MM else number(radius)


def _symbol(name: str) -> str:
    return _SYMBOLS.get(name, name)
