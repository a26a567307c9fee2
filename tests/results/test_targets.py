"""What is said of draws that miss the targets of the sampler."""

from __future__ import annotations

import pytest

from bayestouch.results.targets import targets_missed


@pytest.mark.parametrize(
    ("size", "rhat", "missed"),
    [(400.0, 1.02, False), (399.0, 1.02, True), (400.0, 1.021, True), (None, 1.5, False), (float("nan"), 1.0, True)],
)
def test_targets_are_those_of_the_sampler(size: float, rhat: float, missed: bool) -> None:
    assert bool(targets_missed({"ess_bulk": size, "rhat": rhat})) == missed


def test_the_sentence_has_both_numbers() -> None:
    assert targets_missed({}) == ()
    assert targets_missed({"ess_bulk": 36.41, "rhat": 1.1213, "acceptance": 0.145}) == (
        "The sampler did not reach its targets for the calibration (effective sample size 36, R-hat 1.12), so its "
        "posterior is rough.",
    )
