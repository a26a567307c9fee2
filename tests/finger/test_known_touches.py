"""What the start of a fit takes for the response of each element, on a finger with touches above and beside it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from build_of_fingers import Build
from known_fingers import dataset, known_touches

import bayestouch
from bayestouch.data.finger import Finger
from bayestouch.finger.known_touches import KnownTouches

FINGER = Finger(9.4, 12.7, 9.9, (0.0, 20.0))
#: Readings over load of two elements with the response 1, under touches at 0°, 10° and 12°.
EXPECTED = np.array([[1.0, 0.0], [-0.2, -0.2], [-0.1, 0.1]])
LOAD = np.array([10.0, 20.0, 40.0])


def touches(response: np.ndarray, noise: np.ndarray | float = 0.0) -> KnownTouches:
    readings = EXPECTED * response * LOAD[:, None] + noise
    ones, none = np.ones(3), np.zeros(2)
    return KnownTouches(
        0 * ones, np.radians([0.0, 10.0, 12.0]), LOAD, ones, readings, np.ones((3, 2)), none, none.copy()
    )


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_response_of_an_element_with_touches_beside_it_is_regressed(sign: float) -> None:
    """Its largest reading is a fifth of that above it, with the other sign: the rubber is stretched there."""
    known = touches(np.array([3.0, sign * 5.0]))
    np.testing.assert_allclose(known.apparent_response(FINGER, EXPECTED * LOAD[:, None]), [3.0, sign * 5.0], rtol=1e-12)


def test_the_largest_reading_is_taken_from_touches_above() -> None:
    """With errors of 2, 1 and 1 the largest reading per load is 3.2; least squares would give 3 + 12 / 132."""
    known = touches(np.array([3.0, 5.0]), np.array([[2.0], [1.0], [1.0]]))
    regressed = 5.0 + (-4.0 + 4.0) / 32
    np.testing.assert_allclose(known.apparent_response(FINGER, EXPECTED * LOAD[:, None]), [3.2, regressed], rtol=1e-12)


def test_an_element_that_reads_noise_has_the_size_of_the_noise() -> None:
    """A regression of noise on the expected readings is about its mean, -1.4 / 132, and not twice as large."""
    known = touches(np.array([0.0, 5.0]), np.array([[0.1, 0.0], [0.2, 0.0], [0.4, 0.0]]))
    assert known.apparent_response(FINGER, EXPECTED * LOAD[:, None])[0] == pytest.approx(0.01)


@pytest.mark.parametrize("last", [10.0, 12.0])
def test_an_element_beside_the_touches_has_a_gain_of_the_right_sign(last: float) -> None:
    """Edges every 2° and flats every 4° end 10° to 12° before the last of six elements, at 22°.

    The truth is from the independent simulation. 33 touches x 6 elements, less 20 parameters: the lack of fit is 1 with
    an sd of sqrt(2/178), of which 5 are allowed.
    """
    rng = np.random.default_rng(3)
    built = Build(n_elements=6, sigma=0.46, sigma_sd=0.01).draw(rng)
    edges, flats = np.arange(-31.0, last + 0.1, 2.0), np.arange(-31.0, last + 0.1, 4.0)
    tip = np.repeat([0.0, np.inf], [len(edges), len(flats)])
    table = built.touched(rng, tip, np.concatenate([edges, flats]))
    data = bayestouch.DataSet(built.build.sensor, table, table)
    calibration = bayestouch.calibrate(data, draws=400)
    assert calibration.statistics["lack_of_fit"] == pytest.approx(1.0, abs=5 * np.sqrt(2 / 178))
    draws = np.log(np.abs(calibration.posterior["response"])).reshape(-1, 6)
    error = (draws.mean(axis=0) - np.log(built.response)) / draws.std(axis=0)
    assert (calibration.posterior["response"] > 0).all()
    assert np.sqrt((error**2).mean()) < 2  # the mean of six squares is above 4 once in 2000 fingers


def test_the_other_polarity_of_one_element_gives_the_same_gain_with_the_other_sign() -> None:
    table = known_touches(1, step=4.0)
    sign = np.array([1.0, 1.0, -1.0, 1.0, 1.0, 1.0, 1.0])
    plain, turned = (
        bayestouch.calibrate(dataset(replace(table, readings=table.readings * s)), draws=100) for s in (1.0, sign)
    )
    np.testing.assert_allclose(turned.mode["response"], plain.mode["response"] * sign, rtol=1e-6)
    assert not any("other sign" in note for note in plain.notes)
    assert [note for note in turned.notes if "other sign" in note] == [
        "The gain of e03 has the other sign than those of most elements: readings fall under a touch where those "
        "of the others rise, or rise where they fall. If it is not built so, look at wires and signs of the tables."
    ]


def test_loads_that_were_not_measured_are_searched_as_far_as_those_that_were() -> None:
    """From 0.05 to three times the mean, or from half of the smallest to half as much again as the largest."""
    known = touches(np.ones(2))
    assert known.searched_loads == pytest.approx((0.05 * 70 / 3, 3 * 70 / 3))
    wide = replace(known, load=np.array([1.0, 8.0, 90.0]))
    assert wide.searched_loads == pytest.approx((0.5, 135.0))
    first = replace(wide, load_reads=np.array([1.0, 1.0, 0.0]))
    assert first.searched_loads == pytest.approx((0.05 * 4.5, 3 * 4.5))
    low, high = replace(wide, load_reads=np.array([1.0, 0.0, 1.0])).load_range()
    assert low == pytest.approx([0.97, 0.5, 87.3]) and high == pytest.approx([1.03, 3 * 45.5, 92.7])


@pytest.mark.parametrize("seed", [4, 5, 7])
def test_a_finger_whose_large_loads_are_not_measured(seed: int) -> None:
    """Loads from 10 to 1,000 N/m; of those above 300 N/m only the largest is measured.

    These fingers had a rms of 3.0, 4.7 and 3.3 sd. The mean of seven squares is above 4 once in 4,000 fingers.
    """
    rng = np.random.default_rng(seed)
    built = Build(n_elements=6, sigma=0.46, sigma_sd=0.01).draw(rng)
    angle = np.concatenate([np.arange(-31.0, 31.1, 3.0), np.arange(-31.0, 31.1, 6.0)])
    tip = np.repeat([0.0, np.inf], [21, 11])
    load = np.exp(rng.uniform(np.log(10), np.log(1000), len(tip)))
    table = built.touched(rng, tip, angle, load=load)
    lost = (load > 300) & (load < load.max())
    table = replace(table, load=np.where(lost, np.nan, 1.0)[table.touch] * table.load)
    calibration = bayestouch.calibrate(bayestouch.DataSet(built.build.sensor, table, table), draws=400)
    draws = np.column_stack([np.log(calibration.posterior[name]).reshape(400, -1) for name in ("mu", "response")])
    truth = np.log([float(built.truth["mu"]), *built.response])
    assert np.sqrt((((draws.mean(axis=0) - truth) / draws.std(axis=0)) ** 2).mean()) < 2
