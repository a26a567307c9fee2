"""The search for the mode of each touch."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayestouch.finger.reading import modes as module


def test_a_climb_ends_with_the_first_step_that_gains_next_to_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """A thousandth off the top of a standard normal density there is 5e-7 to gain: one step."""
    looks = []

    def expansion(posterior: Any, x: np.ndarray, blocks: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        looks.append(len(x))
        return -x, np.broadcast_to(np.eye(3), (len(x), 3, 3))

    monkeypatch.setattr(module, "_expansion", expansion)
    posterior: Any = SimpleNamespace(log_density=lambda x, blocks: -0.5 * (x**2).sum(axis=-1))
    posterior.without_ends, posterior.priors = posterior, SimpleNamespace(in_turn=lambda angle: angle)
    top, value = module._climb(posterior, np.array([[0.001, 0.0, 0.0]]), np.arange(1))
    assert looks == [1]
    np.testing.assert_allclose(top, np.zeros((1, 3)), atol=2e-5)
    np.testing.assert_allclose(value, [0.0], atol=1e-9)
