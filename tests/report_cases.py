"""Small data sets and their reports."""

from __future__ import annotations

import json
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np

import bayestouch
from bayestouch.reporting.assemble import numbers_of_touches, with_checks, with_diagnosis
from bayestouch.reporting.checks import about_checks
from bayestouch.reporting.evidence import Evidence
from bayestouch.simulation import FingerDesign, PadDesign, SimulatedDataSet, simulate

FINGER = FingerDesign(
    n_elements=6,
    calibration_span_deg=45.0,
    edge_step_deg=5.0,
    flat_step_deg=10.0,
    samples_per_touch=2,
    touch_radii_mm=(0.0, 3.9, 12.3, np.inf),
    touch_span_deg=10.0,
    touch_step_deg=5.0,
)


LINE = PadDesign(
    element_x_mm=(0.0, 6.0, 12.0),
    element_y_mm=None,
    margin_mm=3.0,
    calibration_step_mm=1.5,
    n_touches=20,
    samples_per_touch=2,
)


PLANE = replace(LINE, element_y_mm=(0.0, 0.0, 6.0), calibration_step_mm=3.0)


def small(design: FingerDesign | PadDesign) -> SimulatedDataSet:
    return simulate(design, seed=4)


def pad_evidence(design: PadDesign) -> Evidence:
    """A pad with one kernel, to save the time of comparing them."""
    dataset = small(design).dataset
    calibration = bayestouch.calibrate(dataset, kernel="gaussian")
    seen, unseen = (
        bayestouch.infer(dataset.touches, calibration, use_load=use, draws=128, groups="all") for use in (True, False)
    )
    return Evidence(dataset, calibration, seen, unseen, False, {}, seed=0, draws=128, plug_in=False)


class Page(HTMLParser):
    """What a page is made of, and whether every element is closed in order."""

    VOID = frozenset({"meta", "img", "br", "hr", "link"})

    def __init__(self, text: str) -> None:
        super().__init__()
        self.found: list[tuple[str, dict[str, str | None]]] = []
        self.open: list[str] = []
        self.cells: list[str] = []
        self.text: list[str] = []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found.append((tag, dict(attrs)))
        if tag not in self.VOID:
            self.open.append(tag)
        if tag in ("td", "th"):
            self.cells.append("")

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text.append(data)
        if {"td", "th"} & set(self.open):
            self.cells[-1] += data

    def all(self, tag: str) -> list[dict[str, str | None]]:
        return [attributes for name, attributes in self.found if name == tag]


def strict_json(path: Path) -> dict[str, Any]:
    def refuse(name: str) -> None:
        raise AssertionError(f"{name} in report.json")

    loaded = json.loads(path.read_text("utf-8"), parse_constant=refuse)
    assert isinstance(loaded, dict)
    return loaded


def report_numbers(evidence: Evidence) -> dict[str, Any]:
    """Content of ``report.json``, its parts made one after the other in this process."""
    return with_diagnosis(with_checks(numbers_of_touches(evidence), about_checks(evidence)), evidence)
