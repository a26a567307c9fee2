"""Effects of the catalogue in a simulation: those of other packages, and others that it has no formula of its own for.

An effect of the catalogue takes touches as commanded and loads as read to touches as they were. So here the plan is
what is commanded and read, and the effect says what was pressed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.recording import History, Recording
from bayestouch.data.sensor import Finger, Sensor
from bayestouch.effects import Effect, NoiseEffect, RandomEffect, Setting, Values, effect_classes
from bayestouch.errors import InputError
from bayestouch.simulation.recording import LIFT_INTERVAL_S, SAMPLE_INTERVAL_S, Plan, SimulatedRecording

Stated = tuple[tuple[Effect, Values], ...]


def stated_effects(effects: Mapping[str, float], plan: Plan, sensor: Sensor, reference_load: float) -> Stated:
    """Effects by name with the value of their first parameter; shapes are those of the first probe.

    Raises
    ------
    InputError
        An effect cannot occur in this design, its value is outside its prior's bounds, or it acts on what a simulation
        makes in its own way: the finger itself, or the noise.
    """
    setting, out = _setting(plan, sensor, reference_load), []
    for name, value in effects.items():
        kind = effect_classes()[name]
        if issubclass(kind, RandomEffect | NoiseEffect) or kind.finger is not Effect.finger:
            raise InputError(f"effect {name} changes the finger or the noise, or wanders: it cannot be simulated so")
        effect = kind.suited(setting)
        if effect is None:
            raise InputError(f"effect {name} cannot occur, or not be seen, in this design")
        first, *others = effect.parameters
        low, high = first.prior.support
        if not low <= value <= high:
            raise InputError(f"effect {name}: expected a number from {low:g} to {high:g}, got {value:g}")
        shape = (each.probes[0] if each.null is None else each.null for each in others)
        out.append((effect, (float(value), *shape)))
    return tuple(out)


def really_pressed(recording: SimulatedRecording, effects: Stated, reference_load: float) -> SimulatedRecording:
    """Touches as they were, of touches as commanded; what the force sensor reads stays."""
    for effect, values in effects:
        moved = effect.pose(_as_chain(recording, reference_load), values)
        recording = replace(recording, place=moved.place, load=moved.load, indenter_radius_mm=moved.indenter_radius_mm)
    return recording


def as_read(recording: SimulatedRecording, effects: Stated, reference_load: float) -> SimulatedRecording:
    """Readings with the effects."""
    for effect, values in effects:
        recording = replace(recording, signal=effect.signal(_as_chain(recording, reference_load), values))
    return recording


def _as_chain(recording: SimulatedRecording, reference_load: float) -> Recording:
    return Recording(
        indenter_radius_mm=recording.indenter_radius_mm,
        place=recording.place,
        load=recording.load,
        time_s=recording.time_s,
        held_s=recording.held_s,
        element_place=recording.element_place,
        peak=recording.peak,
        reference_load=reference_load,
        signal=recording.signal,
        history=_history(recording),
    )


def _history(recording: SimulatedRecording) -> History:
    first = np.flatnonzero(recording.sample == 0)
    last = np.append(first[1:], len(recording.touch)) - 1
    count = (last - first + 1)[:, None]
    mean = np.add.reduceat(recording.signal, first, axis=0) / count
    return History(recording.time_s[first], recording.time_s[last], mean)


def _setting(plan: Plan, sensor: Sensor, reference_load: float) -> Setting:
    body = sensor.body
    place: tuple[FloatArray, ...]
    if isinstance(body, Finger):
        place = (np.asarray(body.element_angles_deg, dtype=float),)
        radii, contact = (body.core_radius_mm, body.outer_radius_mm), "layer"
    else:
        columns = (body.element_x_mm, body.element_y_mm)
        place = tuple(np.asarray(axis, dtype=float) for axis in columns if axis is not None)
        radii, contact = (0.0, 0.0), ""
    return Setting(
        finger=isinstance(body, Finger),
        n_elements=body.n_elements,
        element_place=place,
        place_range=tuple((float(axis.min()), float(axis.max())) for axis in plan.place),
        reference_load=reference_load,
        load_unit=body.load_unit,
        contact=contact,
        has_edges=bool((plan.indenter_radius_mm == 0).any()),
        hold_s=(plan.samples - 1) * SAMPLE_INTERVAL_S,
        gap_s=LIFT_INTERVAL_S + SAMPLE_INTERVAL_S,
        span_s=float(plan.time_s[-1] - plan.time_s[0]),
        radii_mm=radii,
    )
