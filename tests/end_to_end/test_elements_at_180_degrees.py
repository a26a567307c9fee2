"""A finger, and the same finger turned by half a turn, with angles from -180 to 180: the results are the same."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

import bayestouch
from bayestouch.data.arrays import turned
from bayestouch.data.touches import Touches
from bayestouch.effects.stated import StatedModel

DESIGN = bayestouch.FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=4.0)
MODEL = StatedModel("finger", "layer", (("crosstalk", {}),))


def half_a_turn(table: Touches) -> Touches:
    assert table.angle_deg is not None
    return table.with_(angle_deg=turned(table.angle_deg + 180))


@cache
def both() -> tuple[tuple[bayestouch.DataSet, bayestouch.Calibration], ...]:
    """Data and calibration of the finger and of the turned one, with crosstalk, which goes to neighbours."""
    plain = bayestouch.simulate(DESIGN, effects={"crosstalk": 0.05}, seed=3).dataset
    finger, calibration = plain.sensor.body, plain.calibration
    assert isinstance(finger, bayestouch.Finger) and calibration is not None
    there = replace(finger, element_angles_deg=tuple(turned(np.array(finger.element_angles_deg) + 180)))
    other = bayestouch.DataSet(replace(plain.sensor, body=there), half_a_turn(calibration), half_a_turn(plain.touches))
    return tuple((each, bayestouch.calibrate(each, model=MODEL, draws=64, seed=1)) for each in (plain, other))


def test_the_row_of_elements_is_whole() -> None:
    rows = {
        (170.0, -170.0): (170.0, 190.0),
        (-170.0, -150.0, 170.0): (-170.0, -150.0, -190.0),
        (0.0, 90.0, 180.0, 270.0): (0.0, 90.0, 180.0, 270.0),
        (-10.0, 10.0): (-10.0, 10.0),
        (350.0, 730.0): (350.0, 370.0),
    }
    for given, row in rows.items():
        assert bayestouch.Finger(10.0, 12.7, 10.3, given).element_angles_deg in (row, tuple(e - 360 for e in row))
    finger = bayestouch.Finger(10.0, 12.7, 10.3, (170.0, -170.0))
    assert finger.pitch_deg == 20.0
    np.testing.assert_array_equal(finger.near(np.array([-175.0, 175.0, 20.0, np.nan])), [185.0, 175.0, 20.0, np.nan])


def test_touches_are_read_as_by_the_finger_that_was_not_turned() -> None:
    (plain, one), (other, two) = both()
    share = [np.asarray(each.mode["crosstalk_share"]).item() for each in (one, two)]
    assert abs(share[1] - share[0]) < 1e-4 and abs(share[0] - 0.05) < 0.004
    read = [bayestouch.infer(data.touches, each, draws=400, seed=2) for data, each in ((plain, one), (other, two))]
    for name, sd in zip(("R", "theta_c", "P"), (0.3, 0.05, 1.0), strict=True):
        difference = read[1].mean(name) - read[0].mean(name) - (180.0 if name == "theta_c" else 0.0)
        # The sampler's proposals differ by rounding: means of 400 draws agree to a tenth of an sd.
        assert np.abs(difference).max() < 4 * sd / np.sqrt(100)


def test_touches_are_planned_where_the_finger_was_touched() -> None:
    (_, one), (_, two) = both()
    places = [bayestouch.candidate_touches(each).angle_deg for each in (one, two)]
    assert places[0] is not None and places[1] is not None
    np.testing.assert_allclose(places[1], places[0] + 180, atol=1e-9)
    chosen = [bayestouch.next_touches(each, count=3, about="places") for each in (one, two)]
    np.testing.assert_array_equal(chosen[1].chosen, chosen[0].chosen)
    np.testing.assert_allclose(chosen[1].after, chosen[0].after, rtol=0.02)
