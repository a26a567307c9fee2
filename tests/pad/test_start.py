"""Where fits of pads start: the noise of a reading where no touch is repeated."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from bayestouch.pad.start import pad_noise


@pytest.mark.parametrize("reads", [1, 4])
def test_noise_of_one_reading_from_touches_that_follow_each_other(reads: int) -> None:
    """Residuals that alternate by ±a have second differences of ±4 a, in a mean of n reads √n times less than in one.

    The median size over √6 and over 0.6745, that of a normal variable, is the standard deviation.
    """
    sign = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
    size = np.array([0.02, 0.05])
    means = SimpleNamespace(
        readings=1.0 + sign[:, None] * size,
        counts=np.full((6, 2), reads),
        pure_error_variance=np.full(2, np.nan),
    )
    model = SimpleNamespace(
        known=SimpleNamespace(means=means, touch_time_s=np.arange(6.0)),
        predict=lambda vector: SimpleNamespace(touches=np.ones((6, 2))),
        chain=lambda vector: SimpleNamespace(offset=np.zeros(2)),
        n_elements=2,
        peak=np.ones(2),
    )
    found = pad_noise(model, np.zeros(0))  # type: ignore[arg-type]
    np.testing.assert_allclose(found, 4 * size * np.sqrt(reads / 6) / 0.6745, rtol=1e-12)
