"""Definition of the parts of a report that only a pad has."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.data.sensor import Sensor, pad_of
from bayestouch.reporting.body_pages import BodyPages
from bayestouch.reporting.pad.live import estimate_figure, sensor_figure
from bayestouch.reporting.pad.numbers import headline_quantities, pad_numbers
from bayestouch.reporting.pad.pictures import estimate_pictures, example_touches
from bayestouch.reporting.pad.sensor_picture import sensor_picture
from bayestouch.reporting.pad.sketch import sketch
from bayestouch.reporting.pad.words import errors_and_limits, own_answers


def design(sensor: Sensor) -> Mapping[str, FloatArray]:
    """Designed coordinates of the elements, mm, under both names: of the physical model and of the kernels."""
    places = {axis: np.asarray(values) for axis, values in pad_of(sensor).places_mm.items()}
    return {name: values for axis, values in places.items() for name in (f"{axis}_s", axis)}


PAD = BodyPages(
    numbers=pad_numbers,
    headline=headline_quantities,
    sketch=sketch,
    errors_and_limits=errors_and_limits,
    own_answers=own_answers,
    plug_in_compared=(),
    read="location",
    reads_held_out=True,
    next_after_diagnosis="Read touches with what was found: bayestouch diagnose writes calibration_after.nc, which "
    "bayestouch infer takes",
    design=design,
    origin_known=False,
    examples=example_touches,
    pictures=estimate_pictures,
    sensor_picture=sensor_picture,
    live_sensor=sensor_figure,
    live_estimates=estimate_figure,
)
