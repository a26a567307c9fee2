"""Touches to choose from: their loads and samples, and elements that are dead."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import bayestouch
from bayestouch.finger.planned import planned
from bayestouch.reliability.candidate_touches import touches_to_read

DESIGN = bayestouch.FingerDesign(n_elements=4, calibration_span_deg=20.0, edge_step_deg=5.0, touch_step_deg=10.0)


@cache
def calibrated(stuck: bool = False) -> bayestouch.Calibration:
    dataset = bayestouch.simulate(DESIGN, seed=3).dataset
    table = dataset.calibration
    assert table is not None
    if stuck:
        # Zero is the reading at rest, as of an element that reads the same in every row.
        table = table.with_(readings=np.where(np.arange(4) == 3, 0.0, table.readings))
    return bayestouch.calibrate(replace(dataset, calibration=table), discrepancy="none", draws=100)


def test_loads_are_numbers_of_any_kind() -> None:
    one = calibrated()
    from_array = bayestouch.candidate_touches(one, places=[0.0], tips_mm=[3.9], loads=np.array([150.0, 250.0]))  # type: ignore[arg-type]
    assert from_array.load.tolist() == [150.0, 250.0]
    usual = bayestouch.candidate_touches(one, places=[0.0], tips_mm=[3.9])
    assert usual.load.tolist() == [pytest.approx(one.rows.load.mean())]


@pytest.mark.parametrize("loads", [[], [0.0], [-1.0], [np.inf], [1e6]])
def test_impossible_loads_are_refused(loads: list[float]) -> None:
    with pytest.raises(bayestouch.InputError, match="loads: expected numbers above zero, at most"):
        bayestouch.candidate_touches(calibrated(), loads=loads)


@pytest.mark.parametrize("tips", [[], [-1.0], [0.0, np.nan]])
def test_impossible_tips_are_refused(tips: list[float]) -> None:
    with pytest.raises(bayestouch.InputError, match="tips_mm: expected radii of zero and larger, and at least one"):
        bayestouch.candidate_touches(calibrated(), tips_mm=tips)


@pytest.mark.parametrize("name", ["places", "tips_mm", "loads"])
@pytest.mark.parametrize("given", [["a"], "a", [[[1.0]]], {"x": 1.0}])
def test_what_is_no_list_of_numbers_is_refused(name: str, given: object) -> None:
    message = f"{name}: expected a list of numbers, got {given!r}"
    with pytest.raises(bayestouch.InputError, match=f"^{re.escape(message)}$"):
        bayestouch.candidate_touches(calibrated(), **{name: given})  # type: ignore[arg-type]


@pytest.mark.parametrize("samples", [0, 2.5, "a"])
def test_samples_are_a_whole_number(samples: object) -> None:
    message = f"samples: expected a whole number, at least 1, got {samples!r}"
    with pytest.raises(bayestouch.InputError, match=f"^{re.escape(message)}$"):
        bayestouch.candidate_touches(calibrated(), samples=samples)  # type: ignore[arg-type]


def test_the_usual_number_of_samples_is_whole() -> None:
    one = calibrated()
    n = len(one.rows.samples)
    rows = replace(one.rows, samples=np.where(np.arange(n) < n // 2, 3.0, 4.0))
    even = replace(one, rows=rows)
    assert np.median(rows.samples) == 3.5
    assert set(np.asarray(bayestouch.candidate_touches(even).reads)) == {4.0}


def test_a_stuck_element_plays_no_part() -> None:
    one = calibrated(stuck=True)
    table = bayestouch.candidate_touches(one, places=[-5.0, 5.0], tips_mm=[0.0, 3.9])
    missing = replace(one, rows=replace(one.rows, observed=np.where(np.arange(4) == 3, np.nan, one.rows.observed)))
    found, expected = planned(one, table), planned(missing, table)
    assert (found.readings.columns[:, 3] == 0).all() and (found.slopes[:, 3] == 0).all()
    for name in ("mean", "columns", "noise"):
        np.testing.assert_array_equal(getattr(found.readings, name), getattr(expected.readings, name))
    assert found.parameters[2].rows.shape[0] == 3
    np.testing.assert_array_equal(touches_to_read(one).angle_deg, touches_to_read(missing).angle_deg)


@pytest.mark.parametrize("thickness", [3.0, 10.0])
def test_touches_to_read_of_a_pad_are_between_its_elements(thickness: float) -> None:
    """Also where the response is so wide that the median reading is far above zero, beside large offsets."""
    design = bayestouch.PadDesign(
        element_x_mm=(0.0, 5.0, 10.0), element_y_mm=None, thickness_mm=thickness, n_touches=4, calibration_step_mm=0.75
    )
    one = bayestouch.calibrate(bayestouch.simulate(design, seed=3).dataset, draws=100)
    found = touches_to_read(one).x_mm
    assert found is not None
    # Places of the calibration are 0.75 mm apart, elements within 0.2 mm of the design; loads have noise.
    assert (found.min(), found.max()) == (pytest.approx(0.0, abs=0.76), pytest.approx(10.0, abs=0.76))
    offset = np.array([-5.0, 0.0, 5.0]) * np.nanmax(one.rows.observed)
    moved = replace(
        one,
        rows=replace(one.rows, observed=one.rows.observed + offset),
        mode={**one.mode, "offset": one.mode["offset"] + offset},
    )
    np.testing.assert_array_equal(touches_to_read(moved).x_mm, found)


def test_rest_offsets_of_a_finger_do_not_move_the_touches_to_read() -> None:
    one = calibrated()
    share, peak = (-5.0, 3.0, 0.0, 5.0), np.nanmax(one.rows.observed, axis=0)
    moved = replace(
        one,
        rows=replace(one.rows, observed=one.rows.observed + share * peak),
        mode={**one.mode, **{f"rest_offset_own_{e + 1:02d}": np.asarray(x) for e, x in enumerate(share)}},
        extra={**one.extra, "effect_peak": peak},
    )
    found = touches_to_read(one).angle_deg
    assert found is not None
    np.testing.assert_array_equal(touches_to_read(moved).angle_deg, found)
    assert (found.min(), found.max()) == (pytest.approx(-13.2, abs=2.6), pytest.approx(13.2, abs=2.6))
