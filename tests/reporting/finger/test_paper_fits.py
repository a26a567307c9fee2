"""Fits of the paper on a finger with a stuck element: it is left out, and the others are as without it."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from report_cases import FINGER

import bayestouch
from bayestouch.reporting.evidence import Evidence
from bayestouch.reporting.finger.paper_fits import PaperFits

STUCK = 3
# Table 2 needs more knife edges than coefficients.
CLOSE = bayestouch.simulate(replace(FINGER, n_elements=5, calibration_span_deg=30.0, edge_step_deg=2.0), seed=4).dataset


@cache
def calibrated() -> bayestouch.Calibration:
    return bayestouch.calibrate(CLOSE, draws=64)


def evidence(at_rest: float | None) -> Evidence:
    """A finger whose element e04 reads 512 in every contact and `at_rest` without; None for no readings at all."""
    table = CLOSE.calibration
    assert table is not None
    away = np.arange(table.n_rows) < 6
    readings = table.readings + 512.1
    readings[:, STUCK] = np.nan if at_rest is None else np.where(away, at_rest, 512.0)
    table = table.with_(
        readings=readings,
        touch=np.where(away, table.touch.max() + 1 + np.arange(table.n_rows), table.touch),
        contact=np.where(away, 0.0, 1.0),
        load=np.where(away, 0.0, table.load),
    )
    dataset = replace(CLOSE, calibration=table)
    return Evidence(dataset, calibrated(), None, None, False, {}, seed=0, draws=64, plug_in=False)  # type: ignore[arg-type]


@pytest.mark.parametrize("at_rest", [512.0, 500.0])
def test_a_stuck_element_counts_as_one_without_readings(at_rest: float) -> None:
    found, expected = PaperFits.of(evidence(at_rest)), PaperFits.of(evidence(None))
    assert found.elements is not None and expected.elements is not None
    assert found.elements.fits == expected.elements.fits
    assert [fit.element for fit in found.elements.fits] == [0, 1, 2, 4]
    assert found.notes == expected.notes and "e04" in found.notes[0]
    assert found.empirical is not None and expected.empirical is not None
    np.testing.assert_array_equal(found.empirical.map, expected.empirical.map)
    assert np.flatnonzero(np.isnan(found.empirical.response)).tolist() == [STUCK]
    assert found.empirical_summary() == expected.empirical_summary()
