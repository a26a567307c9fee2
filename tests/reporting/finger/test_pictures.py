"""Figures of a finger: what is drawn where."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from report_cases import FINGER, small

import bayestouch
from bayestouch.reporting.evidence import Evidence
from bayestouch.reporting.finger import pictures


def test_fits_to_single_samples_are_beside_their_touch(monkeypatch: pytest.MonkeyPatch) -> None:
    """In a table whose angles run from 0 to 360 degree, too."""
    dataset = small(FINGER).dataset
    table = dataset.touches
    assert table.angle_deg is not None
    dataset = replace(dataset, touches=table.with_(angle_deg=table.angle_deg % 360))
    calibration = bayestouch.calibrate(dataset, draws=64)
    read = bayestouch.infer(dataset.touches, calibration, draws=64)
    evidence = Evidence(dataset, calibration, read, None, False, {}, seed=0, draws=64, plug_in=False)
    drawn: list[tuple[Any, Any, Any]] = []

    def look(figure: Any) -> bytes:
        (axes,) = figure.axes
        drawn.append((axes.lines[0].get_xdata(), axes.get_xlim(), axes.lines[0].get_label()))
        return b""

    monkeypatch.setattr(pictures, "rendered", look)
    pictures._by_location(evidence, 12.3)
    ((at, (low, high), label),) = drawn
    assert label == "fit to one sample"
    # Two samples at each of the five places of this tip; the touches are 5 degree apart, and the dots a little beside.
    assert np.sort(at) == pytest.approx(np.repeat([-10.0, -5.0, 0.0, 5.0, 10.0], 2) + 0.12 * 5)
    assert low < at.min() and at.max() < high
