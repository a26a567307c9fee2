"""Where fits of pads start: the noise of a reading where no touch is repeated, and the map."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from pad_simulation import uneven

from bayestouch.model.split_data import SplitData
from bayestouch.pad.start import _with_neighbours, pad_fit, pad_noise


def model_of(means: SimpleNamespace, time_s: np.ndarray) -> Any:
    """A pad of two elements that predicts readings of one everywhere, with equal loads."""
    n = len(time_s)
    return SimpleNamespace(
        known=SimpleNamespace(means=means, touch_time_s=time_s),
        predict=lambda vector: SimpleNamespace(touches=np.ones((n, 2))),
        chain=lambda vector: SimpleNamespace(offset=np.zeros(2)),
        load=np.ones(n),
        n_elements=2,
        peak=np.ones(2),
    )


@pytest.mark.parametrize("reads", [1, 4])
def test_noise_of_one_reading_from_touches_that_follow_each_other(reads: int) -> None:
    """Residuals that alternate by ±a have second differences of ±4 a, in a mean of n reads √n times less than in one.

    The median size over √6 and over 0.6745, that of a normal variable, is the standard deviation.
    """
    sign = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
    size = np.array([0.02, 0.05])
    means = SimpleNamespace(
        readings=1.0 + sign[:, None] * size,
        counts=np.full((6, 2), reads),
        pure_error_variance=np.full(2, np.nan),
        location=np.arange(6.0)[:, None],
    )
    found = pad_noise(model_of(means, np.arange(6.0)), np.zeros(0))
    np.testing.assert_allclose(found, 4 * size * np.sqrt(reads / 6) / 0.6745, rtol=1e-12)


def test_the_start_of_a_search_predicts_as_the_calibration_does() -> None:
    """The map of the start, whose weights are parameters, against the random function of the calibration.

    Both are fitted to the same touches, means of three readings with a noise of 0.003 under loads that are measured to
    0.01 N. They differ by 0.24 of the noise, because only one takes errors of the load as common to elements.
    With two functions to each correlation length they differed by 1.3 of it.
    """
    data = SplitData.of(uneven(2))
    training, table = data.observations(data.training), data.table.select(data.training)
    fitted, models = pad_fit(training, table, data.dataset)
    calibrated = max((each for each in models.values() if each.has_map), key=lambda each: each.score).fit
    expected = calibrated.predicted()
    per_load = (expected - calibrated.chain.offset) / fitted.model.load[:, None]
    noise = np.hypot(0.003, 0.01 * per_load) / np.sqrt(3)
    difference = (fitted.model.predict(fitted.vector).touches - expected) / noise
    assert np.sqrt(np.mean(difference**2)) < 0.4


@pytest.mark.parametrize("slow", ["place", "time"])
def test_in_random_order_neither_place_nor_time_is_noise(slow: str) -> None:
    """Residuals ±a beside an error in proportion to the place, or to the time; the order of the places is random.

    Both touches beside the one between them have the mean of its slow error, so that the difference is ±4 a. That of
    touches that are neighbours in the other respect has the slow error, too, and is larger.
    """
    n, size = 60, np.array([0.02, 0.05])
    place = np.random.default_rng(3).permutation(n).astype(float)
    time = np.arange(float(n))
    along = place if slow == "place" else time
    alternating = np.where(along % 2 == 0, 1.0, -1.0)
    means = SimpleNamespace(
        readings=1.0 + alternating[:, None] * size + 0.7 * along[:, None],
        counts=np.ones((n, 2)),
        pure_error_variance=np.full(2, np.nan),
        location=2.5 * place[:, None],
    )
    np.testing.assert_allclose(pad_noise(model_of(means, time), np.zeros(0)), 4 * size / np.sqrt(6) / 0.6745, rtol=1e-9)


def test_touches_at_one_place_are_neighbours() -> None:
    """Three touches at each place: two of them are beside the third, in whatever order they are found."""
    spread = np.repeat(np.arange(20.0), 3)[:, None]
    before, here, after = _with_neighbours(spread)
    np.testing.assert_array_equal(here, np.arange(60))
    for k in here:
        assert {before[k], k, after[k]} == set(range(k - k % 3, k - k % 3 + 3))


def test_more_touches_at_one_place_than_are_asked_for() -> None:
    before, here, after = _with_neighbours(np.zeros((50, 1)))
    assert (before != here).all() and (after != here).all() and (before != after).all()
