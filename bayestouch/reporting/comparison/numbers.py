"""Numbers of a comparison."""

from __future__ import annotations

from typing import Any

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray
from bayestouch.data.json_values import strict
from bayestouch.errors import few
from bayestouch.output.text import listed, number, plural
from bayestouch.reporting.calibration_tables import in_words
from bayestouch.results.objects import Calibration

#: Differences of more standard deviations than this are listed; by chance this happens for one in 370 parameters.
TELLING = 3.0
_MOST_NAMED = 6

Side = tuple[Calibration, Any]


def compared(first: Side, second: Side) -> dict[str, Any]:
    """Content of ``comparison.json``.

    Parameters
    ----------
    first, second : tuple of Calibration and mapping or None
        Each calibration, with the numbers of its report or None.
    """
    calibrations, reports = zip(first, second, strict=True)
    rows = compared_parameters(*calibrations)
    quantities = None if None in reports else _quantities(*reports)
    numbers: dict[str, Any] = {
        "names": [each.sensor.name for each in calibrations],
        "kind": "calibrations" if quantities is None else "data sets",
        "verdicts": None if quantities is None else [each["answer"]["verdict"] for each in reports],
        "quantities": quantities,
        "statistics": _statistics(*calibrations),
        "parameters": rows,
        "telling_sd": TELLING,
    }
    numbers["sentences"] = _sentences(numbers, *calibrations)
    return dict(strict(numbers))


def compared_parameters(first: Calibration, second: Calibration) -> list[dict[str, Any]]:
    """One row for each parameter that both have, in one unit; values by element only of equally many elements.

    An element without readings in one of them is left out: of it only the prior is known.
    """
    units = {parameter.name: (parameter.symbol, parameter.unit) for parameter in first.parameters}
    others = in_other_units(first, second)
    rows = []
    for name, (symbol, unit) in units.items():
        if name not in first.posterior or name not in second.posterior or name in others:
            continue
        a, b = (np.asarray(each.posterior[name]) for each in (first, second))
        if a.shape[2:] != b.shape[2:]:
            continue
        (mean_a, sd_a), (mean_b, sd_b) = (_moments(each) for each in (a, b))
        spread = np.hypot(sd_a, sd_b)
        z = np.divide(mean_b - mean_a, spread, out=np.full(len(spread), np.nan), where=spread > 0)
        elements = range(len(mean_a)) if a.ndim == 2 else np.flatnonzero(_read_in_both(first, second))
        for e in elements:
            rows.append(
                {
                    "parameter": name,
                    "symbol": symbol,
                    "element": None if a.ndim == 2 else f"e{e + 1:02d}",
                    "unit": unit,
                    "first_mean": mean_a[e],
                    "first_sd": sd_a[e],
                    "second_mean": mean_b[e],
                    "second_sd": sd_b[e],
                    "difference_in_sd": z[e],
                }
            )
    return rows


def _read_in_both(first: Calibration, second: Calibration) -> BoolArray:
    """Whether each element has readings in both calibrations, (m,), of equally many elements."""
    return np.asarray(first.rows.responds & second.rows.responds)


def in_other_units(first: Calibration, second: Calibration) -> list[str]:
    """Names of parameters that the calibrations have in different units."""
    units = {parameter.name: parameter.unit for parameter in second.parameters}
    return [each.name for each in first.parameters if units.get(each.name, each.unit) != each.unit]


def _moments(draws: FloatArray) -> tuple[FloatArray, FloatArray]:
    flat = draws.reshape(draws.shape[0] * draws.shape[1], -1)
    return flat.mean(axis=0), flat.std(axis=0)


def _statistics(first: Calibration, second: Calibration) -> list[dict[str, Any]]:
    return [
        {"quantity": in_words(name), "first": value, "second": second.statistics[name]}
        for name, value in first.statistics.items()
        if name in second.statistics
    ]


def _quantities(first: Any, second: Any) -> list[dict[str, Any]]:
    """Key numbers of both reports."""
    keys = [{row["quantity"]: row for row in each["answer"]["key_numbers"]} for each in (first, second)]
    names = [*keys[0], *(name for name in keys[1] if name not in keys[0])]
    return [
        {
            "quantity": name,
            "unit": next(each[name]["unit"] for each in keys if name in each),
            "first": keys[0].get(name, {}).get("value"),
            "second": keys[1].get(name, {}).get("value"),
        }
        for name in names
    ]


def _sentences(numbers: dict[str, Any], first: Calibration, second: Calibration) -> list[str]:
    out = []
    for row in numbers["quantities"] or ():
        # Some names end in where the error is: "error, rms, outside".
        name, rms, where = row["quantity"].partition(" error, rms")
        if rms and row["first"] and row["second"]:
            change, unit = 100 * (row["second"] / row["first"] - 1), row["unit"]
            where = where.removeprefix(",").removesuffix(" all")
            both = (
                f"{number(row['first'], 2)} {unit} rms on the first and {number(row['second'], 2)} {unit} on the second"
            )
            out.append(f"The {name} error{where} is {both} ({change:+z.0f} %).".replace("-", "−"))
    if first.sensor.n_elements != second.sensor.n_elements:
        out.append("The two have different numbers of elements, so elements are not compared.")
    elif len(dead := np.flatnonzero(~_read_in_both(first, second))):
        out.append(f"Without readings in one of the two, and not compared: {few([f'e{e + 1:02d}' for e in dead])}.")
    if others := in_other_units(first, second):
        out.append(f"Parameters in different units are not compared: {listed(others)}.")
    rows = [row for row in numbers["parameters"] if row["difference_in_sd"] == row["difference_in_sd"]]  # no NaN
    telling = [row for row in rows if abs(row["difference_in_sd"]) > TELLING]
    telling.sort(key=lambda row: -abs(row["difference_in_sd"]))
    if telling:
        named = [_named(row) for row in telling[:_MOST_NAMED]]
        more = f" and {len(telling) - _MOST_NAMED} more" if len(telling) > _MOST_NAMED else ""
        out.append(
            f"{plural(len(telling), 'parameter')} of {len(rows)} differ by more than {TELLING:g} standard deviations: "
            f"{listed(named) if not more else ', '.join(named) + more}."
        )
    else:
        out.append(f"None of {plural(len(rows), 'parameter')} differs by more than {TELLING:g} standard deviations.")
    return out


def _named(row: dict[str, Any]) -> str:
    where = f" of {row['element']}" if row["element"] else ""
    return f"{row['symbol']}{where} ({row['difference_in_sd']:+z.1f} sd)".replace("-", "−")
