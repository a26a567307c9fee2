"""Reads of the rows of a touch table."""

from __future__ import annotations

import numpy as np

from bayestouch.data.sample_rows import reads_of_rows
from bayestouch.data.touches import touches_from


def test_a_row_without_stated_reads_is_one_read() -> None:
    readings = np.zeros((3, 2))
    assert reads_of_rows(touches_from([0, 0, 1], readings)).tolist() == [1.0, 1.0, 1.0]
    assert reads_of_rows(touches_from([0, 0, 1], readings, reads=np.array([4.0, np.nan, 1.0]))).tolist() == [4, 1, 1]
