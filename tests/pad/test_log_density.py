"""The public density of a pad's calibration: what `calibrate` draws from, made again from calibration and data set."""

from __future__ import annotations

import numpy as np
import pytest
from pad_simulation import line

import bayestouch
from bayestouch.errors import InputError
from bayestouch.results.keys import effect_names


@pytest.fixture(scope="module")
def made() -> tuple[bayestouch.DataSet, bayestouch.Calibration]:
    pad, rng = line(), np.random.default_rng(3)
    place = np.linspace(6, 32, 30)[:, None]
    dataset = pad.dataset(pad.touch(place, rng, load=rng.uniform(0.8, 1.2, 30), measured=True, samples=2))
    return dataset, bayestouch.calibrate(dataset, kernel="gaussian", draws=400, seed=2)


def test_density_is_highest_at_the_mode_of_the_calibration(
    made: tuple[bayestouch.DataSet, bayestouch.Calibration],
) -> None:
    dataset, calibration = made
    density = bayestouch.log_density(calibration, dataset)
    start = density.from_parameters(calibration.mode)
    np.testing.assert_allclose(start, density.start, rtol=1e-9)
    draws = {name: values.reshape(400, *values.shape[2:]) for name, values in calibration.posterior.items()}
    points = density.from_parameters(draws)
    for name, values in density.to_parameters(points).items():
        np.testing.assert_allclose(values, draws[name], rtol=1e-12)
    below = density(start) - density(points)
    # Half a chi-square of 13 degrees of freedom: mean 6.5, and an sd of its mean of 0.13 with 400 draws.
    assert below.mean() == pytest.approx(6.5, abs=0.7)
    assert density(points) == pytest.approx(density.log_prior(points) + density.log_likelihood(points), rel=1e-9)
    np.testing.assert_allclose(calibration.groups["sample_stats"]["lp"].ravel(), density(points), rtol=1e-8)
    assert density.units[0] == "kPa/N" and density.names[-1] == "log w"
    if calibration.settings["empirical_map"] == "no":
        total = density.touch_log_likelihood(points[:5]).sum(axis=1)
        np.testing.assert_allclose(total, density.log_likelihood(points[:5]), rtol=1e-9)
    assert effect_names(calibration.settings) == []


def test_touches_have_no_likelihood_of_their_own_with_an_empirical_map(
    made: tuple[bayestouch.DataSet, bayestouch.Calibration],
) -> None:
    """Without drifts and corrections the map alone is the reason, and the message names it."""
    dataset, _ = made
    density = bayestouch.log_density(bayestouch.calibrate(dataset, e_map="empirical", draws=8), dataset)
    with pytest.raises(InputError) as error:
        density.touch_log_likelihood(density.start)
    assert str(error.value) == (
        "drifts, corrections or an empirical map tie the touches together: they have no likelihood each"
    )
