"""Every touch of a small set held out once: four diagnoses, each without another one of every four blocks."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from _page import markdown_table
from _worth import share_text

from bayestouch.data.dataset import DataSet
from bayestouch.diagnosis.follow import trace
from bayestouch.diagnosis.traced import Traced
from bayestouch.model.body import body_of

#: Mark of the table in a page.
IN_TURN = "<!-- all touches in turn, made by studies/measured_diagnosis.py -->"
HEAD = ("data", "touches", "read with", "location: median, mm", "rms, mm", "90 % regions hold (95 % interval)")
#: Blocks of which one is held out, and the largest number of touches of a set for which four diagnoses are made.
FOLDS, MOST = 4, 100


def in_turn(dataset: DataSet) -> list[Traced]:
    """Diagnoses of a data set with one table, as `bayestouch.diagnose` makes them, without one block of four each."""
    body = body_of(dataset.sensor)
    options = {**body.own({"contact": None, "kernel": None}), "draws": 1000, "sample": True, "seed": 0}
    return [trace(dataset, body, **options, progress=None, scheduler=None, fold=fold) for fold in range(FOLDS)]


def in_turn_rows(name: str, found: list[Traced]) -> list[list[str]]:
    """Errors of location of all touches before and after, two rows."""
    rows = []
    for way in ("before", "after"):
        read = [getattr(each, way).read.by_touch for each in found]
        distance, inside = (np.concatenate([each[key] for each in read]) for key in ("location_rms_mm", "coverage_90"))
        shown = [f"{np.median(distance):.2f}", f"{np.sqrt(np.mean(distance**2)):.2f}"]
        rows.append([name, str(len(distance)), way, *shown, share_text(float(inside.mean()), len(inside))])
    return rows


def in_turn_table(found: Mapping[str, list[Traced]]) -> str:
    """Markdown table of data sets, by name."""
    return markdown_table(HEAD, [row for name, each in found.items() for row in in_turn_rows(name, each)]).rstrip()
