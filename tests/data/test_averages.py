"""Means of touches: some of them, those of several tables, and where a pad was touched."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest

from bayestouch.data.averages import TouchMeans
from bayestouch.data.remarks import Tally, remarks
from bayestouch.data.touches import touches_from
from bayestouch.pad.known_touches import pad_readings
from bayestouch.simulation import PadDesign, simulate

# What is said of all touches together, and is no column.
OF_ALL = {"pure_error_variance", "pure_error_dof", "load_error_variance", "load_error_dof", "repeats_equal"}


@pytest.fixture(scope="module")
def means() -> TouchMeans:
    return simulate(PadDesign(n_touches=12), seed=4).dataset.touches.averaged()


def columns(means: TouchMeans) -> dict[str, np.ndarray]:
    values = {each.name: getattr(means, each.name) for each in fields(means) if each.name not in OF_ALL}
    return {name: value for name, value in values.items() if value is not None}


@pytest.mark.parametrize("index", [np.array([3, 0, 5]), np.arange(12) % 2 == 0])
def test_some_of_the_touches(means: TouchMeans, index: np.ndarray) -> None:
    some = means.select(index)
    assert some.n_touches == len(means.touch[index]) and some.n_elements == means.n_elements
    for name, values in columns(means).items():
        np.testing.assert_array_equal(getattr(some, name), values[index], err_msg=name)
    for name in OF_ALL:
        np.testing.assert_array_equal(getattr(some, name), getattr(means, name), err_msg=name)


def test_touches_of_several_tables(means: TouchMeans) -> None:
    order = np.array([5, 1, 2, 0, 3, 4, 11, 10, 9, 8, 7, 6])
    whole = TouchMeans.joined([means.select(part) for part in np.split(order, [1, 7])])
    for name, values in columns(means).items():
        np.testing.assert_array_equal(getattr(whole, name), values[order], err_msg=name)
    other = replace(means, pure_error_variance=2 * means.pure_error_variance)
    for one, two in ((means, other), (other, means)):
        np.testing.assert_array_equal(TouchMeans.joined([one, two]).pure_error_variance, one.pure_error_variance)


def test_loads_can_be_left_out(means: TouchMeans) -> None:
    bare = means.without_load()
    assert np.isnan(bare.load).all() and not np.isnan(means.load).any()
    np.testing.assert_array_equal(bare.readings, means.readings)


def test_location_of_a_touch_on_a_pad() -> None:
    """x alone on a line of elements, also where a table has y; NaN where a table does not have what the pad has."""
    table = simulate(PadDesign(n_touches=6), seed=4).dataset.touches
    means = pad_readings(table, 2, "mean")
    np.testing.assert_array_equal(means.location, np.column_stack([means.x_mm, means.y_mm]))
    np.testing.assert_array_equal(pad_readings(table, 1, "mean").location, means.location[:, :1])
    lost = pad_readings(table.with_(y_mm=None), 2, "mean").location
    np.testing.assert_array_equal(lost[:, 0], means.location[:, 0])
    assert lost.shape == (6, 2) and np.isnan(lost[:, 1]).all()
    np.testing.assert_array_equal(means.select(np.array([4, 1])).location, means.location[[4, 1]])


def test_samples_are_counted_without_the_noise_of_a_rest_reading() -> None:
    """Touch 0: two rows of 3 and 9 reads, minus the mean of 4 reads at rest; touch 1: a row without a rest reading."""
    rest = np.array([[4.0], [4.0], [np.nan]])
    means = touches_from([0, 0, 1], np.zeros((3, 1)), reads=np.array([3.0, 9.0, 5.0]), rest_reads=rest).averaged()
    np.testing.assert_allclose(means.counts, [[12 * 4 / (12 + 4)], [5.0]])
    np.testing.assert_array_equal(means.samples, [12.0, 5.0])
    # No load was read: as often as the elements.
    np.testing.assert_array_equal(means.reads_of_load, [12.0, 5.0])
    np.testing.assert_array_equal(means.select(np.array([1])).samples, [5.0])


def test_one_load_in_all_rows_is_one_reading_of_the_force_sensor() -> None:
    """Touch 0 has one load written into its three rows, touch 1 three loads, touch 2 one row, touch 3 two of each."""
    load = np.array([5.0, 5.0, 5.0, 1.0, 2.0, 3.0, 7.0, np.nan, 4.0, 4.0, np.nan])
    touch = np.array([0, 0, 0, 1, 1, 1, 2, 3, 3, 3, 4])
    table = touches_from(touch, np.zeros((11, 1)), load=load, contact=1.0)
    means = table.averaged()
    assert means.load_reads is not None
    np.testing.assert_array_equal(means.load_reads, [1.0, 3.0, 1.0, 1.0, 0.0])
    np.testing.assert_array_equal(means.load, [5.0, 2.0, 7.0, 4.0, np.nan])
    assert (means.load_error_variance, means.load_error_dof) == (1.0, 2.0)
    averaged = table.with_(reads=np.full(11, 8.0)).averaged()
    assert averaged.load_reads is not None
    np.testing.assert_array_equal(averaged.load_reads, [8.0, 24.0, 8.0, 8.0, 0.0])
    said = "touches with the same load in all rows: these loads count as one reading of the force sensor"
    assert not [each for each in remarks(Tally.of(table)) if said in each]
    assert f"2 of 2 {said}" in list(remarks(Tally.of(table.select(touch % 3 == 0))))


def test_repeats_that_are_all_equal_say_nothing_of_the_noise() -> None:
    """Three samples of 0.1 have a mean that differs from them by rounding; one other sample is enough for a scatter."""
    touch, one = np.repeat([0, 1], 3), np.array([0.1, 0.1, 0.1, 0.7, 0.7, 0.7])
    other = np.array([1.0, 1.0, 1.0, 2.0, 2.0, 5.0])
    means = touches_from(touch, np.stack([one, other], axis=1), contact=1.0).averaged()
    # Element 2: 0 + (1 + 1 + 4) on 4 degrees of freedom.
    np.testing.assert_allclose(means.pure_error_variance, [np.nan, 1.5])
    np.testing.assert_array_equal(means.pure_error_dof, [0.0, 4.0])
    assert not means.repeats_equal
    for readings, noted in ((one[:, None], True), (one[::3, None], False), (other[:, None], False)):
        some = touches_from(touch if len(readings) == 6 else [0, 1], readings, contact=1.0).averaged()
        assert some.repeats_equal == noted
    # The sd of the reads that a row is an average of tells the noise, unless it is zero.
    for sd, freedom in ((0.0, 0.0), (0.2, 4 + 6 * 3.0)):
        rows = touches_from(touch, one[:, None], contact=1.0).with_(
            reads=np.full(6, 4.0), readings_sd=np.full((6, 1), sd)
        )
        assert rows.averaged().pure_error_dof == [freedom] and rows.averaged().repeats_equal == (sd == 0)
