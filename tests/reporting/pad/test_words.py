"""Sentences at the top of a pad's report, written out."""

from __future__ import annotations

from typing import Any

import pytest

from bayestouch.reporting.pad.words import errors_and_limits, own_answers


def row(where: str, rms: float | None, median: float, touches: int, several: float = 0.0) -> dict[str, Any]:
    return {
        "where": where,
        "touches": touches,
        "distance": {"rms": rms, "median_abs": median},
        "several_modes_percent": several,
    }


def said(*rows: dict[str, Any], copied: float = 0.0, **changes: Any) -> tuple[list[str], list[dict[str, Any]]]:
    load = {"n": 0}
    estimates = {"errors": list(rows), "posterior_sd_mm": 0.123, "spacing_mm": 10.0, "load": load}
    return errors_and_limits({"estimates": estimates | changes, "data": {"copied_percent": copied}})


def test_inside_and_outside() -> None:
    text, key = said(
        row("all", 3.0, 1.0, 50), row("inside the array", 0.5, 0.4, 30), row("outside the array", 4.56, 2.34, 20)
    )
    assert text == [
        "Inside the array of elements, location is read to 0.50 mm rms (1/20 of the element spacing), with a median "
        "error of 0.40 mm, over 30 touches not calibrated with.",
        "Outside it the error is 4.6 mm rms over 20 touches, median 2.3 mm.",
    ]
    assert [(each["quantity"], each["value"]) for each in key] == [
        ("location error, rms, inside the array", 0.5),
        ("location error, rms, outside", 4.56),
    ]


def test_all_outside() -> None:
    text, _ = said(row("all", 5.0, 4.0, 1), row("outside the array", 5.0, 4.0, 1), spacing_mm=None)
    assert text == ["Location is read to 5 mm rms, with a median error of 4 mm, over 1 touch not calibrated with."]


@pytest.mark.parametrize(("copied", "which"), [(10.0, "some"), (100.0, "all")])
def test_copies_of_calibration_touches_were_calibrated_with(copied: float, which: str) -> None:
    text, _ = said(row("all", 3.0, 2.0, 50), copied=copied)
    assert text[0].endswith(f"over 50 touches to be read ({which} were calibrated with).")


@pytest.mark.parametrize(("median", "few"), [(1.0, False), (0.99, True)])
def test_few_touches_that_carry_the_error(median: float, few: bool) -> None:
    """An rms of more than three medians."""
    text, _ = said(row("all", 3.0, median, 50))
    assert any(line.startswith("Few touches carry most of that error") for line in text) == few


@pytest.mark.parametrize(("several", "told"), [(0.049, False), (0.05, True)])
def test_several_places(several: float, told: bool) -> None:
    text, _ = said(row("all", 3.0, 2.0, 50, several))
    assert any("names more than one separate place" in line for line in text) == told


def test_load_and_missing_references() -> None:
    load = {"n": 3, "rms": 0.5, "rms_percent": 9.94, "unit": "N"}
    text, key = said(row("all", 3.0, 2.0, 50), load=load)
    assert text[-1].endswith("load is read to 0.50 N rms (9.9 % of the mean load).") and key[-1]["value"] == 0.5
    text, key = said()
    assert "the location of a typical touch to 0.12 mm" in text[0] and key[0]["value"] == 0.123


def test_where() -> None:
    best, worst = {"x_mm": 1.24, "y_mm": -3.0, "error_mm": 0.123}, {"x_mm": 9.96, "error_mm": 4.56}
    places = {"best": best, "worst": worst, "within": "the calibrated region", "use_load": True}
    predicted = (
        "Predicted from the calibration, for touches with a measured load: location to 0.12 mm at the best place and "
        "4.6 mm at the worst, within the calibrated region."
    )
    for several, more in (
        (49.0, ""),
        (
            63.3,
            " At 63 % of touches more than one separate place fits the readings: this is the error about one of them.",
        ),
    ):
        (row_,) = own_answers({"places": places, "estimates": {"several_modes_percent": several}})
        assert row_["short"] == "Best at x = 1.2, y = −3.0 mm, worst at x = 10.0 mm"
        assert row_["reason"] == predicted + more
    (row_,) = own_answers({"places": places | {"use_load": False}, "estimates": {"several_modes_percent": 0.0}})
    assert "for touches without a measured load: " in row_["reason"]
