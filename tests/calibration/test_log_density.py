"""The public density of a calibration: its transforms, its parts, and what it is not for."""

from __future__ import annotations

import numpy as np
import pytest
from known_fingers import dataset, known_touches
from scipy.stats import norm

import bayestouch
from bayestouch.calibration.log_density import LogDensity
from bayestouch.errors import InputError
from bayestouch.priors.parameters import LogNormal

DATA = dataset(known_touches(3, step=4.0))


@pytest.fixture(scope="module")
def calibration() -> bayestouch.Calibration:
    return bayestouch.calibrate(DATA, draws=200, seed=1, priors={"mu": LogNormal(0.16, 0.2)})


@pytest.fixture(scope="module")
def density(calibration: bayestouch.Calibration) -> LogDensity:
    return bayestouch.log_density(calibration, DATA)


def flat(calibration: bayestouch.Calibration) -> dict[str, np.ndarray]:
    return {name: draws.reshape(-1, *draws.shape[2:]) for name, draws in calibration.posterior.items()}


def test_draws_of_the_calibration_are_draws_of_the_density(
    calibration: bayestouch.Calibration, density: LogDensity
) -> None:
    """There and back; the log densities that the calibration keeps are of other coordinates, near by a constant."""
    draws = flat(calibration)
    points = density.from_parameters(draws)
    assert points.shape == (200, density.dimension) == (200, len(density.names))
    back = density.to_parameters(points)
    assert set(back) == set(draws)
    for name, values in draws.items():
        np.testing.assert_allclose(back[name], values, rtol=1e-9)
    log_density = density(points)
    # Twice minus the log density scatters as chi-square with so many degrees of freedom.
    assert log_density.std() == pytest.approx(np.sqrt(density.dimension / 2), rel=0.25)
    assert (points.mean(axis=0) - density.start) / np.sqrt(np.diag(density.covariance)) == pytest.approx(0, abs=0.5)


def test_one_point_is_a_vector(density: LogDensity) -> None:
    assert density(density.start).shape == ()
    assert density.touch_log_likelihood(density.start).shape == (len(np.unique(DATA.touches.touch)),)
    values = density.to_parameters(density.start)
    assert values["sigma"].shape == () and values["r_s"].shape == (7,)
    np.testing.assert_allclose(density.from_parameters(values), density.start, rtol=1e-12)


def test_the_density_is_prior_times_likelihood(calibration: bayestouch.Calibration, density: LogDensity) -> None:
    points = density.from_parameters(flat(calibration))[:5]
    np.testing.assert_allclose(density(points), density.log_prior(points) + density.log_likelihood(points))
    # μ alone moved: its prior is normal in the logarithm, as it was stated.
    moved = points.copy()
    place = density.names.index("log mu")
    moved[:, place] += 0.01
    prior = norm(np.log(0.16), 0.2)
    np.testing.assert_allclose(
        density.log_prior(moved) - density.log_prior(points),
        prior.logpdf(moved[:, place]) - prior.logpdf(points[:, place]),
        atol=1e-9,
    )
    # What is left of the likelihood's change is that of the touches: repeats say nothing of μ.
    np.testing.assert_allclose(
        density.log_likelihood(moved) - density.log_likelihood(points),
        (density.touch_log_likelihood(moved) - density.touch_log_likelihood(points)).sum(axis=1),
        atol=1e-6,
    )


def test_it_is_zero_outside_the_bounds(density: LogDensity) -> None:
    for end, step in zip(density.bounds, (-1, 1), strict=True):
        there = np.flatnonzero(np.isfinite(end))
        points = np.repeat(density.start[None], len(there), axis=0)
        points[np.arange(len(there)), there] = end[there] + step * 1e-6
        for log in (density, density.log_prior, density.log_likelihood):
            assert np.all(np.isneginf(log(points)))
        assert np.all(np.isneginf(density.touch_log_likelihood(points)))
        both = density.touch_log_likelihood(np.stack([points[0], density.start]))
        np.testing.assert_array_equal(both[1], density.touch_log_likelihood(density.start))
        assert np.isfinite(both[1]).all()


def test_what_does_not_fit_is_refused_in_a_line(calibration: bayestouch.Calibration, density: LogDensity) -> None:
    with pytest.raises(InputError, match=r"expected points \(n, 38\), got \(3,\)"):
        density([1.0, 2.0, 3.0])
    with pytest.raises(InputError, match="'mu' is missing"):
        density.from_parameters({n: v for n, v in density.to_parameters(density.start).items() if n != "mu"})
    with pytest.raises(InputError, match=r"^sigma: expected values of n points \(n,\), got shape \(4, 50\)$"):
        density.from_parameters(calibration.posterior)
    other = bayestouch.simulate(bayestouch.FingerDesign(n_elements=3), seed=0).dataset
    with pytest.raises(InputError, match="another sensor"):
        bayestouch.log_density(calibration, other)
    identified = bayestouch.calibrate(DATA, draws=8, e_map="empirical")
    with pytest.raises(InputError, match="identified E map"):
        bayestouch.log_density(identified, DATA)
