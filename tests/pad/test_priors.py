"""Priors of a pad from its readings, computed by hand."""

from __future__ import annotations

import numpy as np
import pytest

from bayestouch.chain.kernels import GaussianKernel
from bayestouch.data.averages import TouchMeans
from bayestouch.data.sensor import Pad, Sensor
from bayestouch.data.touches import touches_from
from bayestouch.errors import InputError
from bayestouch.pad.priors import check_identifiable, pad_priors


def test_size_of_a_signal_is_nearly_its_largest_deviation_where_all_loads_are_equal() -> None:
    """Readings 0 … 1000 lie 0, 1, 1, 2, 2 … 500, 500 from their median 500: number 0.995 · 1000 of these is 498.

    The prior's scale is that per load, of which all touches have 4.
    """
    places = np.linspace(0.0, 10.0, 1001)
    touches = touches_from(np.arange(1001), np.arange(1001.0)[:, None], x_mm=places, load=4.0)
    sensor = Sensor(name="pad", body=Pad((5.0,)), reading_unit="kPa", source={})
    priors, _ = pad_priors(sensor, touches.averaged(), rest_subtracted=False, usable=np.array([True]))
    assert priors.amplitude == pytest.approx([498 / 4])
    assert priors.offset == pytest.approx([500.0])


def line_of_touches(read: tuple[int, ...]) -> TouchMeans:
    """Eight places on a line; of each element the first few touches have a reading."""
    t, m = 8, len(read)
    readings = np.where(np.arange(t)[:, None] < np.array(read), 1.0, np.nan)
    unknown = np.full(t, np.nan)
    return TouchMeans(
        np.arange(t), readings, np.isfinite(readings).astype(np.int64), np.full(m, np.nan), np.zeros(m),
        np.ones(t), unknown, unknown, unknown, None, np.linspace(0, 7, t), None,
    )  # fmt: skip


def test_every_element_needs_a_reading_more_than_it_has_unknowns() -> None:
    """Gain, offset and one coordinate: four readings are enough, three are not, unless the element is not used."""
    kernel, both = GaussianKernel(6.0), np.array([True, True])
    check_identifiable(line_of_touches((8, 4)), kernel, both)
    few = line_of_touches((8, 3))
    with pytest.raises(InputError, match=r"3 calibration touches have a reading.*at least 4") as caught:
        check_identifiable(few, kernel, both)
    assert caught.value.column == "e02"
    check_identifiable(few, kernel, np.array([True, False]))
