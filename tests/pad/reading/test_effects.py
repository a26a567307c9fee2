"""True loads of touches on a pad that is read with effects, worked out by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayestouch.pad.reading.effects import true_load_prior, with_true_loads

#: The acting load is the square root of the true one.
EFFECTS: Any = SimpleNamespace(pressing=np.square, pressing_slope=lambda acting: 2 * acting)
READER: Any = SimpleNamespace(load_measured=True, load=1.5, load_sd=0.3)
CALIBRATED = np.sqrt(np.array([1.0, 2.0, 3.0, np.nan]))


def resampled(draws: np.ndarray, numbers: list[int], measured: list[float]) -> dict[str, np.ndarray]:
    """Draws (2, n, t) of acting loads, and of places that are ten times as large."""
    given = {"x": 10 * draws, "P": draws}
    return with_true_loads(given, EFFECTS, READER, CALIBRATED, np.array(measured), np.array(numbers), 3)


def test_draws_of_a_touch_without_a_load_do_not_depend_on_the_other_touches() -> None:
    draws = np.random.default_rng(0).normal(1.5, 0.3, (2, 500, 3))
    whole = resampled(draws.copy(), [4, 7, 12], [np.nan, np.nan, np.nan])
    alone = resampled(draws[..., 1:2].copy(), [7], [np.nan])
    for name in ("x", "P"):
        np.testing.assert_array_equal(whole[name][..., 1:2], alone[name])
    np.testing.assert_allclose(whole["P"], (whole["x"] / 10) ** 2, rtol=1e-14)
    # The random numbers of another touch are others.
    same = resampled(np.repeat(draws[..., :1], 2, axis=-1), [4, 5], [np.nan, np.nan])
    assert (same["P"][..., 0] != same["P"][..., 1]).any()


def test_the_prior_is_normal_in_the_true_load() -> None:
    """Against a sum over the draws of acting loads, weighted; a touch with a measured load has its own draws."""
    draws = np.random.default_rng(1).normal(1.5, 0.3, (2, 20000, 2))
    found = resampled(draws.copy(), [1, 2], [np.nan, 1.4])["P"]
    true = draws**2
    np.testing.assert_array_equal(found[..., 1], true[..., 1])
    mean, sd = np.mean([1.0, 2.0, 3.0]), np.std([1.0, 2.0, 3.0])
    weight = 2 * draws * np.exp(-0.5 * ((true - mean) / sd) ** 2 + 0.5 * ((draws - 1.5) / 0.3) ** 2)
    wanted = np.average(true[..., 0], weights=weight[..., 0])
    # Four standard errors of 40,000 draws of a standard deviation of about 0.8.
    assert found[..., 0].mean() == pytest.approx(wanted, abs=4 * 0.8 / 200)


def test_one_load_in_the_calibration_is_a_prior_as_wide_as_the_load() -> None:
    assert true_load_prior(EFFECTS, CALIBRATED) == pytest.approx((2.0, np.sqrt(2 / 3)))
    assert true_load_prior(EFFECTS, np.full(7, 1.1)) == pytest.approx((1.21, 1.21))
