"""Definition of the parts of a report that only a finger has."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.data.sensor import Sensor, finger_of
from bayestouch.reporting.body_pages import BodyPages
from bayestouch.reporting.finger.live import estimate_figure, sensor_figure
from bayestouch.reporting.finger.numbers import finger_numbers, headline_quantities
from bayestouch.reporting.finger.pictures import estimate_pictures, example_touches
from bayestouch.reporting.finger.sensor_picture import sensor_picture
from bayestouch.reporting.finger.sketch import sketch
from bayestouch.reporting.finger.words import errors_and_limits, own_answers


def design(sensor: Sensor) -> Mapping[str, FloatArray]:
    """Designed sensing radius (mm) and angle (degree) of each element."""
    finger = finger_of(sensor)
    return {
        "r_s": np.full(finger.n_elements, finger.sensing_radius_mm),
        "theta_s": np.asarray(finger.element_angles_deg),
    }


FINGER = BodyPages(
    numbers=finger_numbers,
    headline=headline_quantities,
    sketch=sketch,
    errors_and_limits=errors_and_limits,
    own_answers=own_answers,
    plug_in_compared=("theta_c", "R", "P"),
    read="radius",
    reads_held_out=False,
    next_after_diagnosis="Calibrate with what was found: bayestouch diagnose writes model.toml, which bayestouch "
    "calibrate --model takes",
    design=design,
    origin_known=True,
    examples=example_touches,
    pictures=estimate_pictures,
    sensor_picture=sensor_picture,
    live_sensor=sensor_figure,
    live_estimates=estimate_figure,
)
