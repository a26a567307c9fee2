"""Evidence of a report: touches without any reading are left out of it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from report_cases import LINE, pad_evidence

from bayestouch.reporting.evidence import Evidence
from bayestouch.reporting.headline import headline
from bayestouch.reporting.pad.numbers import headline_quantities
from bayestouch.reporting.trust import coverage


@pytest.fixture(scope="module")
def whole() -> Evidence:
    return pad_evidence(LINE)


def without_readings(evidence: Evidence, *empty: int) -> Evidence:
    """The same with touches, by position, of which nothing was read: their location is far from the reference."""
    unread = np.isin(np.arange(len(evidence.posteriors)), empty)

    def changed(found: Any) -> Any:
        draws = {**found.posterior, "x": found.posterior["x"] + 1000.0 * unread}
        return replace(found, posterior=draws, sample_stats={**found.sample_stats, "without_reading": 1.0 * unread})

    return replace(
        evidence, posteriors=changed(evidence.posteriors), without_load=changed(evidence.without_load)
    ).of_read_touches()


def test_touches_without_a_reading_count_in_no_error(whole: Evidence) -> None:
    found = without_readings(whole, 3, 7)
    assert found.without_reading == 2 and len(found.posteriors) == len(whole.posteriors) - 2
    kept = np.delete(np.arange(len(whole.posteriors)), [3, 7])
    posteriors = whole.posteriors
    distance = np.abs(posteriors.posterior["x"].mean(axis=(0, 1)) - posteriors.reference["x"])[kept]
    of_location = [row for row in headline(headline_quantities(found), found) if row["unit"] == "mm"]
    total = sum(row["touches"] * row["value"] ** 2 for row in of_location)
    assert sum(row["touches"] for row in of_location) == len(kept)
    assert total == pytest.approx((distance**2).sum())
    assert {row["touches"] for row in coverage(found)} == {len(kept)}


def test_touches_without_a_reading_are_not_fitted_again(whole: Evidence) -> None:
    found = without_readings(whole, 3)
    assert found.means().touch.tolist() == found.posteriors.rows.touch.tolist()
    samples = whole.means(each_sample=True).n_touches
    assert found.means(each_sample=True).n_touches == samples - LINE.samples_per_touch


def test_without_any_reading_all_touches_are_kept(whole: Evidence) -> None:
    count = len(whole.posteriors)
    found = without_readings(whole, *range(count))
    assert found.without_reading == 0 and len(found.posteriors) == count
    assert whole.of_read_touches() is whole
