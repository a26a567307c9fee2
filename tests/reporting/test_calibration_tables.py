"""Tables of a calibration in a report, by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from bayestouch.reporting.calibration_tables import parameter_rows


def test_only_a_parameter_with_a_value_for_each_element_has_a_smallest_and_a_largest() -> None:
    """Two chains of two draws: means of 2 and 5 for two elements that are read, of 3 for what they share.

    The third element was not read: its draws are those of the prior.
    """
    calibration = SimpleNamespace(
        parameters=(),
        settings={},
        of_elements_read=lambda values: values[..., :2],
        sensor=SimpleNamespace(reading_unit="mV", body=SimpleNamespace(load_unit="N/m")),
        posterior={
            "gain": np.array([[[1.0, 5.0, 99.0], [3.0, 5.0, 7.0]], [[1.0, 4.0, -5.0], [3.0, 6.0, 0.0]]]),
            "sigma": np.array([[2.0, 4.0], [3.0, 3.0]]),
        },
    )
    evidence: Any = SimpleNamespace(calibration=calibration, truth={"gain": [2.0, 5.0, 60.0]})
    own, shared = parameter_rows(evidence)
    assert own["true_mean"] == 3.5 and own["inside_90_percent"] == 100.0
    assert own["unit"] == "mV/strain"  # as in the files
    assert (own["minimum"], own["mean"], own["maximum"], own["by_element"]) == (2.0, 3.5, 5.0, True)
    assert (shared["minimum"], shared["mean"], shared["maximum"], shared["by_element"]) == (None, 3.0, None, False)
