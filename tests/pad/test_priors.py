"""Priors of a pad from its readings, computed by hand."""

from __future__ import annotations

import numpy as np
import pytest

from bayestouch.data.sensor import Pad, Sensor
from bayestouch.data.touches import touches_from
from bayestouch.pad.priors import pad_priors


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
