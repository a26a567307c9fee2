"""Quantiles of draws, each series for itself, differences of angles, elements that respond, numbers of a user."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from bayestouch.data.arrays import as_floats, nearest_turn, quantiles, responding, turned
from bayestouch.errors import InputError


def test_an_infinite_draw_matters_to_its_own_series_alone() -> None:
    """Draws 1 to 4 in each column: 0.4 is between 2 and 3, at 1 + 0.4 * 3; without interpolation it is 2."""
    draws = np.tile(np.array([[1.0], [4.0], [3.0], [2.0]]), 3)
    alone = quantiles(draws, [0.4, 1.0], axis=0)
    np.testing.assert_allclose(alone, [[2.2] * 3, [4.0] * 3])
    draws[1, 1], draws[0, 2] = np.inf, -np.inf
    beside = quantiles(draws, [0.4, 1.0], axis=0)
    np.testing.assert_array_equal(beside[:, 0], alone[:, 0])
    np.testing.assert_array_equal(beside[:, 1:], [[2.0, 2.0], [np.inf, 4.0]])
    chains = draws.reshape(2, 2, 3)
    np.testing.assert_array_equal(quantiles(chains, [0.4, 1.0], axis=(0, 1)), beside)


def test_elements_that_respond() -> None:
    """One that differs, one stuck, one missing, one with a single reading, one stuck where it is read."""
    nan = np.nan
    readings = np.array([[1.0, 5.0, nan, nan, 7.0], [2.0, 5.0, nan, 3.0, nan], [1.0, 5.0, nan, nan, 7.0]])
    np.testing.assert_array_equal(responding(readings), [True, False, False, True, False])
    np.testing.assert_array_equal(responding(readings[:0]), [False] * 5)


def test_turns() -> None:
    np.testing.assert_array_equal(turned(np.array([190.0, -190.0, 180.0, 359.0, 10.0])), [-170, 170, -180, -1, 10])
    angles = np.array([340.0, -20.0, 20.0, -700.0, 0.1, np.nan, np.inf])
    to = np.array([-20.0, 340.0, 20.0, 15.0, 180.0, 0.0, 0.0])
    np.testing.assert_array_equal(nearest_turn(angles, to), [-20.0, 340.0, 20.0, 20.0, 0.1, np.nan, np.nan])


@pytest.mark.parametrize(
    "value",
    [[1 + 2j, 3], np.array([1, 2], dtype="c8"), pd.Series([1 + 0j]), np.ma.masked_array([1j, 2], [True, False])],
)
def test_complex_numbers_are_refused(value: object) -> None:
    """Their imaginary parts would be dropped, as by a Fourier transform that was not turned back."""
    with pytest.raises(InputError, match=r"^expected real numbers, got complex ones: "):
        as_floats(value)
