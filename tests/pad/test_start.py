"""Where fits of pads start: the noise of a reading where no touch is repeated, and the map."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from pad_simulation import uneven

from bayestouch.model.split_data import SplitData
from bayestouch.pad.start import pad_fit, pad_noise


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


def test_the_start_of_a_search_predicts_as_the_calibration_does() -> None:
    """The map of the start, whose weights are parameters, against the random function of the calibration.

    Both are fitted to the same touches, means of three readings with a noise of 0.003 under loads that are measured to
    0.01 N. They differ by 0.24 of the noise, because only one takes errors of the load as common to elements.
    With two functions to each correlation length they differed by 1.3 of it.
    """
    data = SplitData.of(uneven(2))
    training, table = data.observations(data.training), data.table.select(data.training)
    fitted, models = pad_fit(training, table, data.dataset)
    calibrated = max((each for each in models.values() if each.has_map), key=lambda each: each.score).fit
    expected = calibrated.predicted()
    per_load = (expected - calibrated.chain.offset) / fitted.model.load[:, None]
    noise = np.hypot(0.003, 0.01 * per_load) / np.sqrt(3)
    difference = (fitted.model.predict(fitted.vector).touches - expected) / noise
    assert np.sqrt(np.mean(difference**2)) < 0.4
