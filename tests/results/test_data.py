"""How often the force sensor is read in a typical touch."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from posterior_cases import calibration

NAN = np.nan


@pytest.mark.parametrize(
    ("load", "reads", "usual"),
    [
        ([5.0, 5.0, 5.0], [20.0, 20.0, 20.0], None),
        ([5.0, 5.0, 5.0], [1.0, 1.0, 1.0], 1.0),
        ([5.0, 5.0, 5.0], [1.0, 20.0, 20.0], None),
        ([5.0, 5.0, 5.0], [4.0, 6.0, 20.0], 5.0),
        ([NAN, NAN, 5.0], [20.0, 20.0, 1.0], 1.0),
        ([NAN, NAN, NAN], [1.0, 1.0, 1.0], None),
    ],
)
def test_usual_reads_of_the_force_sensor(load: list[float], reads: list[float], usual: float | None) -> None:
    """Of touches of 20 samples; None is one read with each sample, as in most touches with a load."""
    rows = replace(calibration().rows, load=np.array(load), load_reads=np.array(reads), samples=np.full(3, 20.0))
    assert rows.usual_load_reads == usual
