"""Touches that the interactive figures show: an even selection of many, all of a few."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from posterior_cases import touches

from bayestouch.reporting.touch_list import about_touches


def evidence(count: int) -> Any:
    rows = SimpleNamespace(
        touch=np.arange(count),
        radius_mm=np.zeros(count),
        observed=np.ones((count, 1)),
        predicted=np.zeros((count, 1)),
        sd=np.ones((count, 1)),
    )
    posterior = {name: np.zeros((1, 2, count)) for name in ("x", "P")}
    return SimpleNamespace(posteriors=SimpleNamespace(rows=rows, posterior=posterior, parameters=()))


@pytest.mark.parametrize(("count", "shown"), [(3, 3), (480, 480), (961, 480)])
def test_shown_touches_reach_from_the_first_to_the_last(count: int, shown: int) -> None:
    found = about_touches(evidence(count))
    assert found["of"] == count
    assert len(found["touch"]) == len(found["indenter"]) == len(found["residuals"]) == shown
    assert found["touch"][0] == 0 and found["touch"][-1] == count - 1
    # one of two, or the one after it where rounding says so
    assert np.diff(found["touch"]).max() <= -(-(count - 1) // (shown - 1))


def test_a_reference_of_350_degrees_is_one_of_minus_10() -> None:
    found = touches()
    about = found.mean("theta_c")
    turned = replace(
        found, reference={**found.reference, "theta_c": about + np.array([360.0, -360.0, 0.0, 720.0, 360.0])}
    )
    listed = about_touches(SimpleNamespace(posteriors=turned))  # type: ignore[arg-type]
    np.testing.assert_allclose(listed["parameters"]["theta_c"]["reference"], about, atol=1e-3)


def test_touches_far_from_the_zero_of_the_stage_keep_their_posteriors() -> None:
    """With five digits, mean, ends and all draws of touches at 1000 mm were one number."""
    found = touches()
    draws = found.posterior["theta_c"] * 1e-3 + 1000.0
    listed = about_touches(
        SimpleNamespace(posteriors=replace(found, posterior={**found.posterior, "theta_c": draws}))  # type: ignore[arg-type]
    )
    about, sd = listed["parameters"]["theta_c"], draws.std(axis=(0, 1))
    assert sd.max() < 0.05
    assert (np.abs(np.array(about["mean"]) - draws.mean(axis=(0, 1))) < 0.01 * sd).all()
    ends = np.quantile(draws, [0.05, 0.95], axis=(0, 1))
    for end, exact in zip(("low", "high"), ends, strict=True):
        assert (np.abs(np.array(about[end]) - exact) < 0.01 * sd).all()
    assert all(len(set(each)) > 1 for each in listed["draws"]["theta_c"])
