"""Noise that fits with effects start from: repeats, or the scatter far from contact."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayestouch.finger.start import plain_noise


def noise(variance: list[float], predicted: np.ndarray, residual: np.ndarray, reads: int = 4) -> Any:
    counts = np.full(predicted.shape, reads)
    means = SimpleNamespace(
        pure_error_variance=np.array(variance),
        readings=predicted + residual,
        counts=np.where(np.isnan(residual), 0, counts),
    )
    model: Any = SimpleNamespace(known=SimpleNamespace(means=means), peak=np.full(len(variance), 100.0))
    return plain_noise(model, predicted, np.full(len(predicted), 0.5))


@pytest.mark.parametrize(("far", "size"), [(10, 0.1), (9, 0.8)])
def test_scatter_far_from_contact(far: int, size: float) -> None:
    """Of ten readings below 3 % of the peak or more, else of all; a reading is twice as wide as a mean of four."""
    predicted = np.where(np.arange(30) < far, 2.99, 3.01)[:, None] * np.ones(2)
    residual = (
        np.where(np.arange(30) < far, 0.1, 0.8)[:, None] * np.where(np.arange(30) % 2, 1, -1)[:, None] * np.ones(2)
    )
    found = noise([0.09, np.nan], predicted, residual)
    np.testing.assert_allclose(found.sd, [0.3, 2 * size / 0.6745])
    np.testing.assert_array_equal(found.load_sd, np.full(30, 0.5))
    np.testing.assert_allclose(noise([0.0, 0.04], predicted, residual).sd, [2 * size / 0.6745, 0.2])


def test_an_element_without_readings_or_noise() -> None:
    """One has none at all; one reads the same to a millionth of its peak."""
    residual = np.stack([np.full(12, np.nan), np.full(12, 1e-9)], axis=1)
    np.testing.assert_allclose(noise([np.nan, 1e-20], np.zeros((12, 2)), residual).sd, [1.0, 1e-4])
