"""Text of a check, for a terminal and for a notebook."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from html import escape
from textwrap import wrap
from typing import Any

from bayestouch.output.text import number

_BAR = 32  # length of the longest bar in characters


def title(facts: Mapping[str, Any]) -> str:
    """Return the name and kind of the sensor."""
    sensor = facts["sensor"]
    count = sensor["elements"]
    return f"{sensor['name']}: a {sensor['body']} of {count} element{'' if count == 1 else 's'}"


def body(facts: Mapping[str, Any]) -> str:
    """Return tables, bars and advice as text that begins with a line break."""
    return "\n".join(["", "", *_aligned(_rows(facts)), "", *_indenters(facts), "", *_bars(facts), "", *_advice(facts)])


def _rows(facts: Mapping[str, Any]) -> list[list[str]]:
    places = [f"{place['name']} ({place['unit']})" for place in facts["tables"][0]["locations"]]
    head = ["table", "touches", "rows", "samples each", *places, f"load ({facts['sensor']['load_unit']})", "missing"]
    rows = [head]
    for table in facts["tables"]:
        spans = [_span(place) for place in table["locations"]]
        spans += ["–"] * (len(places) - len(spans))
        counts = [str(table["touches"]), str(table["rows"]), _span(table["samples_per_touch"])]
        rows.append(
            [_name(table), *counts, *spans[: len(places)], _span(table["load"]), str(table["missing_readings"])]
        )
    return rows


def _name(table: Mapping[str, Any]) -> str:
    return str(table["use"])


def _aligned(rows: list[list[str]]) -> list[str]:
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    return [
        "  ".join(
            cell.ljust(w) if i == 0 else cell.rjust(w) for i, (cell, w) in enumerate(zip(row, widths, strict=True))
        )
        for row in rows
    ]


def _span(values: Mapping[str, Any]) -> str:
    low, high = values["lowest"], values["highest"]
    if low is None:
        return "–"
    return number(low) if low == high else f"{number(low)} to {number(high)}"


def _indenters(facts: Mapping[str, Any]) -> Iterator[str]:
    for key, use in (("to_calibrate", "to calibrate with"), ("to_be_read", "to be read")):
        parts = [f"{row['indenter']} ({row[key]})" for row in facts["indenters"] if row[key]]
        if parts:
            yield from wrap(f"indenters {use}: {', '.join(parts)}", 100, subsequent_indent="  ")


def _bars(facts: Mapping[str, Any]) -> Iterator[str]:
    unit = facts["sensor"]["reading_unit"]
    yield f"largest mean reading of each element{f', {unit}' if unit else ''} (± noise of one reading)"
    highest = max((row["peak"] for row in facts["elements"] if row["peak"] is not None), default=0.0)
    for row in facts["elements"]:
        peak = row["peak"]
        bar = "" if not peak or not highest else "█" * max(round(_BAR * peak / highest), 1)
        noise = "" if row["noise"] is None else f" ± {number(row['noise'], 2)}"
        yield f"{row['element']}  {bar.ljust(_BAR)}  {number(peak)}{noise}"


def _advice(facts: Mapping[str, Any]) -> Iterator[str]:
    if not facts["advice"]:
        yield "nothing is lacking for a report"
        return
    yield "what these data lack:"
    for line in facts["advice"]:
        yield f"- {line}"


def html(facts: Mapping[str, Any]) -> str:
    """Return the check as HTML for a notebook."""
    head, *rows = _rows(facts)
    cells = "".join(f"<th>{escape(cell)}</th>" for cell in head)
    lines = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    advice = "".join(f"<li>{escape(line)}</li>" for line in facts["advice"])
    lacking = f"<p>What these data lack:</p><ul>{advice}</ul>" if advice else "<p>Nothing is lacking for a report.</p>"
    indenters = "".join(f"<p>{escape(line)}</p>" for line in _indenters(facts))
    table = f"<table><thead><tr>{cells}</tr></thead><tbody>{lines}</tbody></table>"
    return f"<p><strong>{escape(title(facts))}</strong></p>{table}{indenters}{lacking}"
