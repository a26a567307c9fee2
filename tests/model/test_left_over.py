"""What a model leaves over of each element's readings, and the noise of loads, by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayestouch.model.left_over import discrepancy, force_noise


def fitted(squares: list[float], present: np.ndarray, reads: int = 4) -> Any:
    """Every whitened residual of an element has this square; noise of 2 a reading."""
    linear = SimpleNamespace(plain=np.sqrt(np.array(squares)) * present)
    means = SimpleNamespace(counts=np.full(present.shape, reads))
    model = SimpleNamespace(known=SimpleNamespace(means=means))
    noise = SimpleNamespace(sd=np.full(present.shape[1], 2.0))
    return SimpleNamespace(linear=linear, whitening=SimpleNamespace(present=present), model=model, noise=noise)


def test_mean_squares_are_drawn_together() -> None:
    """13 touches, 10 degrees of freedom each: mean squares 1.3·(5, 2, 1), their own variance 2/10."""
    found = discrepancy(fitted([5.0, 2.0, 1.0], np.ones((13, 3), dtype=bool)))
    square = 1.3 * np.array([5.0, 2.0, 1.0])
    between = square.var() - 0.2
    shrunk = (square * between + square.mean() * 0.2) / (between + 0.2)
    # A mean of four readings has half the noise of one.
    np.testing.assert_allclose(found, np.sqrt(shrunk - 1) * 2 / 2)


def test_elements_count_by_their_touches() -> None:
    """One element has 23 touches, the other 13: 20 and 10 degrees of freedom; one is dead."""
    present = np.ones((23, 3), dtype=bool)
    present[13:, 1] = present[:, 2] = False
    found = discrepancy(fitted([5.0, 2.0, 9.0], present))
    square = np.array([5 * 23 / 20, 2 * 13 / 10])
    whole = (square @ [23, 13]) / 36
    between = square.var() - (2 / 20 + 2 / 10) / 2
    shrunk = (square * between + whole * np.array([0.1, 0.2])) / (between + np.array([0.1, 0.2]))
    np.testing.assert_allclose(found, [*np.sqrt(shrunk - 1), 0.0])


@pytest.mark.parametrize(("square", "counts"), [(1.62, False), (1.64, True)])
def test_a_mean_within_its_scatter_is_none(square: float, counts: bool) -> None:
    """Two standard errors sqrt(2/20) of two elements with 10 degrees of freedom: 1.632."""
    found = discrepancy(fitted([square / 1.3] * 2, np.ones((13, 2), dtype=bool)))
    # Alike: each is the mean.
    np.testing.assert_allclose(found, np.sqrt(square - 1) if counts else 0.0)


def test_few_touches_and_none() -> None:
    """Four touches leave one degree of freedom; so do three."""
    found = discrepancy(fitted([9.0], np.ones((4, 1), dtype=bool)))
    np.testing.assert_allclose(found, np.sqrt(36 - 1))
    np.testing.assert_allclose(discrepancy(fitted([9.0], np.ones((3, 1), dtype=bool))), np.sqrt(27 - 1))
    np.testing.assert_array_equal(discrepancy(fitted([9.0, 9.0], np.zeros((4, 2), dtype=bool))), [0.0, 0.0])


def test_noise_of_one_reading_of_the_load() -> None:
    """Standard errors times the root of the number of reads of the load; the median of the measured ones."""
    means = SimpleNamespace(load=np.array([5.0, np.nan, 6.0, 7.0]), reads_of_load=np.array([4.0, 9.0, 9.0, 1.0]))
    fitted: Any = SimpleNamespace(
        model=SimpleNamespace(known=SimpleNamespace(means=means)),
        noise=SimpleNamespace(load_sd=np.array([1.0, 100.0, 1.5, 3.5])),
    )
    # 1 · 2, 1.5 · 3 and 3.5 · 1
    assert force_noise(fitted) == 3.5
