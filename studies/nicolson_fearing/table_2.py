"""Table 2: the E map identified directly from edges all around (equation 6), and its condition number.

The number of Fourier coefficients is not printed. Here they end where the elastic model's response has fallen to half a
per cent; `condition_numbers.py` tries others, and other arrays.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import _path  # noqa: F401
import numpy as np
from _published import figure, options, print_beside, save

from bayestouch.paper import published
from bayestouch.reliability import Beside
from nicolson_fearing.paper_run import PaperRun, over_fingers, put_in, runs

COLUMNS = ("min", "avg", "max")
WHY = "the paper's elements differ more among themselves; here all have errors of one size"
WHY_CONDITION = (
    "n_c and the elements taken are not printed; shallower elements or another n_c give other numbers "
    "(condition_numbers.py)"
)


def rows(found: list[PaperRun]) -> list[Beside]:
    """Table 2, the sentences of section 3.2 about it, and the condition numbers."""
    out = [
        over_fingers(
            f"table_2.error.{column}",
            lambda run, i=i: run.finger.identified.summary("error_percent_peak")[i],
            found,
            WHY,
            tuned=column == "avg",
        )
        for i, column in enumerate(COLUMNS)
    ]
    span = 2 * found[0].data.truth["design"]["calibration_span_deg"]
    return [
        *out,
        put_in("fit_range.empirical", span),
        replace(out[1], key="fit_error.empirical"),
        over_fingers(
            "condition_number.model", lambda run: run.finger.fitted_map.condition_number, found, WHY_CONDITION
        ),
        over_fingers(
            "condition_number.empirical", lambda run: run.finger.identified.condition_number, found, WHY_CONDITION
        ),
    ]


def picture(folder: Path, found: list[PaperRun]) -> None:
    """Errors of all elements with the fit and left out of it, and singular values of both maps."""
    drawn, (left, right) = figure(2)
    low, mean, high = (published.number(f"table_2.error.{column}").value for column in COLUMNS)
    left.axhspan(low, high, color="C1", alpha=0.15, label="paper: range")
    left.axhline(mean, color="C1", label="paper: mean")
    for i, run in enumerate(found):
        for attribute, style, name in (
            ("error_percent_peak", "C0.", "elements, fitted touches"),
            ("held_out_percent_peak", "C2x", "elements, touches left out"),
        ):
            values = getattr(run.finger.identified, attribute)
            left.plot(np.full(len(values), i), values, style, ms=4, alpha=0.6, label=None if i else name)
    left.set(xlabel="simulated finger", ylabel="error (% of peak)", xticks=range(len(found)), ylim=(0, None))
    left.set_title("Table 2: empirical fits to knife edges")
    left.legend(loc="lower left")
    for name, table, style in (
        ("fitted model", found[0].finger.fitted_map, "C0.-"),
        ("identified", found[0].finger.identified, "C3x-"),
    ):
        values = np.linalg.svd(table.map / table.response[:, None], compute_uv=False)
        right.plot(
            1 + np.arange(len(values)),
            values / values[0],
            style,
            label=f"{name}: condition {values[0] / values[-1]:.1f}",
        )
    right.set(
        xlabel="singular value",
        xticks=range(1, 17, 3),
        ylabel="relative to the largest",
        ylim=(0, None),
        title="singular values of the E maps",
    )
    right.legend()
    save(drawn, folder, "table_2")


def main(small: bool = False, folder: Path | None = None) -> list[Beside]:
    """Print the numbers and save the picture."""
    found = runs(small)
    out = rows(found)
    print_beside(out)
    if folder is not None:
        picture(folder, found)
    return out


if __name__ == "__main__":
    main(*options(__doc__))
