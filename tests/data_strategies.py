"""Hypothesis strategies for sensors and touches of every shape that the format allows."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st

from bayestouch.data.sensor import Finger, Pad, Rubber, Sensor
from bayestouch.data.touch_columns import LARGEST, LARGEST_TIME
from bayestouch.data.touches import Touches, touches_from

finite = st.floats(allow_nan=False, allow_infinity=False)
# What a column may hold at most.
measured = st.floats(-LARGEST, LARGEST)
measured_or_missing = st.one_of(measured, st.just(np.nan))
time_or_missing = st.one_of(st.floats(-LARGEST_TIME, LARGEST_TIME), st.just(np.nan))
positive = st.floats(min_value=1e-300, max_value=1e300)
# Lone surrogates are no text that UTF-8 could hold; they have a test of their own.
text = st.text(st.characters(exclude_categories=["Cs"]), max_size=20)


@st.composite
def fingers(draw: st.DrawFn) -> Finger:
    core, sensing, outer = sorted(draw(st.lists(st.floats(0.001, 1e6), min_size=3, max_size=3, unique=True)))
    return Finger(core, outer, sensing, tuple(draw(st.lists(finite, min_size=1, max_size=4))))


@st.composite
def pads(draw: st.DrawFn) -> Pad:
    x = draw(st.lists(finite, min_size=1, max_size=4))
    y = draw(st.none() | st.lists(finite, min_size=len(x), max_size=len(x)))
    depth, thickness = sorted(draw(st.lists(positive, min_size=2, max_size=2)))
    return Pad(
        tuple(x),
        None if y is None else tuple(y),
        draw(st.sampled_from([None, thickness])),
        draw(st.sampled_from([None, depth])),
    )


@st.composite
def sensors(draw: st.DrawFn) -> Sensor:
    return Sensor(
        name=draw(text),
        body=draw(fingers() | pads()),
        rubber=Rubber(draw(st.none() | positive), draw(st.none() | st.floats(0, 0.5))),
        force_noise_sd=draw(st.none() | positive),
        reading_unit=draw(text),
        reading_quantity=draw(text),
        source=draw(st.dictionaries(text, text, max_size=3)),
        extra=draw(
            st.dictionaries(
                st.sampled_from(["maker", "rubber", "geometry", "circuit"]),
                st.dictionaries(st.sampled_from(["batch", "note 2"]), text | finite, min_size=1),
                max_size=2,
            )
        ),
    )


@st.composite
def touches_for(draw: st.DrawFn, sensor: Sensor) -> Touches:
    n, m = draw(st.integers(1, 6)), sensor.n_elements

    def column(values: st.SearchStrategy[float]) -> np.ndarray:
        return np.array(draw(st.lists(values, min_size=n, max_size=n)))

    pairs = st.tuples(st.integers(-(2**53) + 1, 2**53 - 1), st.integers(0, 2**53 - 1))
    ids = draw(st.lists(pairs, min_size=n, max_size=n, unique=True))
    touch = np.array([pair[0] for pair in ids])
    radius_of = {t: draw(st.sampled_from([0.0, np.inf, np.nan, 3.9, 1e-300])) for t in dict.fromkeys(touch.tolist())}
    readings = np.stack([column(measured_or_missing) for _ in range(m)], axis=1)
    readings[0, 0] = draw(measured)  # a table without any reading is refused
    maybe = st.booleans()
    names = st.sampled_from(["temperature", "note", "load_N", "angle_deg", "y_mm", "e99_sd", 'a,"b', "a;b;c;d;e"])
    taken = {sensor.body.load_column, *sensor.body.location_columns}
    located = draw(maybe)
    return touches_from(
        touch,
        readings,
        sample=np.array([pair[1] for pair in ids]),
        time_s=column(time_or_missing),
        indenter_radius_mm=np.array([radius_of[t] for t in touch.tolist()]),
        load=column(measured_or_missing),
        depth_mm=column(st.one_of(st.floats(0, LARGEST), st.just(np.nan))),
        contact=column(st.sampled_from([0.0, 1.0, np.nan])),
        readings_sd=np.abs(np.stack([column(measured_or_missing) for _ in range(m)], axis=1)) if draw(maybe) else None,
        reads=column(st.sampled_from([1.0, 7.0, np.nan, 2.0**40])) if draw(maybe) else None,
        extra={
            name: np.array([draw(text) for _ in range(n)], dtype=object)
            for name in draw(st.lists(names, unique=True, max_size=3))
            if name not in taken
        },
        **({name: column(measured_or_missing) for name in sensor.body.location_columns} if located else {}),
    )
