"""After a diagnosis beside the best regression without physics, touch by touch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from _page import markdown_table
from _runs import difference_of_rms
from _worth import Worth
from numpy.typing import NDArray

#: Mark of the table in a page.
PAIRED = "<!-- beside the best regression, made by studies/measured_diagnosis.py -->"
HEAD = (
    *("data", "quantity", "runs", "best regression"),
    "rms: after minus regression (90 % interval)",
    "without the run with the largest errors",
)

FloatArray = NDArray[np.float64]


def worst_run(*errors: FloatArray, run: NDArray[np.int64]) -> int:
    """Number of the run with the largest sum of squared errors, of all ways together."""
    total = sum(each**2 for each in errors)
    return int(np.argmax(np.bincount(run, weights=np.asarray(total))))


def after_and_best(ways: Sequence[Worth], key: str) -> tuple[Worth, Worth]:
    """After a diagnosis, and the regression with the smallest rms of the errors `key`; `ways` are those of `worths`."""
    after, regressions = ways[-1], ways[1:-2]
    return after, min(regressions, key=lambda each: float(np.mean(getattr(each, key) ** 2)))


def paired_rows(name: str, ways: Sequence[Worth]) -> list[list[str]]:
    """Location and load of one data set; `ways` are those of `_worth.worths`."""
    rows = []
    for quantity, key in (("location, mm", "distance_mm"), ("load, N", "load_error_N")):
        after, best = after_and_best(ways, key)
        if np.isnan(getattr(after, key)).any():
            continue
        one, two = getattr(after, key), getattr(best, key)
        kept = after.run != worst_run(one, two, run=after.run)
        shown = [difference_of_rms(one[some], two[some], after.run[some]) for some in (kept | True, kept)]
        texts = [f"{value:+.2f} ({low:+.2f} to {high:+.2f})" for value, low, high in shown]
        rows.append([name, quantity, str(len(np.unique(after.run))), best.way, *texts])
    return rows


def paired_table(found: Mapping[str, Sequence[Worth]]) -> str:
    """Markdown table of data sets, by name."""
    return markdown_table(HEAD, [row for name, ways in found.items() for row in paired_rows(name, ways)]).rstrip()
