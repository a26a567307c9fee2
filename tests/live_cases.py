"""Live readings beside those of `infer`, for the tests of live readers."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

import bayestouch
from bayestouch.effects.stated import StatedModel

FINGER = bayestouch.FingerDesign(n_elements=8, edge_step_deg=4.0, flat_step_deg=8.0, touch_step_deg=8.0)
LINE = bayestouch.PadDesign(element_x_mm=(0.0, 6.0, 12.0, 18.0), element_y_mm=None, n_touches=40)
GRID = bayestouch.PadDesign(n_touches=40)
# The effective size of so many draws is 3,000 or more: 0.02 sd in a mean, 1.3 % in an sd.
DRAWS = 8192


@cache
def sensor(
    kind: str, effects: tuple[tuple[str, float], ...] = (), model: tuple[str, ...] = ()
) -> tuple[bayestouch.DataSet, bayestouch.Calibration]:
    """A simulated data set with these effects, and its calibration with the effects of `model`."""
    design = {"finger": FINGER, "line": LINE, "grid": GRID}[kind]
    data = bayestouch.simulate(design, effects=dict(effects), seed=3).dataset
    body, contact = ("finger", "layer") if kind == "finger" else ("pad", "")
    stated = StatedModel(body, contact, tuple((name, {}) for name in model)) if model else None
    return data, bayestouch.calibrate(data, model=stated, draws=64, seed=1)


def streamed(reader: bayestouch.Reader, touches: bayestouch.Touches) -> list[bayestouch.LiveTouch]:
    """The last posterior of every touch of a table, row by row."""
    rest, out, last = touches.rest_reading(), [], None
    if rest is not None:
        reader.rest_reading = rest
    touch = None
    for row in np.flatnonzero(touches.in_contact):
        if touch is not None and touches.touch[row] != touch:
            out.append(last)
            reader.new_touch()
        touch = touches.touch[row]
        reads = 1 if touches.reads is None else int(touches.reads[row])
        last = reader.update(touches.readings[row], touches.load[row], reads=reads, time_s=float(touches.time_s[row]))
    return [*out, last]  # type: ignore[list-item]


def drawn(touches: bayestouch.Touches, calibration: bayestouch.Calibration, **options: Any) -> tuple[np.ndarray, ...]:
    """Mean and sd of the draws of `infer` by emcee, (t, d)."""
    result = bayestouch.infer(touches, calibration, check_sensor=False, draws=DRAWS, seed=2, workers=1, **options)
    draws = np.stack([result.posterior[each.name] for each in result.parameters])
    return draws.mean(axis=(1, 2)).T, draws.std(axis=(1, 2)).T


def apart(live: list[bayestouch.LiveTouch], mean: np.ndarray, sd: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Largest difference of the means over the sd, and of the sds as a share, (t,) each."""
    return (
        np.abs((np.array([each.mean for each in live]) - mean) / sd).max(axis=1),
        np.abs(np.array([each.sd for each in live]) / sd - 1).max(axis=1),
    )
