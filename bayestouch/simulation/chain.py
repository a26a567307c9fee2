"""Touches through the chain: from what was commanded to readings, with effects of the catalogue on the way.

An effect takes touches as commanded and loads as read to touches as they were. So the plan is what is commanded and
read, and the effects say what was pressed.
"""

from __future__ import annotations

from dataclasses import replace
from zlib import crc32

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.recording import History, Recording
from bayestouch.errors import InputError
from bayestouch.simulation.plan import Built, EffectValues, Plan

FIRST_EFFECT_STREAM = 1000
# What earlier touches leave is worked out again until no reading changes by more than this share of the peak.
SETTLED = 1e-12


def pressed(plan: Plan, built: Built, effects: EffectValues) -> tuple[Recording, Recording]:
    """Touches as they were, and as they act on the body: effects of the rig make the first, all others the second.

    Raises
    ------
    InputError
        The effects leave a touch without a load.
    """
    true = acting = plan.commanded(built)
    for effect, values in effects:
        acting = effect.pose(acting, values)
        if effect.stage == "rig":
            true = acting
    if not min(true.load.min(), acting.load.min()) > 0:
        names = ", ".join(effect.name for effect, _ in effects)
        raise InputError(f"with {names} of this size a touch is left without a load")
    return true, acting


def read(plan: Plan, built: Built, acting: Recording, effects: EffectValues, seed: int) -> FloatArray:
    """Readings (n, m) of touches, with the effects and without the noise of the sensor.

    What was read before is the mean reading of each touch with all effects but those of the noise, which is known once
    the readings are: it is found by going through the touches again, at most as often as there are touches.
    """
    recording = replace(acting, signal=built.press(acting))
    if not effects:
        return recording.signal
    steady = tuple(each for each in effects if each[0].stage != "noise")
    noise = effects[len(steady) :]
    readings = recording.signal
    for _ in range(len(plan.load)):
        history = History.of(plan.touch, plan.time_s, readings)
        before, readings = readings, _through(replace(recording, history=history), steady, seed)
        if np.all(np.abs(readings - before) <= SETTLED * recording.peak):
            break
    return _through(replace(recording, signal=readings), noise, seed)


def _through(recording: Recording, effects: EffectValues, seed: int) -> FloatArray:
    """Readings after the effects; each draws from a stream of its own, so that one does not change another."""
    for effect, values in effects:
        rng = np.random.default_rng([seed, FIRST_EFFECT_STREAM, crc32(effect.name.encode())])
        recording = replace(recording, signal=effect.simulate(recording, values, rng))
    return recording.signal
