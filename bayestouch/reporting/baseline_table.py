"""Errors of regressions without physics, between those before and after: columns and rows of the table."""

from __future__ import annotations

from typing import Any

from bayestouch.diagnosis.outcome import errors_of_samples

_COLUMNS = (
    ("prediction_error_percent_peak", "prediction error", "% of peak", 1),
    ("touch_error_percent_peak", "prediction error of touch means", "% of peak", 1),
    ("location_median_mm", "error of the location, median", "mm", 1),
    ("location_rms_mm", "error of the location, rms", "mm", 1),
    ("coverage_90", "touches inside 90 % regions", "%", 100),
    ("P_rms_N", "error of P, rms", "N", 1),
    ("P_coverage_90", "loads inside 90 % intervals", "%", 100),
)


def beside_regressions(diagnosis: dict[str, Any]) -> dict[str, Any] | None:
    """Table of the errors before, of each regression, and after; None if no touches were read by regressions.

    Returns
    -------
    dict or None
        ``columns``, tuples of key, header, unit and format, without those of which the data give nothing; and ``rows``,
        dictionaries with ``name`` and a number or None for each key, coverages in percent.
    """
    if not diagnosis.get("baselines"):
        return None
    whole = [
        {**diagnosis["before"], "name": "before"},
        *diagnosis["baselines"],
        {**diagnosis["after_against_stated"], "name": "after"},
    ]
    both = errors_of_samples(*whole)
    columns, rows = [("name", "Read with", "", "text")], [{"name": each["name"]} for each in whole]
    for key, header, unit, factor in _COLUMNS:
        values = [each.get(key) for each in whole]
        if all(value is None for value in values) or (key == "touch_error_percent_peak" and not both):
            continue
        of_samples = " of samples" if both and key == "prediction_error_percent_peak" else ""
        columns.append((key, header + of_samples, unit, "number"))
        for row, value in zip(rows, values, strict=True):
            row[key] = None if value is None else factor * value
    return {"columns": columns, "rows": rows}
