"""Errors of a location and errors of noise."""

from __future__ import annotations

import numpy as np

from bayestouch.data.touches import touches_from
from bayestouch.reporting.finger.error_split import touch_of_sample


def test_samples_find_their_touch() -> None:
    table = touches_from([7, 3, 7, 5, 3], np.arange(10.0).reshape(5, 2))
    means = table.averaged()
    assert means.touch[touch_of_sample(means.touch, table.touch)].tolist() == [7, 3, 7, 5, 3]
