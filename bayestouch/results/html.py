"""HTML tables that notebooks show for results."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape
from typing import TYPE_CHECKING

import numpy as np

from bayestouch.output.summary import summary_html
from bayestouch.output.text import number, plus_minus
from bayestouch.results.tables import parameter_table

if TYPE_CHECKING:
    from bayestouch.results.data import CalibrationData, PosteriorsData

_ROWS = 8


def html_table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """HTML of a plain table; all cells are escaped."""
    top = "".join(f'<th scope="col">{escape(cell)}</th>' for cell in head)
    lines = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<table><thead><tr>{top}</tr></thead><tbody>{lines}</tbody></table>"


def calibration_html(calibration: CalibrationData) -> str:
    """HTML of a calibration: parameters with priors and posteriors, and quality of the fit."""
    rows = []
    for name, row in parameter_table(calibration).iterrows():
        shared = np.isnan(row["lowest"])
        span = "" if shared else f"{number(row['lowest'], 4)} to {number(row['highest'], 4)}"
        value = plus_minus(row["mean"], row["sd"])
        rows.append([f"{row['symbol']} ({name})", row["unit"], row["meaning"], row["prior"], value, span])
    head = ("parameter", "unit", "meaning", "prior", "posterior mean ± sd", "over the elements")
    return summary_html(calibration) + html_table(head, rows)


def touches_html(posteriors: PosteriorsData) -> str:
    """HTML of posteriors: the first touches, and quality of the draws."""
    count = len(posteriors.rows.touch)
    parameters = [p for p in posteriors.parameters if p.name in posteriors.posterior or p.name in posteriors.estimates]
    numbers = {p.name: (posteriors.mean(p.name), posteriors.sd(p.name)) for p in parameters}
    rows = [
        [str(posteriors.rows.touch[t]), *(plus_minus(float(m[t]), float(s[t])) for m, s in numbers.values())]
        for t in range(min(count, _ROWS))
    ]
    if count > _ROWS:
        rows.append(["…"] * (1 + len(parameters)))
    head = ("touch", *(f"{p.symbol} ({p.unit})" for p in parameters))
    return summary_html(posteriors) + html_table(head, rows)
