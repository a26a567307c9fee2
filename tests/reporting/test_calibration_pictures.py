"""Words of the figure of the elements: ranges of the departures from the design."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayestouch.reporting import calibration_pictures as pictures


@pytest.mark.parametrize(
    ("means", "errors", "said"),
    [
        ([2.7e-18], [0.46], "Calibration of 1 element: x_s less design 0 mm; error 0.46 % of the peak."),
        (
            [-1.5, 2.5],
            [0.34, 0.57],
            "Calibration of 2 elements: x_s less design from −1.5 to 2.5 mm; error from 0.34 to 0.57 % of the peak.",
        ),
    ],
)
def test_a_single_element_has_no_range(
    means: list[float], errors: list[float], said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its place, less the shift that all elements share, is zero: 2.7e-18 is rounding of the mean of the draws."""
    m = len(means)
    draws = np.tile(means, (4, 1))
    found = pictures._Departure("x_s", "mm", draws, None, 0.0)
    monkeypatch.setattr(pictures, "_departures", lambda evidence: [found])
    monkeypatch.setattr(pictures, "error_and_noise", lambda calibration: (np.array(errors), np.full(m, np.nan)))
    evidence: Any = SimpleNamespace(sensor=SimpleNamespace(n_elements=m), calibration=None)
    assert pictures._elements(evidence).alt == said
