"""Fits of touches on a finger for the check of the sensor."""

from __future__ import annotations

import numpy as np
import pytest

import bayestouch
from bayestouch.data.touches import touches_from
from bayestouch.finger.calibration import finger_chain
from bayestouch.finger.reading.touch_reader import FingerTouchReader
from bayestouch.reading.options import Options


@pytest.mark.parametrize("use_load", [True, False])
def test_touches_beyond_the_priors_tell_nothing(use_load: bool) -> None:
    """Locations up to 20° beyond the elements, and loads up to three typical ones, are read."""
    design = bayestouch.FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=10.0)
    calibration = bayestouch.calibrate(bayestouch.simulate(design, seed=3).dataset, draws=64)
    chain, typical = finger_chain(calibration), float(calibration.settings["typical_load"])
    last = np.degrees(chain.angle.max())
    angle = np.array([0.0, last + 18, last + 22, 0.0, 0.0, 0.0])
    load = typical * np.array([1.0, 1.0, 1.0, 2.9, 3.1, 3.9])
    readings = chain.predict(np.full(6, 4.0), np.radians(angle), load)
    touches = touches_from(np.arange(6), readings, load=load, contact=1.0)
    reader = FingerTouchReader.from_calibration(calibration, Options(use_load=use_load))
    averaged = reader.average(touches)
    misfit = reader.fitted(averaged, reader.ready(averaged), np.arange(6))(np.zeros(5, dtype=bool))
    beyond = ~misfit.information.any(axis=1)
    np.testing.assert_array_equal(beyond, [False, False, True, False, True, True])
