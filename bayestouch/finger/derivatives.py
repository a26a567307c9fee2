"""Derivatives of the readings of a finger with effects, from the derivatives of its signals (chain rule)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.recording import Recording
from bayestouch.model.base import Predicted, SensorModel, difference

# Step of the central difference of readings over a signal, over the peak.
SIGNAL_STEP = 1e-4


def through_effects(
    model: SensorModel, recording: Recording, vector: FloatArray, of_signal: FloatArray
) -> list[Predicted]:
    """Derivative of the readings over each base parameter of a finger of m elements, 3 m + 2 of them.

    Parameters
    ----------
    model : SensorModel
        The finger with its effects.
    recording : Recording
        Its touches with the signal before the effects on the signal.
    vector : (d,) array
        Parameters of the finger.
    of_signal : (5, t, m) array
        Derivative of the signal over the log response, depth (mm) and angle (rad) of the element, then σ and log μ.
    """
    m, own = model.n_elements, range(3)
    if any(effect.mixes for effect in model.effects):
        of_own = [_along(model, recording, vector, of_signal[block], [e]) for block in own for e in range(m)]
        return of_own + [_along(model, recording, vector, of_signal[block], range(m)) for block in (3, 4)]
    # Effects that do not mix elements: one difference for all elements together.
    out = []
    for block, direction in enumerate(of_signal):
        whole = _along(model, recording, vector, direction, range(m))
        out += [_of_element(whole, e) for e in range(m)] if block in own else [whole]
    return out


def by_signal(model: SensorModel, recording: Recording, vector: FloatArray) -> FloatArray:
    """Derivative of the readings over the signals before the effects, (t, m, m); the last axis is that of the signals.

    Parameters are as in `through_effects`.
    """
    t, m = recording.signal.shape
    one = np.ones((t, m))
    if any(effect.mixes for effect in model.effects):
        return np.stack([_along(model, recording, vector, one, [e]).touches for e in range(m)], axis=-1)
    return np.asarray(_along(model, recording, vector, one, range(m)).touches[:, :, None] * np.eye(m))


def _along(
    model: SensorModel, recording: Recording, vector: FloatArray, of_signal: FloatArray, elements: Sequence[int]
) -> Predicted:
    """Derivative of the readings along a derivative (t, m) of the signal, for changes of some elements only."""
    moved = np.zeros_like(of_signal)
    moved[:, elements] = of_signal[:, elements]
    if not model.effects:
        return Predicted(moved, None)
    size = float(np.abs(moved).max())
    step = SIGNAL_STEP * float(model.peak.mean()) / size if size > 0 else 1.0

    def at(sign: float) -> Predicted:
        return model.readings(replace(recording, signal=recording.signal + sign * step * moved), vector)

    return difference(at, step)


def _of_element(whole: Predicted, element: int) -> Predicted:
    """The derivative for one element; zero for all others."""
    only = np.arange(whole.touches.shape[1]) == element
    samples = None if whole.samples is None else np.where(only, whole.samples, 0.0)
    return Predicted(np.where(only, whole.touches, 0.0), samples)
