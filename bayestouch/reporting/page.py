"""HTML page of a report, made only from its numbers and figures."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bayestouch.diagnosis.outcome import errors_of_samples
from bayestouch.output.pictures import Picture
from bayestouch.output.text import exact, number, percent, plus_minus
from bayestouch.reporting.live import Live

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
    environment.filters["before_after"] = before_after
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


def before_after(diagnosis: dict[str, Any]) -> list[dict[str, Any]]:
    """Rows of errors before and after, as far as the data give them; after also against stated references."""
    both = errors_of_samples(diagnosis["before"], diagnosis["after"])
    rows = (
        ("prediction_error_percent_peak", f"prediction error{' of samples' if both else ''}", "% of peak", 1),
        *([("touch_error_percent_peak", "prediction error of touch means", "% of peak", 1)] if both else []),
        ("lack_of_fit", "lack of fit (1: none)", "", 1),
        ("R_bias_mm", "bias of R", "mm", 1),
        ("R_rms_mm", "rms error of R", "mm", 1),
        ("theta_rms_deg", "rms error of θ_c", "degree", 1),
        ("P_rms_N_per_m", "rms error of P, read without the force sensor", "N/m", 1),
        ("location_rms_mm", "rms error of the location", "mm", 1),
        ("P_rms_N", "rms error of P, read without the force sensor", "N", 1),
        ("coverage_90", "touches inside 90 % intervals", "%", 100),
        ("P_coverage_90", "loads inside 90 % intervals, read without the force sensor", "%", 100),
    )
    # Files of version 0.1 do not contain this key.
    stated = diagnosis.get("after_against_stated", diagnosis["after"])
    found = []
    for key, quantity, unit, factor in rows:
        values = [whole.get(key) for whole in (diagnosis["before"], diagnosis["after"], stated)]
        if any(value is not None for value in values):
            before, after, against = (None if value is None else factor * value for value in values)
            row = {
                "quantity": quantity,
                "unit": unit,
                "before": before,
                "after": after,
                "after_against_stated": against,
            }
            found.append(row)
    return found
