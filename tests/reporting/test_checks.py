"""Model checks of a report: ranks of readings that are left out, and sensitivity to the prior, in closed form."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from posterior_cases import calibration, touches
from scipy.stats import binom, norm

from bayestouch.reporting import check_pictures, checks
from bayestouch.reporting.checks import left_out_ranks, predictive_check, prior_sensitivity
from bayestouch.reporting.page import new_environment
from bayestouch.results.objects import TouchPosteriors


def read(t: int, m: int, wrong: float = 1.0, seed: int = 1) -> TouchPosteriors:
    """Touches whose m readings have a common unknown mean and noise of sd one; the first element has more of it.

    The posterior of the mean under a flat prior is normal about the mean of the readings, with variance 1/m.
    """
    rng = np.random.default_rng(seed)
    observed = rng.normal(size=(t, 1)) + rng.normal(size=(t, m)) * np.where(np.arange(m) == 0, wrong, 1.0)
    mean = observed.mean(axis=1) + rng.normal(size=(4, 500, t)) / np.sqrt(m)
    again = mean[..., None] + rng.normal(size=(4, 500, t, m))
    log = norm(mean[..., None], 1).logpdf(observed)
    result = touches()
    rows = replace(result.rows, observed=observed)
    groups = {"log_likelihood": {"reading": log}, "posterior_predictive": {"reading": again}}
    return replace(result, rows=rows, groups=groups)


def test_ranks_are_those_of_a_fit_without_the_reading() -> None:
    """Without it, a reading is normal about the mean of the others with variance ``1 + 1/(m - 1)``."""
    result = read(12, 6)
    observed = result.rows.observed.copy()
    observed[3, 2] = np.nan
    log, again = result.groups["log_likelihood"]["reading"], result.groups["posterior_predictive"]["reading"]
    rank = left_out_ranks(observed, again, log)
    others = (result.rows.observed.sum(axis=1, keepdims=True) - result.rows.observed) / 5
    expected = norm(others, np.sqrt(1 + 1 / 5)).cdf(result.rows.observed)
    assert np.isnan(rank[3, 2])
    # 2,000 weighted draws, of which more than 700 count
    np.testing.assert_allclose(np.delete(rank, 20), np.delete(expected, 20), atol=0.06)


def test_an_element_with_more_noise_than_stated_is_named() -> None:
    right, wrong = (predictive_check(read(150, 6, wrong=size)) for size in (1.0, 2.0))
    assert right is not None and wrong is not None
    assert right["readings"] == 900 and right["percent_inside_90"] == pytest.approx(90, abs=3)
    assert right["too_often_outside"] == [] == right["too_often_inside"]
    assert wrong["too_often_outside"] == ["e01"]
    (picture,) = check_pictures.check_pictures(shown(wrong, 6))
    assert "for 6 elements: from " in picture.alt and "1 element is outside too often" in picture.alt


def shown(check: dict[str, Any], m: int) -> dict[str, Any]:
    """Numbers of a report with this predictive check, of a sensor with m elements."""
    elements = {"rows": [{"element": f"e{e + 1:02d}"} for e in range(m)]}
    return {"checks": {"predictive": check}, "calibration": {"elements": elements}}


def test_dots_are_at_their_own_element_beside_one_without_readings(monkeypatch: pytest.MonkeyPatch) -> None:
    inside = {"e01": 91.1, "e02": 95.6, "e04": 88.9}
    limits = {"expected_low": 75.0, "expected_high": 100.0}
    rows = [{"element": name, "percent_inside": {"90": each}, **limits} for name, each in inside.items()]
    drawn: list[dict[str, float]] = []

    def look(figure: Any) -> bytes:
        (axes,) = figure.axes
        names = {tick: label.get_text() for tick, label in zip(axes.get_xticks(), axes.get_xticklabels(), strict=True)}
        assert list(names.values()) == ["e01", "e02", "e03", "e04", "e05"]
        drawn.append({names[x]: y for x, y in axes.lines[0].get_xydata().tolist()})
        drawn.append({names[bar.get_x() + bar.get_width() / 2]: bar.get_height() for bar in axes.patches})
        return b""

    monkeypatch.setattr(check_pictures, "rendered", look)
    check = {"by_element": rows, "too_often_outside": []}
    list(check_pictures.check_pictures(shown(check, 5)))
    assert drawn == [inside, dict.fromkeys(inside, 25.0)]


def test_a_check_that_is_not_possible_is_left_out() -> None:
    assert predictive_check(touches()) is None and prior_sensitivity(calibration()) is None
    assert list(check_pictures.check_pictures({"checks": {"predictive": None}})) == []


def test_the_only_reading_of_a_touch_is_predicted_by_no_other() -> None:
    assert predictive_check(read(30, 1)) is None
    result = read(12, 3)
    observed = result.rows.observed.copy()
    observed[3, 1:] = np.nan
    found = predictive_check(replace(result, rows=replace(result.rows, observed=observed)))
    assert found is not None and found["readings"] == 33


@pytest.mark.parametrize(
    ("others", "said"),
    [
        (
            False,
            "There is no predictive check: no touch has a second reading, from which the first could be predicted.",
        ),
        (True, "There is no predictive check: predicted readings of so many touches do not fit into memory."),
    ],
)
def test_a_page_says_why_there_is_no_predictive_check(others: bool, said: str) -> None:
    numbers = {"checks": {"predictive": None, "prior_sensitivity": None, "others_read": others}, "figures": []}
    page = new_environment(numbers, []).get_template("checks.html").render()
    assert said in page and page.count("There is no predictive check") == 1


def test_the_prior_that_decides_is_told_from_the_touches_that_decide() -> None:
    """Normal prior and likelihood of one parameter; where the likelihood is flat, the prior decides."""
    rng = np.random.default_rng(2)
    found = {}
    for case, sd in (("touches", 0.05), ("prior", 20.0)):
        precision = 1 + 1 / sd**2
        sigma = 0.3 / sd**2 / precision + rng.normal(size=(4, 500)) / np.sqrt(precision)
        groups = {
            "log_likelihood": {"whole_touch": np.repeat(norm(sigma, sd).logpdf(0.3)[..., None], 6, axis=2) / 6},
            "log_prior": {"sigma": norm(0, 1).logpdf(sigma)},
        }
        result = replace(calibration(), posterior={"sigma": sigma}, groups=groups)
        sensitivity = prior_sensitivity(result)
        assert sensitivity is not None
        (found[case],) = sensitivity["parameters"]
    assert found["touches"]["prior"] < 0.02 and found["touches"]["likelihood"] > 0.05
    assert found["touches"]["finding"] == "the touches decide"
    assert found["prior"]["finding"] == "the prior decides" and found["prior"]["likelihood"] < 0.05


@pytest.mark.parametrize("n", [45, 54, 599])
def test_as_many_readings_inside_as_a_limit_are_not_unlikely(monkeypatch: pytest.MonkeyPatch, n: int) -> None:
    """Numbers are compared: as percentages the two may differ by rounding."""
    fewest, most = binom(n, 0.9).ppf([0.00125, 0.99875]).astype(int)
    ranks = np.zeros((n, 4))
    for column, inside in enumerate((fewest, fewest - 1, most, min(most + 1, n))):
        ranks[:inside, column] = 0.5
    monkeypatch.setattr(checks, "left_out_ranks", lambda *given: ranks)
    found = predictive_check(read(3, 4))
    assert found is not None and found["too_often_outside"] == ["e02"]
    assert found["too_often_inside"] == (["e04"] if most < n else [])
