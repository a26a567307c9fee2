"""How the touches of a block on a finger are divided among processes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from bayestouch.finger.reading.draws import FingerSampler


@pytest.mark.parametrize(
    ("touches", "again", "sizes"),
    [
        (0, False, []),
        (1, False, [1]),
        (1000, False, [500, 500]),
        (1500, False, [375] * 4),
        (2048, False, [512] * 4),
        (4096, False, [1024] * 4),
        (4097, False, [683] * 5 + [682]),
        (512, True, [128] * 4),
        (1024, True, [128] * 8),
    ],
)
def test_four_cores_have_work_where_there_is_enough(touches: int, again: bool, sizes: list[int]) -> None:
    """Two pieces of 1,024 would leave two of four cores without work. Numbers of pieces are even, for two cores."""
    sampler: Any = None
    pieces = FingerSampler.pieces(sampler, np.arange(touches), again)
    assert [len(each) for each in pieces] == sizes
    assert [row for each in pieces for row in each] == list(range(touches))
