"""Derivatives of readings passed on through effects."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from bayestouch.chain.recording import Recording
from bayestouch.finger.derivatives import _along
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
