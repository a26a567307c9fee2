"""Locations that several touches share: each is computed once, and every touch gets its value."""

from __future__ import annotations

import numpy as np
import pytest

from bayestouch.chain.places import Places


@pytest.mark.parametrize(("touches", "computed"), [([3, 1, 3, 3, 1], 2), ([3, 1, 2, 1], 4), ([], 0)])
def test_values_of_shared_locations(touches: list[int], computed: int) -> None:
    """Two of five are computed; where more than a half differ, all are."""
    location = np.array([[float(i), 10.0 * i] for i in touches]).reshape(-1, 2)
    asked: list[int] = []

    def square(at: np.ndarray) -> np.ndarray:
        asked.append(len(at))
        return np.stack([at**2, -at], axis=-1)

    found = Places.of(location).values(square)
    np.testing.assert_array_equal(found, np.stack([location**2, -location], axis=-1))
    assert asked == [computed]
