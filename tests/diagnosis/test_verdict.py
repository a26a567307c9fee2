"""The sentence of a verdict, and the numbers beside it, never contradict each other."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from pad_simulation import SimulatedPad
from scipy import stats

import bayestouch
from bayestouch.chain.kernels import GaussianKernel
from bayestouch.chain.pad import PadChain
from bayestouch.diagnosis.outcome import sentences, worse_quantities
from bayestouch.diagnosis.verdict import LackOfFit, Remaining, lack_of_fit, null_moments, verdict
from bayestouch.reporting.page import before_after
from bayestouch.reporting.verdict import _fix

WITHIN = "as well as the noise allows"
ERRORS = {
    "prediction_error_percent_peak": 0.5,
    "lack_of_fit": 1.02,
    "R_bias_mm": 0.02,
    "R_rms_mm": 0.2,
    "theta_rms_deg": 0.03,
    "P_rms_N_per_m": 1.3,
    "coverage_90": 0.9,
}


def numbers(word: str = "explained", **changes: Any) -> dict[str, Any]:
    """What a diagnosis says, made up: the errors halve, and what is changed."""
    after = ERRORS | changes.pop("after", {})
    before = {key: None if value is None else 2 * value for key, value in ERRORS.items()} | changes.pop("before", {})
    limits = {"low": 0.9, "high": 1.1, "expected": 1.0}
    return {
        "data": {"held_out_touches": 100},
        "noise_floor_percent_peak": 0.5,
        "noise_from_repeats": True,
        "loads_measured": True,
        "before": after if word == "adequate" else before,
        "after": after,
        "after_against_stated": after,
        "change_against_stated_se": dict.fromkeys(ERRORS, 0.01),
        "lack_of_fit_limits": {"before": limits, "after": limits},
        "verdict": word,
        "effects": [],
        "unexplained": {"fraction": 0.4, "where": "everywhere"},
        "correction": None,
        "measure": None,
    } | changes


@pytest.mark.parametrize("word", ["adequate", "explained"])
@pytest.mark.parametrize(
    ("changes", "within", "said"),
    [
        ({}, True, "1.02 (0.90 to 1.10 if nothing is missing)"),
        ({"after": {"lack_of_fit": 1.5}}, False, "structure remains|the model has an error"),
        ({"after": {"lack_of_fit": 0.2}}, False, "less than the noise that is assumed"),
        ({"noise_from_repeats": False, "noise_floor_percent_peak": None}, False, "not known from repeats"),
        ({"after": {"lack_of_fit": None}, "loads_measured": False}, False, "loads were not measured"),
        ({"after": dict.fromkeys(ERRORS), "data": {"held_out_touches": 0}}, False, "none were held out"),
        (
            {
                "lack_of_fit_limits": {"after": {"low": 1.2, "high": 1.6, "expected": 1.4}},
                "after": {"lack_of_fit": 1.4},
            },
            False,
            "what its fit leaves open",
        ),
    ],
)
def test_the_sentence_follows_the_numbers(word: str, changes: dict[str, Any], within: bool, said: str) -> None:
    lines = sentences(numbers(word, **{key: dict(v) if isinstance(v, dict) else v for key, v in changes.items()}))
    assert (WITHIN in lines[0]) == within
    assert any(part in "\n".join(lines) for part in said.split("|"))


def test_numbers_of_an_earlier_version_are_told_as_honestly() -> None:
    """Without limits, and with a word that no longer fits."""
    kept = ("data", "before", "after", "verdict", "effects", "unexplained", "correction", "measure")
    old = {key: value for key, value in numbers(after={"lack_of_fit": 1.49}).items() if key in kept}
    lines = sentences(old | {"noise_floor_percent_peak": 0.4})
    assert lines[0].startswith("Partly explained") and WITHIN not in "".join(lines)


def test_a_worse_radius_comes_first() -> None:
    stated = ERRORS | {"R_rms_mm": 0.45}
    lines = sentences(numbers(after_against_stated=stated))
    assert lines[0].startswith("Worse than before") and "rms error of R 0.40 → 0.45 mm" in lines[0]
    assert "prediction error" not in lines[0] and "references are off" in lines[0]
    assert lines[1].startswith("Explained")
    # The errors against stated references are told as a whole, too.
    assert any(line.startswith("Against references as the data set states them") for line in lines)


@pytest.mark.parametrize(("error", "worse"), [(0.02, True), (0.03, False)])
def test_worse_is_beyond_two_standard_errors(error: float, worse: bool) -> None:
    """0.40 to 0.45 mm."""
    made = numbers(after={"R_rms_mm": 0.45}, change_against_stated_se={"R_rms_mm": error})
    assert sentences(made)[0].startswith("Worse than before") == worse


@pytest.mark.parametrize(("before", "after", "worse"), [(0.9, 0.96, False), (1.02, 1.09, False), (1.05, 1.3, True)])
def test_a_lack_of_fit_within_its_limits_is_not_worse(before: float, after: float, worse: bool) -> None:
    """0.90 to 1.10 if nothing is missing."""
    lines = sentences(numbers(before={"lack_of_fit": before}, after={"lack_of_fit": after}))
    assert any("lack of fit" in line for line in lines if line.startswith("Worse than before")) == worse


def test_errors_of_samples_and_of_touch_means_are_named_where_they_differ() -> None:
    one = numbers(before={"touch_error_percent_peak": 1.0}, after={"touch_error_percent_peak": 0.5})
    assert "touch means" not in "".join(sentences(one)) and "of samples" not in "".join(sentences(one))
    two = numbers(before={"touch_error_percent_peak": 0.6}, after={"touch_error_percent_peak": 0.7})
    lines = sentences(two)
    assert "prediction error of touch means 0.60 → 0.70 % of the peak" in lines[0] and "Worse" in lines[0]
    assert "prediction error of samples 1.00 → 0.50 % of the peak" in lines[-1]
    names = [row["quantity"] for row in before_after(two)]
    assert names[:2] == ["prediction error of samples", "prediction error of touch means"]


def test_a_correction_is_not_counted_as_what_the_effect_does() -> None:
    """The effect lowers the error from 1.0 to 0.8 %; a correction without a cause on top of it to 0.5 %."""
    corrected = {"before": ERRORS | {"prediction_error_percent_peak": 0.8}, "after": ERRORS}
    found = numbers("partly explained", effects=[{"name": "crosstalk"}], correction=corrected)
    assert "(1 % of the peak falls to 0.80 %)" in _fix({"diagnosis": found, "next": []})["reason"]


def test_a_bias_is_worse_on_either_side() -> None:
    made = numbers(before={"R_bias_mm": 0.02}, after={"R_bias_mm": -0.1})
    assert "bias of R +0.02 → -0.10 mm" in sentences(made)[0]


def test_null_distribution_of_the_lack_of_fit() -> None:
    """Residuals with what the fit leaves open, drawn: mean, spread and limits."""
    rng = np.random.default_rng(3)
    n, q, draws, pure = 300, 12, 20_000, 400.0
    design = rng.standard_normal((n, q)) * rng.uniform(0.05, 0.5, q)
    residual = rng.standard_normal((draws, n)) + rng.standard_normal((draws, q)) @ design.T
    square = (residual**2).mean(axis=1)
    expected, freedom = null_moments(design, n)
    # Means of 20 000 draws are good to 0.1 %, standard deviations to 0.5 %, which the heavier tails double.
    assert expected == pytest.approx(square.mean(), rel=0.005)
    assert expected * np.sqrt(2 / freedom) == pytest.approx(square.std(), rel=0.02)
    ratio = square / (rng.chisquare(pure, draws) / pure)
    test = LackOfFit.of(1.0, expected, freedom, pure, held_out=True)
    assert test.high == pytest.approx(expected * stats.f.ppf(0.995, freedom, pure))
    # 1 % of 20 000 is 200 ± 14.
    outside = np.mean((ratio < min(test.low, 1)) | (ratio > test.high))
    assert 0.006 < outside < 0.014


def test_what_a_drift_excuses_is_limited_in_mean_and_spread() -> None:
    """A tenth of the noise: with 60 unknown directions of equal size s, 60 s² is a tenth of 3200 readings."""
    n, q = 3200, 60
    axes = np.linalg.qr(np.random.default_rng(0).standard_normal((n, q)))[0]
    known = SimpleNamespace(means=SimpleNamespace(pure_error_dof=np.array([1700.0])))
    drifting: Any = SimpleNamespace(drifts=("drift",), model=SimpleNamespace(known=known))
    held: Any = SimpleNamespace(design=40 * axes, freedom=float(n), mean_square=1.0)
    found = lack_of_fit(drifting, held)
    square = 0.1 * n / q
    freedom = (1.1 * n) ** 2 / (n + 2 * 0.1 * n + q * square**2)
    assert found.expected == pytest.approx(1.1)
    assert found.high == pytest.approx(1.1 * stats.f.ppf(0.995, freedom, 1700.0))
    # What is below the limit is as it is, and so is a model without drifts.
    drifting.drifts = ()
    assert lack_of_fit(drifting, held).expected == pytest.approx(1 + q * 1600 / n)
    held.design = 0.5 * axes
    assert lack_of_fit(drifting, held).high < 1.13
    plain = lack_of_fit(drifting, held)
    drifting.drifts = ("drift",)
    assert lack_of_fit(drifting, held) == plain


@pytest.mark.parametrize(
    ("ratio", "word"), [(1.015, "explained"), (1.018, "partly explained"), (1.09, "partly explained")]
)
def test_explained_is_within_99_percent_of_what_is_right(ratio: float, word: str) -> None:
    """With 100 000 readings and as many repeats, F has an sd of √(2/10⁵ + 2/10⁵) = 0.0063; 2.58 of these are 0.0163."""
    test = LackOfFit.of(ratio, 1.0, 1e5, 1e5, held_out=True)
    # The next term of the distribution, which is not symmetric, is about the square.
    assert (test.low, test.high) == pytest.approx((1 - 0.0163, 1 + 0.0163), abs=3e-4)
    assert verdict(1, Remaining(test, test), test) == word
    # What is returned may be another model than what was found; both must be within.
    right = LackOfFit.of(1.0, 1.0, 1e5, 1e5, held_out=True)
    assert verdict(1, Remaining(test, right), test) == word and verdict(1, Remaining(right, test), right) == word


def one_element(samples: int, *, measured: bool, spread: float) -> bayestouch.Diagnosis:
    """A pad of one element whose loads scatter."""
    chain = PadChain(GaussianKernel(6.0), np.array([2.5]), np.array([10.0]), np.array([0.5]), np.array([[10.3]]))
    pad = SimulatedPad(chain, np.array([[0.0]]), floor=0.01, share=0.0, load_spread=spread)
    rng = np.random.default_rng(0)
    table = pad.touch(rng.uniform(4, 17, (120, 1)), rng, samples=samples, measured=measured)
    return bayestouch.diagnose(replace(pad.dataset(table), calibration=None), kernel="gaussian", sample=False)


def test_loads_that_nobody_measured_are_no_noise_that_repeats_tell() -> None:
    """They scatter by 4 %: errors of 2 % stand beside no floor of 0.06 %, and nothing is said to be within the noise.

    The scatter of the loads, found in what the calibration leaves, was counted as the noise of samples: with nine of
    them the lack of fit was 0.2.
    """
    diagnosis = one_element(9, measured=False, spread=0.04)
    before = diagnosis.numbers["before"]
    assert before["prediction_error_percent_peak"] > 1
    assert diagnosis.numbers["noise_floor_percent_peak"] is None and before["lack_of_fit"] is None
    assert WITHIN not in str(diagnosis) and "the loads were not measured" in str(diagnosis)


def test_floor_and_lack_of_fit_of_one_element_have_one_yardstick() -> None:
    """Loads are measured, better than is assumed: errors are below the floor where the lack of fit is below one."""
    diagnosis = one_element(3, measured=True, spread=0.2)
    error, floor = (
        diagnosis.numbers["before"]["prediction_error_percent_peak"],
        diagnosis.numbers["noise_floor_percent_peak"],
    )
    assert diagnosis.numbers["before"]["lack_of_fit"] < 0.5 and error < 0.7 * floor
    assert "less than the noise that is assumed" in str(diagnosis)


@pytest.mark.slow
def test_the_papers_finger_whose_maps_are_off_errs_in_place(monkeypatch: pytest.MonkeyPatch) -> None:
    """In the order of a scan a drift follows it from touch to touch; functions of place predict it better.

    With them, held-out touches are within the noise, and R is read better.
    """
    monkeypatch.setattr(sys, "path", [str(Path(__file__).parents[2] / "studies"), *sys.path])
    from nicolson_fearing.paper_design import paper_design, with_map_errors

    design = paper_design(touch_radii_mm=(1.59, 6.01, 12.3, 25.25), gain_spread=0.3, depth_spread_mm=0.2)
    data = with_map_errors(bayestouch.simulate(design, seed=1), 2.06, 1)
    diagnosis = bayestouch.diagnose(data, draws=64)
    numbers = diagnosis.numbers
    assert diagnosis.verdict == "unattributed" and not diagnosis.effects
    assert "Something smooth in place" in str(diagnosis) and WITHIN not in str(diagnosis)
    (faced,) = numbers["rounds"][0]["place_or_time"]
    assert faced["drift"] == "baseline_drift"
    assert all(each["probability"] < 0.01 for each in faced["across"].values())
    assert all(each["elpd_gain"] > 5 * each["elpd_gain_se"] for each in numbers["in_place"].values())
    assert numbers["not_distinguishable"] == []
    before, after, limits = numbers["before"], numbers["after"], numbers["lack_of_fit_limits"]["after"]
    assert before["lack_of_fit"] > 10 and limits["low"] < after["lack_of_fit"] < 1.1
    assert after["R_rms_mm"] < 0.75 * before["R_rms_mm"]


def test_the_reports_page_tells_what_got_worse_and_both_references() -> None:
    stated = ERRORS | {"R_rms_mm": 0.45}
    found = numbers(after_against_stated=stated, effects=[{"name": "blunt_edge"}])
    (row,) = (row for row in before_after(found) if row["quantity"] == "rms error of R")
    assert (row["before"], row["after"], row["after_against_stated"]) == (0.4, 0.2, 0.45)
    told = _fix({"diagnosis": found, "next": []})
    assert told["reason"].startswith("Worse than before") and "lowers" not in told["reason"]
    (load,) = (row for row in before_after(found) if "P" in row["quantity"])
    assert "without the force sensor" in load["quantity"]
    adequate = numbers("adequate", after={"lack_of_fit": 0.2})
    assert WITHIN not in _fix({"diagnosis": adequate, "next": []})["reason"]


def test_nothing_is_called_worse_in_a_file_of_version_0_1() -> None:
    """It has no standard errors, and its loads were read with the force sensor's help."""
    made = numbers(after={"R_rms_mm": 0.9})
    assert worse_quantities(made)
    del made["change_against_stated_se"]
    assert not worse_quantities(made)


def test_held_out_touches_that_show_nothing_leave_the_test_to_those_of_the_fit() -> None:
    """A ratio of 300/(102 - 2) on the touches of the fit, where the loads of the others take all their readings.

    If the fit has no measured load either, nothing is tested: its touches are no better than those that were held out.
    """
    known = SimpleNamespace(means=SimpleNamespace(pure_error_dof=np.array([400.0])), load=np.array([np.nan, 2.0]))
    model = SimpleNamespace(known=known, n_base=2)
    fitted: Any = SimpleNamespace(drifts=(), model=model, n_readings=102, chi_square=lambda: 300.0)
    held: Any = SimpleNamespace(design=np.zeros((4, 0)), freedom=0.0, mean_square=np.nan)
    found = lack_of_fit(fitted, held)
    assert found.ratio == pytest.approx(3.0) and not found.held_out
    assert found == lack_of_fit(fitted, None)
    assert verdict(0, Remaining(found, found), found) == "unattributed"
    known.load = np.full(2, np.nan)
    found = lack_of_fit(fitted, held)
    assert np.isnan(found.ratio) and found.held_out
