"""Arguments as numbers, and the messages on those that are none."""

from __future__ import annotations

import re

import numpy as np
import pytest

from bayestouch.errors import InputError, number_array


@pytest.mark.parametrize(
    ("given", "dimensions", "array"),
    [
        (3, (0,), 3.0),
        (np.float32(0.5), (0, 1), 0.5),
        ((0, 2.5, np.inf), (1,), [0.0, 2.5, np.inf]),
        ([], (1,), []),
        (range(2), (1,), [0.0, 1.0]),
        ([[1, np.nan]], (1, 2), [[1.0, np.nan]]),
    ],
)
def test_numbers_of_any_kind_become_floats(given: object, dimensions: tuple[int, ...], array: object) -> None:
    found = number_array("load", given, *dimensions)
    np.testing.assert_array_equal(found, array)
    assert found.dtype == float


@pytest.mark.parametrize(
    ("given", "dimensions", "expected"),
    [
        ("3", (0,), "a number"),
        (True, (0,), "a number"),
        ([1.0], (0,), "a number"),
        (None, (0,), "a number"),
        (1.0, (1,), "a list of numbers"),
        (["3"], (1,), "a list of numbers"),
        ([[1.0], [2.0, 3.0]], (1, 2), "a list of numbers"),
    ],
)
def test_anything_else_is_refused_by_its_name(given: object, dimensions: tuple[int, ...], expected: str) -> None:
    message = f"load: expected {expected}, got {given!r}"
    with pytest.raises(InputError, match=f"^{re.escape(message)}$"):
        number_array("load", given, *dimensions)
