"""Intervals of rms errors: they hold the true value as often as they say, also where touches share a place."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from bayestouch.reporting.headline import HeadlineError, headline


def evidence(place: Any) -> Any:
    rows = SimpleNamespace(location={"x": np.asarray(place, dtype=float)})
    return SimpleNamespace(posteriors=SimpleNamespace(rows=rows), seed=1)


def test_interval_is_that_of_chi_squared_for_independent_touches() -> None:
    n = 400
    errors = 0.3 * np.random.default_rng(0).standard_normal(n)
    (row,) = headline([HeadlineError("x", "mm", errors, np.ones(n))], evidence(np.arange(n)))
    assert row["value"] == pytest.approx(np.sqrt(np.mean(errors**2))) and row["kind"] == "rms error"
    exact = row["value"] * np.sqrt(n / stats.chi2(n).ppf([0.95, 0.05]))
    # A quarter of the width: the fourth moment of 400 draws varies by some 15 %, the ends by 3 % of the width.
    assert [row["low"], row["high"]] == pytest.approx(exact, abs=0.15 * float(np.ptp(exact)))


def test_touches_at_one_place_count_as_one() -> None:
    """Ten touches with the same error at each place: the interval is that of the places, over three times as wide."""
    rng = np.random.default_rng(0)
    place = np.repeat(np.arange(50), 10)
    errors = rng.standard_normal(50)[place]
    (together,) = headline([HeadlineError("x", "mm", errors, np.ones(500))], evidence(place))
    (apart,) = headline([HeadlineError("x", "mm", errors, np.ones(500))], evidence(np.arange(500)))
    ratio = (together["high"] - together["low"]) / (apart["high"] - apart["low"])
    assert ratio == pytest.approx(np.sqrt(10), rel=0.15)


def test_touches_without_a_place_are_places_of_their_own() -> None:
    errors = np.random.default_rng(0).standard_normal(60)
    (row,) = headline([HeadlineError("x", "mm", errors, np.ones(60))], evidence(np.full(60, np.nan)))
    assert row["places"] == 60 == row["touches"] and row["low"] < row["value"] < row["high"]
    (one,) = headline([HeadlineError("x", "mm", errors, np.ones(60))], evidence(np.zeros(60)))
    assert one["places"] == 1 and one["low"] is None is one["high"]


def test_without_references_the_posterior_sd_is_given() -> None:
    sd = np.linspace(1.0, 3.0, 101)
    (row,) = headline([HeadlineError("x", "mm", np.full(101, np.nan), sd)], evidence(np.arange(101)))
    assert row["kind"] == "posterior sd"
    assert [row[name] for name in ("low", "value", "high")] == pytest.approx([1.1, 2.0, 2.9])
