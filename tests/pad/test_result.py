"""Statistics that the calibration of a pad states, worked out by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayestouch.pad.result import _lack_of_fit


def lack_of_fit(pure: list[float]) -> float:
    """Of three touches of two elements; the last reading of the first element is missing."""
    left_out = SimpleNamespace(
        residual=np.array([[2.0, 9.0], [5.0, 9.0], [np.nan, 9.0]]), variance=np.array([[3.0, 1.0], [1.0, 1.0]] * 2)[:3]
    )
    counts = np.array([[4, 1], [1, 1], [0, 1]])
    known = SimpleNamespace(pure_error_variance=np.array(pure), counts=counts)
    problem: Any = SimpleNamespace(known=known)
    model: Any = SimpleNamespace(left_out=left_out)
    return _lack_of_fit(problem, model)


def test_lack_of_fit_is_of_elements_with_repeats() -> None:
    """The first element alone: 2²/(4/4 + 3) = 1 and 5²/(4 + 1) = 5."""
    assert lack_of_fit([4.0, 0.0]) == pytest.approx(3.0)
    assert lack_of_fit([4.0, np.nan]) == pytest.approx(3.0)


def test_lack_of_fit_is_not_known_without_repeats() -> None:
    assert np.isnan(lack_of_fit([0.0, np.nan]))
