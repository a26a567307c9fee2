"""Derivatives of readings passed on through effects."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np
import pytest

from bayestouch.chain.recording import Recording
from bayestouch.effects.effect import Effect
from bayestouch.finger.derivatives import _along, by_peak, through_effects
from bayestouch.model.base import Predicted


def test_a_derivative_goes_along_what_moves_the_signal_of_some_elements() -> None:
    """Readings y = s², so that dy = 2 s ds, where only the second of two elements moves."""
    signal = np.array([[1.0, 2.0], [3.0, 5.0]])
    recording = Recording(
        indenter_radius_mm=np.full(2, np.nan),
        place=(np.zeros(2),),
        load=np.ones(2),
        time_s=np.zeros(2),
        held_s=np.zeros(2),
        element_place=(np.zeros(2),),
        peak=np.ones(2),
        reference_load=1.0,
        signal=signal,
    )
    model: Any = SimpleNamespace(
        effects=("one",), peak=np.ones(2), readings=lambda moved, vector: Predicted(moved.signal**2, None)
    )
    found = _along(model, recording, np.zeros(0), np.array([[7.0, 0.5], [7.0, -0.25]]), [1])
    np.testing.assert_allclose(found.touches, [[0.0, 2 * 2.0 * 0.5], [0.0, -2 * 5.0 * 0.25]], rtol=1e-6, atol=1e-9)


@dataclass(frozen=True)
class Bent(Effect):
    """Readings s (1 + s / unit), with unit = peak^(1 - w) mean(peak)^w."""

    weight: float
    parameters: tuple[Any, ...] = ()
    name: ClassVar[str] = "bent"
    mixes: ClassVar[bool] = False

    def signal(self, recording: Recording, values: Any) -> Any:
        unit = recording.peak ** (1 - self.weight) * recording.peak.mean() ** self.weight
        return recording.signal * (1 + recording.signal / unit)


class Flat(Bent):
    """Readings that do not depend on the peaks."""

    def signal(self, recording: Recording, values: Any) -> Any:
        return recording.signal * (1 + recording.signal)


@pytest.mark.parametrize("weight", [0.0, 0.3])
def test_readings_move_with_the_peaks_to_which_shares_refer(weight: float) -> None:
    """R = s (1 + s / u): over log peak of k it is -s²/u ((1 - w) δ + w peak_k / sum(peak)) by hand."""
    signal, peak = np.array([[1.0, 2.0, 0.5], [3.0, 5.0, 4.0]]), np.array([2.0, 5.0, 3.0])
    found = by_peak(*_bent(Bent(weight), signal, peak), np.zeros(0))
    unit = peak ** (1 - weight) * peak.mean() ** weight
    for k in range(3):
        exact = -(signal**2) / unit * ((1 - weight) * (np.arange(3) == k) + weight * peak[k] / peak.sum())
        np.testing.assert_allclose(found[k].touches, exact, rtol=1e-6, atol=1e-9)
    assert by_peak(*_bent(Flat(weight), signal, peak), np.zeros(0)) == []


def test_if_all_shares_are_of_the_own_peak_readings_grow_with_the_response() -> None:
    """The response multiplies signal and peak, so that it multiplies the reading: the derivative is the reading."""
    signal, peak = np.array([[1.0, 2.0], [3.0, 5.0]]), np.array([2.0, 5.0])
    model, recording = _bent(Bent(0.0), signal, peak)
    of_signal = np.stack([signal, *np.zeros((4, *signal.shape))])
    found = through_effects(model, recording, np.zeros(0), of_signal)
    reading = signal * (1 + signal / peak)
    for e in range(2):
        np.testing.assert_allclose(found[e].touches, np.where(np.arange(2) == e, reading, 0.0), rtol=1e-6)


def _bent(effect: Effect, signal: np.ndarray, peak: np.ndarray) -> tuple[Any, Recording]:
    """A model of one effect, and touches with these signals and peaks."""
    n = len(signal)
    recording = Recording(
        indenter_radius_mm=np.full(n, np.nan),
        place=(np.zeros(n),),
        load=np.ones(n),
        time_s=np.zeros(n),
        held_s=np.zeros(n),
        element_place=(np.zeros(len(peak)),),
        peak=peak,
        reference_load=1.0,
        signal=signal,
    )
    model = SimpleNamespace(
        effects=(effect,),
        peak=peak,
        n_elements=len(peak),
        readings=lambda moved, vector: Predicted(effect.signal(moved, ()), None),
    )
    return model, recording
