"""Priors of a pad from its readings, computed by hand."""

from __future__ import annotations

import numpy as np
import pytest
from pad_simulation import line, square

from bayestouch.chain.kernels import GaussianKernel
from bayestouch.data.averages import TouchMeans
from bayestouch.data.sensor import Pad, Sensor
from bayestouch.data.touches import touches_from
from bayestouch.errors import InputError
from bayestouch.pad.priors import check_identifiable, pad_priors


@pytest.mark.parametrize("unit", [1.0, 1e-18])
def test_size_of_a_signal_is_nearly_its_largest_deviation_where_all_loads_are_equal(unit: float) -> None:
    """Readings 0 … 1000 lie 0, 1, 1, 2, 2 … 500, 500 from their median 500: number 0.995 · 1000 of these is 498.

    The prior's scale is that per load, of which all touches have 4, in any unit of the readings.
    """
    places = np.linspace(0.0, 10.0, 1001)
    touches = touches_from(np.arange(1001), unit * np.arange(1001.0)[:, None], x_mm=places, load=4.0)
    sensor = Sensor(name="pad", body=Pad((5.0,)), reading_unit="kPa", source={})
    priors, _ = pad_priors(sensor, touches.averaged(), rest_subtracted=False, usable=np.array([True]))
    assert priors.amplitude == pytest.approx([498 / 4 * unit], abs=0.0)
    assert priors.offset == pytest.approx([500.0 * unit], abs=0.0)


def test_an_offset_does_not_move_the_elements_to_where_loads_were_low() -> None:
    """Loads increase over the pad; the offset over the load is then largest at its low end."""
    pad, x = line(), np.linspace(6.0, 34.0, 57)
    touches = pad.touch(x[:, None], np.random.default_rng(0), load=np.linspace(1.0, 4.0, 57), measured=True)
    low, high = (
        pad_priors(
            pad.sensor, touches.with_(readings=touches.readings + offset).averaged(), rest_subtracted=False,
            usable=np.ones(4, dtype=bool),
        )[0].position
        for offset in (0.0, 1000.0)
    )  # fmt: skip
    np.testing.assert_allclose(high, low, rtol=0, atol=1e-9)
    # Touches are half a millimetre apart.
    np.testing.assert_allclose(high, pad.nominal + 10, atol=0.5)


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


@pytest.mark.parametrize("away", [(0.0, 1.0), (1.0, 0.0), (0.6, 0.8), (1.0, -3.0)])
def test_touches_on_one_line_do_not_calibrate_a_pad_in_the_plane(away: tuple[float, float]) -> None:
    """Whatever its direction; one touch 1 mm beside the line is enough to know both coordinates."""
    pad, kernel, usable = square(), GaussianKernel(6.0), np.ones(4, dtype=bool)
    place = np.array([11.3, 8.1]) + np.linspace(-7.0, 7.0, 30)[:, None] * np.array(away) / np.hypot(*away)
    beside = place.copy()
    beside[7] += np.array([away[1], -away[0]]) / np.hypot(*away)
    on_line, off_line = (pad.touch(each, np.random.default_rng(0)).averaged() for each in (place, beside))
    check_identifiable(off_line, kernel, usable)
    with pytest.raises(InputError, match="on one line"):
        check_identifiable(on_line, kernel, usable)
