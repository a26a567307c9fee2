"""Simulation of touches: from commanded touches to readings, with effects.

An effect converts commanded touches and measured loads to actual touches. Therefore the plan of touches is what was
commanded and measured, and the effects determine what was pressed.
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
# Readings that depend on earlier touches are iterated until none changes by more than this share of the peak.
SETTLED = 1e-12


def pressed(plan: Plan, built: Built, effects: EffectValues) -> tuple[Recording, Recording]:
    """Actual touches, and touches as they act on the body: only effects of the rig change the first.

    Raises
    ------
    InputError
        If the effects leave a touch without a load.
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
    """Readings (n, m) of touches with the effects, without the noise of the sensor.

    Effects of earlier readings use the mean readings of each touch with all effects except noise. These are only known
    after the readings are computed, so they are found by iteration, with at most as many steps as there are touches.
    """
    recording = replace(acting, signal=built.press(acting))
    if not effects:
        return recording.signal
    steady = tuple(each for each in effects if each[0].stage != "noise")
    noise = effects[len(steady) :]
    readings = recording.signal
    for _ in range(len(plan.load)):
        history = History.of(plan.touch, plan.time_s, readings)
        before, readings = readings, _with_effects(replace(recording, history=history), steady, seed)
        if np.all(np.abs(readings - before) <= SETTLED * recording.peak):
            break
    return _with_effects(replace(recording, signal=readings), noise, seed)


def _with_effects(recording: Recording, effects: EffectValues, seed: int) -> FloatArray:
    """Readings after the effects; each effect has its own random stream, so that effects do not change each other."""
    for effect, values in effects:
        rng = np.random.default_rng([seed, FIRST_EFFECT_STREAM, crc32(effect.name.encode())])
        recording = replace(recording, signal=effect.simulate(recording, values, rng))
    return recording.signal
