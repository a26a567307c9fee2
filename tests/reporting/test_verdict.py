"""The first row of a report follows the verdict of the diagnosis, where one was made."""

from __future__ import annotations

from typing import Any

import pytest

from bayestouch.diagnosis.outcome import VERDICTS
from bayestouch.reporting.answer import _intervals
from bayestouch.reporting.verdict import _fix, _gain, _trusted

LIMITS = {"low": 0.9, "high": 1.1, "expected": 1.0}


def diagnosis(word: str, *effects: str, lack_of_fit: float = 1.0) -> dict[str, Any]:
    return {
        "verdict": word,
        "effects": [{"name": name} for name in effects],
        "data": {"held_out_touches": 100},
        "before": {"lack_of_fit": lack_of_fit},
        "after": {"lack_of_fit": lack_of_fit},
        "noise_floor_percent_peak": 0.5,
        "lack_of_fit_limits": {"after": LIMITS},
        "correction": None,
    }


def numbers(found: dict[str, Any] | None, *, lack_of_fit: float | None, inside: float | None = 90.0) -> dict[str, Any]:
    """Numbers of a report with as many of 2000 touches inside their 90 % intervals."""
    row = {"parameter": "x", "touches": 2000, "percent_inside": {"90": inside}, "se_90": 0.67}
    return {
        "data": {"copied_percent": 0.0},
        "trust": {"coverage": [] if inside is None else [row]},
        "calibration": {"lack_of_fit": lack_of_fit, "error_percent_peak": 0.8},
        "diagnosis": found,
        "next": [],
    }


MISSES = "Yes, though the model has an error"


@pytest.mark.parametrize(
    ("found", "lack_of_fit", "short", "said"),
    [
        (None, 1.0, "Yes", None),
        (None, 1.4, MISSES, "The model has a larger error than noise explains."),
        ({"missing": "No effect was searched for."}, 1.4, MISSES, "The model has a larger error than noise explains."),
        # The fit misses its own touches, but the test on held-out touches decides.
        (diagnosis("adequate"), 1.4, "Yes", "Verdict of the diagnosis: adequate."),
        (diagnosis("explained", "creep"), 1.0, MISSES, "Verdict of the diagnosis: explained by creep."),
        (
            diagnosis("partly explained", "creep", "load_scale"),
            None,
            MISSES,
            "Verdict of the diagnosis: partly explained by creep and load scale.",
        ),
        (diagnosis("unattributed"), 1.0, MISSES, "that no known effect explains."),
        # A file of an earlier version, with a word that its lack of fit contradicts.
        (diagnosis("adequate", lack_of_fit=1.5), 1.0, MISSES, "Verdict of the diagnosis: unattributed"),
    ],
)
def test_the_first_row_agrees_with_the_diagnosis(
    found: dict[str, Any] | None, lack_of_fit: float | None, short: str, said: str | None
) -> None:
    row = _trusted(numbers(found, lack_of_fit=lack_of_fit))
    assert row["short"] == short
    rest = row["reason"].partition("touches).")[2].strip()
    assert said in rest if said else rest == ""
    assert rest.count(".") == (1 if said else 0)


@pytest.mark.parametrize(("inside", "short"), [(87.0, "With care"), (70.0, "Not as stated"), (None, "Not shown by")])
def test_the_verdict_is_there_whatever_the_coverage_is(inside: float | None, short: str) -> None:
    for word in VERDICTS:
        row = _trusted(numbers(diagnosis(word), lack_of_fit=1.0, inside=inside))
        assert row["short"].startswith(short)
        assert f"Verdict of the diagnosis: {word}" in row["reason"]


@pytest.mark.parametrize("found", [None, diagnosis("adequate")])
@pytest.mark.parametrize(("error", "nothing"), [(1608.0, True), (101.0, True), (99.0, False), (None, False)])
def test_a_model_that_explains_nothing_is_not_trusted(
    found: dict[str, Any] | None, error: float | None, nothing: bool
) -> None:
    """However often its intervals, which are as wide as the finger, hold the reference: zero would be nearer."""
    made = numbers(found, lack_of_fit=9645.0)
    made["calibration"]["error_percent_peak"] = error
    row = _trusted(made)
    assert (row["short"] == "No, the model does not fit") == nothing
    assert row["short"].startswith("Yes") != nothing
    assert ("wrong by 1608 % of what an element reads at its peak" in row["reason"]) == (error == 1608.0)
    assert _intervals(made)[0].endswith("so the stated uncertainties can be trusted.") != nothing


@pytest.mark.parametrize(("copied", "shown"), [(100.0, False), (51.0, False), (49.0, True)])
def test_copies_of_calibration_touches_show_nothing(copied: float, shown: bool) -> None:
    made = numbers(None, lack_of_fit=1.0)
    made["data"]["copied_percent"] = copied
    row = _trusted(made)
    assert row["short"] == ("Yes" if shown else "Not shown by these data")
    assert (f"{copied:.0f} % of the touches to be read are copies" in row["reason"]) != shown


def test_the_last_row_has_the_same_verdict() -> None:
    """What is fixed first is not said to be nothing where the lack of fit says that something is missing."""
    beyond = numbers(diagnosis("adequate", lack_of_fit=1.5), lack_of_fit=1.0)
    assert _fix(beyond)["short"] == "Something that no known effect explains"
    assert _fix(numbers(diagnosis("adequate"), lack_of_fit=1.0))["short"] == "Nothing in the model"


@pytest.mark.parametrize("word", ["unattributed", "adequate", "explained"])
def test_what_is_read_worse_is_on_the_first_screen(word: str) -> None:
    """An error of R of 0.21 mm after 0.20 mm, with a standard error of their difference of 0.001 mm."""
    found = diagnosis(word, *(("creep",) if word == "explained" else ())) | {
        "change_against_stated_se": {"R_rms_mm": 1e-3}
    }
    found["before"]["R_rms_mm"], found["after"]["R_rms_mm"] = 0.20, 0.21
    found["unexplained"] = {"where": "nowhere"}
    worse = "Worse than before, against references as the data set states them: rms error of R 0.20 → 0.21 mm."
    assert worse in _fix(numbers(found, lack_of_fit=1.0))["reason"]


@pytest.mark.parametrize("word", ["unattributed", "adequate"])
def test_a_correction_that_is_not_used_is_on_the_first_screen_once(word: str) -> None:
    refused = {
        "effects": [],
        "correction": True,
        "references_corrected": False,
        "worse": {"R_rms_mm": {"before": 0.20, "after": 0.25, "touches": ""}},
    }
    found = diagnosis(word) | {"not_used": [refused], "unexplained": {"where": "nowhere"}}
    found["calibration_after"] = {"effects": [], "correction": False}
    reason = _fix(numbers(found, lack_of_fit=1.0))["reason"]
    assert reason.count("Not used for reading: a correction by element and location.") == 1


@pytest.mark.parametrize("effects", [(), ("creep",)])
def test_no_touch_was_held_out(effects: tuple[str, ...]) -> None:
    """Nothing was tested: neither a cause nor "nothing" is to be fixed, and no error on held-out touches is stated."""
    found = diagnosis("explained" if effects else "adequate", *effects) | {"data": {"held_out_touches": 0}}
    row = _fix(numbers(found, lack_of_fit=1.0))
    assert row["short"] == "Too few touches to say"
    assert ("creep" in row["reason"]) == bool(effects) and "lowers" not in row["reason"]
    assert "Verdict of the diagnosis: too few touches to say" in _trusted(numbers(found, lack_of_fit=1.0))["reason"]


@pytest.mark.parametrize(
    ("data", "short", "why"),
    [
        ({}, "Too few touches to say", "None were held out, so that nothing was tested."),
        ({"unreferenced": False}, "Too few touches to say", "None were held out, so that nothing was tested."),
        ({"unreferenced": True}, "Not tested", "No touch to be read has references, so that none was held out."),
    ],
)
def test_why_nothing_was_tested_is_said_once(data: dict[str, bool], short: str, why: str) -> None:
    """On the first screen the reason follows the short answer."""
    found = diagnosis("adequate") | {"data": {"held_out_touches": 0, **data}}
    row = _fix(numbers(found, lack_of_fit=1.0))
    assert (row["short"], row["reason"]) == (short, f"{why} By the touches of the fit alone: adequate.")
    said = f"Verdict of the diagnosis: {short.lower()}, adequate by the touches of the fit alone."
    assert said in _trusted(numbers(found, lack_of_fit=1.0))["reason"]


def test_prediction_errors_are_stated_to_two_digits() -> None:
    """More digits than two would be noise; one would hide what a small effect gains."""
    found = {
        "before": {"prediction_error_percent_peak": 3.14159},
        "after": {"prediction_error_percent_peak": 1.2345},
        "correction": None,
    }
    assert _gain(found) == "lowers the prediction error on held-out touches (3.1 % of the peak falls to 1.2 %)"


@pytest.mark.parametrize(("before", "after"), [(1.201, 1.199), (1.2, 1.3)])
def test_an_error_that_did_not_become_smaller_is_not_lowered(before: float, after: float) -> None:
    stands = [{"prediction_error_percent_peak": each} for each in (before, after)]
    said = _gain({"before": stands[0], "after": stands[1], "correction": None})
    assert said.startswith("does not lower the prediction error on held-out touches (1.2 % of the peak before, 1.")
    assert said.endswith(" % after)")


def rows(**of: tuple[float, int]) -> list[dict[str, Any]]:
    return [
        {
            "parameter": name,
            "percent_inside": {"90": share},
            "se_90": 100 * (0.09 / n) ** 0.5,
            "touches": n,
        }
        for name, (share, n) in of.items()
    ]


def test_a_region_stands_for_both_coordinates() -> None:
    """The sentences and the first answer then judge the same rows."""
    found = numbers(None, lack_of_fit=1.0)
    found["trust"]["coverage"] = rows(x=(80.0, 400), y=(91.0, 400), P=(90.0, 400), region=(90.0, 400))
    assert _trusted(found)["short"] == "Yes"
    assert "the stated uncertainties can be trusted" in _intervals(found)[0]


def test_a_parameter_with_few_touches_does_not_hide_the_others() -> None:
    found = numbers(None, lack_of_fit=1.0)
    found["trust"]["coverage"] = rows(theta_c=(50.0, 400), R=(83.0, 6))
    assert _trusted(found)["short"] == "Not as stated" and "least: 50 %, 400 touches" in _trusted(found)["reason"]
    found["trust"]["coverage"] = rows(R=(83.0, 6))
    assert _trusted(found)["short"] == "Too few touches to say"


def test_the_parameter_that_decides_is_named() -> None:
    """80 % of 12 touches may be chance; 83 % of 1,000 are not, though they are more."""
    found = numbers(None, lack_of_fit=1.0)
    found["trust"]["coverage"] = rows(R=(80.0, 12), theta_c=(83.0, 1000))
    row = _trusted(found)
    assert (
        row["short"] == "Not as stated" and "for its number of touches the worst: 83 %, 1000 touches" in row["reason"]
    )
    found["trust"]["coverage"] = rows(R=(80.0, 12))
    assert _trusted(found)["short"] == "Yes"


def test_few_touches_are_a_sentence_too() -> None:
    few = numbers(None, lack_of_fit=1.0)
    few["trust"]["coverage"][0] |= {"touches": 5, "percent_inside": {"90": 80.0}}
    row = _trusted(few)
    assert row["short"] == "Too few touches to say"
    assert row["reason"].startswith(
        "80 % of the stated 90 % intervals hold the reference; 5 touches cannot show whether that is as often as"
    )
