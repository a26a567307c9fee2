"""Derivatives of the readings of a finger with effects, from the derivatives of its signals (chain rule)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.recording import Recording
from bayestouch.effects.effect import Effect
from bayestouch.model.base import Predicted, SensorModel, difference, of_element

# Steps of the central differences of readings: over a signal, in peaks, and over the logarithm of a peak.
SIGNAL_STEP, PEAK_STEP = 1e-4, 1e-4


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
        out = [_along(model, recording, vector, of_signal[block], [e]) for block in own for e in range(m)]
        out += [_along(model, recording, vector, of_signal[block], range(m)) for block in (3, 4)]
    else:
        # Effects that do not mix elements: one difference for all elements together.
        out = []
        for block, direction in enumerate(of_signal):
            whole = _along(model, recording, vector, direction, range(m))
            out += [of_element(whole, e) for e in range(m)] if block in own else [whole]
    for e, more in enumerate(by_peak(model, recording, vector)):
        out[e] = _sum(out[e], more)
    return out


def by_peak(model: SensorModel, recording: Recording, vector: FloatArray) -> list[Predicted]:
    """Derivative of the readings over the logarithm of each element's peak, to which shares of effects refer.

    Parameters are as in `through_effects`. The list has m entries; it is empty if no effect uses the peaks.
    """
    if not any(type(effect).signal is not Effect.signal for effect in model.effects):
        return []

    def along(elements: Sequence[int]) -> Predicted:
        moved = np.isin(np.arange(model.n_elements), elements)

        def at(sign: float) -> Predicted:
            peak = recording.peak * np.exp(sign * PEAK_STEP * moved)
            return model.readings(replace(recording, peak=peak), vector)

        return difference(at, PEAK_STEP)

    whole = along(range(model.n_elements))
    used = np.flatnonzero(whole.touches.any(axis=0))
    if not len(used):
        return []
    # An effect may use the mean peak of all elements: then the peak of one moves the readings of others.
    first = along([int(used[0])]).touches
    if np.allclose(first, of_element(whole, int(used[0])).touches, rtol=1e-6, atol=1e-9 * np.abs(whole.touches).max()):
        return [of_element(whole, e) for e in range(model.n_elements)]
    return [along([e]) for e in range(model.n_elements)]


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


def _sum(one: Predicted, other: Predicted) -> Predicted:
    """Sum of two derivatives."""
    samples = None if one.samples is None or other.samples is None else one.samples + other.samples
    return Predicted(one.touches + other.touches, samples)
