"""A finger that was calibrated over two decades of load reads all loads of its calibration."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from build_of_fingers import FORCE_NOISE, Build
from independent.finger import Press
from touch_quadrature import OneTouch, integrate

import bayestouch
from bayestouch.data.touches import touches_from
from bayestouch.finger.calibration import finger_chain
from bayestouch.finger.reading.reader import IndenterPriors
from bayestouch.finger.reading.touch_reader import FingerTouchReader
from bayestouch.reading.options import Options

TIP, ANGLE, SHARE = np.array([2.0, 8.0, np.inf, 3.0, 5.0]), np.array([-6, 0.0, 3, 7, -2]), [0.7, 0.8, 1, 1.2, 1.4]


@cache
def finger() -> tuple[bayestouch.Calibration, bayestouch.Touches, np.ndarray]:
    """Calibration with loads from 10 to 1000 N/m, five hard touches, and their true loads.

    Readings are from the independent simulation, with as much noise as a finger of the build has.
    """
    rng = np.random.default_rng(2)
    built = Build().draw(rng)

    def touched(tip: np.ndarray, angle: np.ndarray, load: np.ndarray) -> bayestouch.Touches:
        clean = built.finger.signal(Press(tip, angle, load)).repeat(4, axis=0)
        return touches_from(
            np.arange(len(tip)).repeat(4),
            clean + built.noise * rng.standard_normal(clean.shape),
            indenter_radius_mm=tip.repeat(4),
            angle_deg=angle.repeat(4),
            load=load.repeat(4) + FORCE_NOISE * rng.standard_normal(4 * len(tip)),
        )

    place = np.arange(-22.0, 22.1, 2.0)
    table = touched(
        np.repeat([0.0, np.inf], [len(place), len(place[::2])]),
        np.concatenate([place, place[::2]]),
        10 ** rng.permutation(np.linspace(1, 3, len(place) + len(place[::2]))),
    )
    calibration = bayestouch.calibrate(bayestouch.DataSet(built.build.sensor, table, table), draws=200)
    true = np.array(SHARE) * 1000.0
    return calibration, touched(TIP, ANGLE, true), true


def hardest(calibration: bayestouch.Calibration, load: np.ndarray) -> float:
    one = replace(calibration, rows=replace(calibration.rows, load=load))
    return float(IndenterPriors.of_calibration(finger_chain(one), one).load.support[1])


@pytest.mark.parametrize(
    ("loads", "ends"),
    [
        ([100.0, 100.0, 100.0], 600.0),  # three times the typical load, as long as no touch had twice this load
        ([100.0, 100.0, 399.0], 600.0),
        ([100.0, np.nan, 800.0], 1200.0),  # half as much again as the largest load
        ([np.nan, np.nan, np.nan], 600.0),
    ],
)
def test_the_prior_ends_beyond_all_loads_of_the_calibration(loads: list[float], ends: float) -> None:
    calibration = finger()[0]
    calibration = replace(calibration, settings={**calibration.settings, "typical_load": 200.0})
    assert hardest(calibration, np.array(loads)) == ends


def test_hard_touches_have_their_true_loads(tmp_path: Path) -> None:
    """The mean of four readings of the force sensor has an error of 0.5 N/m, and this noise is known within a factor.

    All are above three typical loads. They are drawn, and read live, by this calibration and by one from a file.
    """
    calibration, touches, true = finger()
    assert (true > 3 * calibration.settings["typical_load"]).all()
    calibration.save(tmp_path / "calibration.nc")
    loaded = bayestouch.load(tmp_path / "calibration.nc")
    assert isinstance(loaded, bayestouch.Calibration)
    drawn = bayestouch.infer(touches, loaded, draws=512)
    load = np.asarray(drawn.posterior["P"])
    load = load.reshape(-1, load.shape[-1])
    means = touches.averaged()
    reader = bayestouch.Reader(calibration)
    live = [reader.read(y, p, reads=4) for y, p in zip(means.readings, means.load, strict=True)]
    for mean, sd in (
        (load.mean(axis=0), load.std(axis=0)),
        (np.array([each.mean[2] for each in live]), np.array([each.sd[2] for each in live])),
    ):
        # the mean square of five standard normal errors is above 3 once in a hundred fingers
        assert np.mean(((mean - true) / sd) ** 2) < 3
        assert (sd < FORCE_NOISE).all()
    assert not any("prior" in str(flag) for each in live for flag in each.flags)


def test_the_posterior_of_a_hard_touch_is_that_of_quadrature() -> None:
    """With the calibration as exact and without the force sensor, at four fifths of the largest load."""
    calibration, touches, _ = finger()
    one = touches.select(touches.touch == 1)
    mean = one.averaged().readings[0]
    expected = integrate(OneTouch.of(calibration, mean, 4, np.nan)).statistics
    found = bayestouch.infer(one, calibration, draws=2000, plug_in=True, use_load=False, check_sensor=False).posterior
    for name in ("R", "theta_c", "P"):
        draws, (centre, sd) = np.asarray(found[name]).ravel(), expected[name][:2]
        # 8000 draws: the mean is good to 0.011 sd and the sd to 0.8 %, both at one sd and without correlation
        assert draws.mean() == pytest.approx(centre, abs=0.06 * sd)
        assert draws.std() == pytest.approx(sd, rel=0.06)


def test_a_fit_for_the_check_of_the_sensor_has_the_same_range_of_loads() -> None:
    calibration, touches, _ = finger()
    reader = FingerTouchReader.from_calibration(calibration, Options())
    averaged = reader.average(touches)
    misfit = reader.fitted(averaged, reader.ready(averaged), np.arange(5))(np.zeros(5, dtype=bool))
    assert misfit.information.any(axis=1).all()  # a touch beyond the range tells nothing
