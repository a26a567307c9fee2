"""What a pad's model says of touches that it was not fitted to."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayestouch.model.base import Predicted
from bayestouch.pad import held_out as module


def test_uncertainty_of_held_out_touches_is_that_of_their_means(monkeypatch: pytest.MonkeyPatch) -> None:
    """The design is of the derivatives of means, (1, 2, 1), not of those of the six samples, (1, 6, 1)."""
    of_touches, of_samples = np.full((1, 2, 1), 3.0), np.full((1, 6, 1), 7.0)
    means = SimpleNamespace(
        readings=np.array([[1.0], [2.0]]),
        counts=np.full((2, 1), 3),
        reads_of_load=np.array([1.0, 3.0]),
        x_mm=np.zeros(2),
        y_mm=None,
    )
    observed: Any = SimpleNamespace(
        means=means,
        row_touch=np.repeat([0, 1], 3),
        load=np.ones(2),
        deviation=np.zeros((6, 1)),
        weight=np.ones(6),
    )
    noise = SimpleNamespace(
        load_sd=np.full(2, 0.1), with_=lambda load_sd: SimpleNamespace(load_sd=load_sd, variance=variance)
    )

    def variance(signal: np.ndarray, weight: np.ndarray) -> np.ndarray:
        return np.full(signal.shape, 0.01)

    model: Any = SimpleNamespace(
        observing=lambda rows: model,
        predict=lambda vector: Predicted(np.array([[1.0], [1.5]]), None),
        known=observed,
        load=np.ones(2),
        by_load=lambda vector: np.ones((2, 1)),
        poses=lambda vector: SimpleNamespace(place=(np.zeros(2),)),
        chain=lambda vector: SimpleNamespace(offset=0.0),
        derivatives=lambda vector: (of_touches, of_samples),
        element_place=(np.zeros(1),),
    )
    whitening = SimpleNamespace(present=np.ones((2, 1), dtype=bool), touches=lambda rows: rows, log_volume=np.zeros(2))
    stubs: dict[str, Any] = {
        "PadModel": SimpleNamespace,
        "without_wrong_readings": lambda fitted, observed: observed,
        "functions_at": lambda *given: (0.0, np.zeros((0, 2, 1))),
        "Whitening": SimpleNamespace(of=lambda *given: whitening),
        "design_of": lambda fitted, slopes, functions, whitening: slopes,
        "quantities": lambda *given: (),
        "free_load": lambda *given: np.zeros(2),
    }
    for name, stub in stubs.items():
        monkeypatch.setattr(module, name, stub)
    fitted: Any = SimpleNamespace(model=model, vector=None, noise=noise)
    found = module.held_out(fitted, None, observed, np.array([0.5]))
    np.testing.assert_array_equal(found.design, of_touches)
    np.testing.assert_allclose(found.residual, [[0.0], [1.0]])
    # One reading of the load errs by the median of 0.1 and 0.1 √3; the second touch has three.
    one = 0.05 * (1 + np.sqrt(3))
    wanted = np.sqrt(0.01 + one**2 / np.array([1.0, 3.0])) / 0.5
    np.testing.assert_allclose(found.noise_sd[:, 0], np.repeat(wanted, 3))
