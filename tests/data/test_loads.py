"""Whether the loads of known touches differ."""

from __future__ import annotations

import numpy as np
import pytest

from bayestouch.data import loads


@pytest.mark.parametrize(
    ("load", "vary"),
    [
        ([200.0, 201.0, 199.0], False),
        ([180.0, 200.0, 220.0], False),  # the range is 20 % of the median: no more than the limit
        ([160.0, 200.0, 240.0], True),
        ([160.0, np.nan, 200.0, 240.0], True),
        ([200.0, np.nan], False),
        ([np.nan, np.nan], False),
        ([], False),
    ],
)
def test_loads_vary_beyond_a_fifth_of_their_median(load: list[float], vary: bool) -> None:
    assert loads.LOADS_VARY == 0.2
    assert loads.loads_vary(np.array(load)) is vary
