"""Attempts to draw from one posterior."""

from __future__ import annotations

import numpy as np
import pytest
from sampling_targets import NORMAL_2, student_t

from bayestouch.array_types import FloatArray
from bayestouch.sampling import attempts


@pytest.mark.parametrize("without", [0, 1])
def test_an_attempt_without_draws_does_not_replace_another(monkeypatch: pytest.MonkeyPatch, without: int) -> None:
    """Neither before it nor after it: the attempt of this number has a vector that is not a number."""
    seen: list[FloatArray] = []

    def to_vectors(points: FloatArray) -> tuple[FloatArray, FloatArray]:
        seen.append(np.full_like(points, np.nan) if len(seen) == without else points)
        return seen[-1], np.zeros(points.shape[:-1])

    monkeypatch.setattr(attempts, "long_enough", lambda *given: False)
    proposal = student_t([0, 0], np.eye(2), blocks=1)
    found = attempts.draw_until_good(NORMAL_2.blocks, proposal, to_vectors, draws=64, seed=1, thins=(1, 2))  # type: ignore[arg-type]
    np.testing.assert_array_equal(found.draws, seen[1 - without])
    assert np.isfinite(found.ess_bulk).all()


def test_targets_of_few_draws_are_lower() -> None:
    """40 % of the draws up to 400; R-hat of four chains of n draws may be 1 + 8/n, as far as that is above 1.02."""
    found = [attempts.demands_of(draws) for draws in (100, 1000, 4000, None)]
    assert [each.ess_bulk for each in found] == [40.0, 400.0, 400.0, 400.0]
    assert [each.rhat for each in found] == pytest.approx([1.32, 1.032, 1.02, 1.02])
