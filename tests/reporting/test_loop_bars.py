"""Bars of the errors before and after."""

from __future__ import annotations

from typing import Any

import pytest

from bayestouch.reporting.loop_bars import after_in_words, has_errors_of_touches, loop_bars, references_corrected


def diagnosis(*effects: str, **changes: Any) -> dict[str, Any]:
    before = {"prediction_error_percent_peak": 2.0, "lack_of_fit": 4.0, "R_bias_mm": 0.3, "R_rms_mm": 0.8}
    after = {"prediction_error_percent_peak": 1.0, "lack_of_fit": 1.0, "R_bias_mm": 0.0, "R_rms_mm": 0.2}
    found = [{"name": name} for name in effects]
    base = {"before": before, "after": after, "effects": found, "correction": None, "noise_floor_percent_peak": 0.5}
    return {**base, **changes}


def test_lengths_are_in_the_ratio_of_the_errors() -> None:
    bars = loop_bars(diagnosis("gain_drift"))
    assert bars is not None and bars["title"] == "before and after gain drift"
    first, second = bars["groups"]
    assert [(bar["kind"], bar["value"]) for bar in first["bars"]] == [("before", 2.0), ("after", 1.0), ("floor", 0.5)]
    lengths = [bar["percent"] for bar in first["bars"]]
    assert lengths[0] == 60  # leaves room for the number
    assert lengths[1] / lengths[0] == pytest.approx(0.5) and lengths[2] / lengths[0] == pytest.approx(0.25)
    # no bar of a bias, which has a sign, and none of lack of fit, whose least is one
    assert second["quantity"] == "rms error of R" and [bar["value"] for bar in second["bars"]] == [0.8, 0.2]


def test_without_an_effect_there_is_no_after() -> None:
    bars = loop_bars(diagnosis())
    assert bars is not None and bars["title"] == "no effect was found"
    assert [bar["name"] for bar in bars["groups"][0]["bars"]] == ["as calibrated", "noise alone"]


def test_a_correction_without_a_cause_is_named() -> None:
    bars = loop_bars(diagnosis("creep", correction={"sd": 1.0}))
    assert bars is not None and bars["title"] == "before and after creep and a correction"


@pytest.mark.parametrize(
    "found", [diagnosis("creep"), diagnosis("creep", correction={"sd": 1.0}), diagnosis(correction={})]
)
def test_what_is_not_used_is_no_after(found: dict[str, Any]) -> None:
    """The model after is then that before."""
    found |= {"after": found["before"], "calibration_after": {"effects": [], "correction": False}}
    bars = loop_bars(found)
    assert bars is not None and bars["title"] == "nothing that was found is used"
    assert [bar["name"] for bar in bars["groups"][0]["bars"]] == ["as calibrated", "noise alone"]
    assert after_in_words(found) == (
        "Before: the calibrated model alone. After: the same, because nothing that was found is used."
    )


def test_the_effects_that_are_used_are_named() -> None:
    found = diagnosis("creep", "gain_drift", correction={"sd": 1.0})
    found["calibration_after"] = {"effects": ["gain_drift"], "correction": False}
    bars = loop_bars(found)
    assert bars is not None and bars["title"] == "before and after gain drift"
    assert after_in_words(found) == "Before: the calibrated model alone. After: with gain drift."
    found["calibration_after"] = {"effects": ["creep", "gain_drift"], "correction": True}
    stated = found | {"after_against_stated": found["after"] | {"R_rms_mm": 0.9}}
    every = (
        "Before: the calibrated model alone. After: with the effects that were found and a correction without a cause"
    )
    assert after_in_words(found) == f"{every}."
    assert after_in_words(stated) == (
        f"{every}, against references as these correct them; in the last column against references as the data set "
        "states them."
    )
    assert after_in_words(diagnosis()).endswith("After: the same, because no effect was found.")


def test_no_bars_without_a_diagnosis() -> None:
    assert loop_bars(None) is None
    assert loop_bars({"missing": "No effect was searched for."}) is None


def test_the_column_on_stated_references_is_there_where_it_says_something_else() -> None:
    found = diagnosis("load_offset")
    assert not references_corrected(found)  # as in files of 0.1.0
    assert not references_corrected(found | {"after_against_stated": found["after"]})
    assert references_corrected(found | {"after_against_stated": found["after"] | {"R_rms_mm": 0.9}})


def test_a_diagnosis_that_read_touches_has_their_errors() -> None:
    """Errors of the readings alone, of samples or of touch means, are there without reading a touch."""
    readings = {"prediction_error_percent_peak": 2.0, "touch_error_percent_peak": 1.0, "lack_of_fit": 4.0}
    none = readings | dict.fromkeys(("R_rms_mm", "theta_rms_deg", "coverage_90"))
    assert not has_errors_of_touches(diagnosis(before=none, after=none))
    for key in ("R_bias_mm", "theta_rms_deg", "location_rms_mm", "P_rms_N"):
        read = none | {key: 0.5}
        assert has_errors_of_touches(diagnosis(before=read, after=read))
