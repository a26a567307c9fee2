"""Files of a comparison."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from bayestouch.output.files import COMPARED, PAGE, write_numbers, write_pictures, write_text
from bayestouch.output.pictures import Picture, canvas, drawing, element_ticks, rendered
from bayestouch.reporting.comparison.plots import by_parameter, draw_parameter, last_element
from bayestouch.reporting.page import new_environment


def write_comparison(numbers: dict[str, Any], folder: Path) -> None:
    """Write page, numbers and figure to an existing folder."""
    picture = difference_picture(numbers)
    pictures = () if picture is None else (picture,)
    numbers["figures"] = [each.described for each in pictures]
    write_pictures(folder, pictures)
    write_numbers(folder / COMPARED, numbers)
    environment = new_environment(numbers, pictures)
    write_text(folder / PAGE, environment.get_template("comparison.html").render())


def difference_picture(numbers: dict[str, Any]) -> Picture | None:
    """Figure of both sensors' parameters by element, with 90 % intervals; None if they have none in common."""
    by_element = by_parameter(numbers["parameters"])
    if not by_element:
        return None
    with drawing():
        figure, axes = canvas(1.9 * len(by_element) + 0.4, len(by_element), 1, sharex=True)
        for ax, rows in zip(axes[:, 0], by_element.values(), strict=True):
            draw_parameter(ax, rows)
        element_ticks(axes[-1, 0], last_element(rows))
        axes[-1, 0].set_xlabel("element")
        figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
        content = rendered(figure)
    worst = max(
        (row for rows in by_element.values() for row in rows), key=lambda row: abs(row["difference_in_sd"] or 0.0)
    )
    return Picture(
        "elements",
        "parameters",
        "Element by element",
        "Posterior mean and 90 % interval of each, less the mean of both.",
        f"Calibration parameters of both by element; the largest difference, in standard deviations, is that of "
        f"{worst['symbol']} at {worst['element']}.",
        content,
    )
