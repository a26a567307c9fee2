"""Figure of the predictive check."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from bayestouch.output.pictures import BLUE, GREY, Picture, canvas, drawing, element_ticks, rendered
from bayestouch.output.text import plural, ranging


def check_pictures(numbers: dict[str, Any]) -> Iterator[Picture]:
    """Readings inside their predicted intervals by element, if this was checked; from the numbers of a report."""
    check = numbers["checks"]["predictive"]
    if not check or not check["by_element"]:
        return
    rows = check["by_element"]
    # Elements without readings have no row, and their place remains empty.
    names = [row["element"] for row in numbers["calibration"]["elements"]["rows"]]
    place = np.array([names.index(row["element"]) for row in rows])
    low, high = (np.array([row[key] for row in rows]) for key in ("expected_low", "expected_high"))
    inside = np.array([row["percent_inside"]["90"] for row in rows])
    with drawing():
        figure, axes = canvas(3.0)
        ax = axes[0, 0]
        ax.bar(place, high - low, bottom=low, width=0.6, color=GREY, alpha=0.35, label="scatter if right")
        ax.plot(place, inside, "o", color=BLUE, label="readings of the element")
        ax.axhline(90, color=GREY, ls=":")
        ax.set(xlabel="element", ylabel="readings inside 90 % (%)")
        ax.set_ylim(min(60.0, 0.95 * float(inside.min())), 102)
        element_ticks(ax, len(names), "x")
        ax.set_xlim(-0.6, len(names) - 0.4)
        ax.legend(loc="upper left", bbox_to_anchor=(1.02, 1))
        content = rendered(figure)
    named = len(check["too_often_outside"])
    yield Picture(
        "predictive_check",
        "checks",
        "How often readings are inside the interval that the other readings predict",
        "Each reading is predicted from the other readings of its touch. A dot below its bar: the element reads other "
        "than the model says, or with more noise. A dot above it: its intervals are wider than needed.",
        f"Readings inside their predicted 90 % interval, for {plural(len(rows), 'element')}: "
        f"{ranging(float(inside.min()), float(inside.max()))} %; {plural(named, 'element')} "
        f"{'is' if named == 1 else 'are'} outside too often.",
        content,
    )
