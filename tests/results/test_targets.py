"""What is said of draws that miss the targets of the sampler."""

from __future__ import annotations

import numpy as np
import pytest

from bayestouch.results.targets import kept_draws, targets_met, targets_missed


@pytest.mark.parametrize(
    ("size", "rhat", "missed"),
    [(400.0, 1.02, False), (399.0, 1.02, True), (400.0, 1.021, True), (None, 1.5, False), (float("nan"), 1.0, True)],
)
def test_targets_are_those_of_the_sampler(size: float, rhat: float, missed: bool) -> None:
    assert bool(targets_missed({"ess_bulk": size, "rhat": rhat})) == missed


@pytest.mark.parametrize(("size", "rhat", "missed"), [(40.0, 1.32, False), (39.9, 1.32, True), (40.0, 1.33, True)])
def test_few_draws_have_lower_targets(size: float, rhat: float, missed: bool) -> None:
    """Of 100 draws the targets are 0.4 · 100 and 1 + 8 · 4 chains / 100."""
    statistics = {"ess_bulk": size, "rhat": rhat}
    assert bool(targets_missed(statistics, 100)) == missed != targets_met(statistics, (4, 25))
    assert targets_missed(statistics) and not targets_met(statistics, None)


def test_number_of_draws() -> None:
    assert kept_draws({}) is None and kept_draws({"mu": np.zeros((4, 25, 3))}) == (4, 25)


def test_the_sentence_has_both_numbers() -> None:
    assert targets_missed({}) == ()
    assert targets_missed({"ess_bulk": 36.41, "rhat": 1.1213, "acceptance": 0.145}) == (
        "The sampler did not reach its targets for the calibration (effective sample size 36, R-hat 1.121), so its "
        "posterior is rough.",
    )
