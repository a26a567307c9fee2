"""Groups of rows, and where an id is among others."""

from __future__ import annotations

import numpy as np

from bayestouch.data.grouping import index_among
from bayestouch.data.touches import touches_from


def test_samples_find_their_touch() -> None:
    table = touches_from([7, 3, 7, 5, 3], np.arange(10.0).reshape(5, 2))
    means = table.averaged()
    assert means.touch[index_among(means.touch, table.touch)].tolist() == [7, 3, 7, 5, 3]
