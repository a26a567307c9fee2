"""A comparison to files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from bayestouch.reporting.files import PAGE, write_numbers, write_pictures, write_text
from bayestouch.reporting.page import new_environment
from bayestouch.reporting.pictures import BLUE, RED, Picture, canvas, drawing, element_ticks, legend_below, rendered

NUMBERS = "comparison.json"


def write_comparison(numbers: dict[str, Any], folder: Path) -> None:
    """Write page, numbers and figure into an existing folder."""
    picture = difference_picture(numbers)
    pictures = () if picture is None else (picture,)
    numbers["figures"] = [each.described for each in pictures]
    write_pictures(folder, pictures)
    write_numbers(folder / NUMBERS, numbers)
    environment = new_environment(numbers, pictures)
    write_text(folder / PAGE, environment.get_template("comparison.html").render())


def difference_picture(numbers: dict[str, Any]) -> Picture | None:
    """Parameters by element of both, with 90 % intervals; None where they have none in common."""
    rows = [row for row in numbers["parameters"] if row["element"] is not None]
    names = list(dict.fromkeys(row["parameter"] for row in rows))
    if not names:
        return None
    with drawing():
        figure, axes = canvas(1.9 * len(names) + 0.4, len(names), 1, sharex=True)
        for ax, name in zip(axes[:, 0], names, strict=True):
            these = [row for row in rows if row["parameter"] == name]
            middle = np.array([(row["first_mean"] + row["second_mean"]) / 2 for row in these])
            at = np.arange(len(these))
            for side, colour, marker, shift in (("first", BLUE, "o", -0.12), ("second", RED, "s", 0.12)):
                mean = np.array([row[f"{side}_mean"] for row in these])
                # 1.645: central 90 % of a normal
                ends = 1.645 * np.array([row[f"{side}_sd"] for row in these])
                ax.errorbar(at + shift, mean - middle, ends, fmt=marker, ms=4, color=colour, label=side)
            unit = f"\n({these[0]['unit']})" if these[0]["unit"] else ""
            ax.set_ylabel(f"{these[0]['symbol']} − mean of both{unit}", fontsize=8)
            ax.grid(axis="y")
        element_ticks(axes[-1, 0], len(these))
        axes[-1, 0].set_xlabel("element")
        legend_below(axes[-1, 0], 2)
        content = rendered(figure)
    worst = max(rows, key=lambda row: abs(row["difference_in_sd"] or 0.0))
    return Picture(
        "elements",
        "parameters",
        "Element by element",
        "Posterior mean and 90 % interval of each, less the mean of both.",
        f"Calibration parameters of both by element; the largest difference, in standard deviations, is that of "
        f"{worst['symbol']} at {worst['element']}.",
        content,
    )
