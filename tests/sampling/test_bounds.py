"""Normal variables between bounds, against quadrature of the density, near the centre and far in either tail."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import ndtr
from scipy.stats import truncnorm

from bayestouch.sampling.bounds import falling_from_bounds, normal_between

BOUNDS = [(-1.0, 2.0), (-np.inf, 0.5), (-31.0, 3.0), (-6.0, -5.0), (20.0, np.inf), (-29.0, -28.0)]
FAR = [(-111.0, -96.2), (-np.inf, -45.0), (50.0, np.inf), (31.0, 31.5), (-40.0, -31.0), (200.0, 200.1)]


def below(value: float, low: float, high: float) -> float:
    """Share of a standard normal density between bounds that is below a value."""
    nearest = float(np.clip(0.0, low, high))
    # Beyond this the density has fallen by e^-60 from its largest value.
    reach = min(11.0, 60 / max(abs(nearest), 1e-9))
    low, high = max(low, nearest - reach), min(high, nearest + reach)

    def density(at: float) -> float:
        return float(np.exp(0.5 * (nearest**2 - at**2)))

    parts = [quad(density, a, b, epsabs=0, epsrel=1e-11, limit=200)[0] for a, b in ((low, value), (value, high))]
    return parts[0] / sum(parts)


@pytest.mark.parametrize(("low", "high"), BOUNDS + FAR)
def test_quantiles_and_derivative(low: float, high: float) -> None:
    z = np.array([-2.5, -1.0, 0.0, 0.7, 2.0])
    n, step = len(z), 1e-4
    found, log_derivative = normal_between(z, np.full(n, low), np.full(n, high))
    assert np.all((found >= low) & (found <= high))
    for value, standard in zip(found.tolist(), z.tolist(), strict=True):
        assert below(value, low, high) == pytest.approx(ndtr(standard), rel=1e-6)
    up, down = (normal_between(z + s, np.full(n, low), np.full(n, high))[0] for s in (step, -step))
    # Differences of values of size 200 lose digits: 1e-14 of 200 over 2e-4 is 1e-8, of a derivative of 0.0003.
    assert np.exp(log_derivative) == pytest.approx((up - down) / (2 * step), rel=1e-3)


def test_bounds_of_all_kinds_in_one_call() -> None:
    """Each variable with its own bounds gives what it gives alone."""
    every = BOUNDS + FAR
    z = np.linspace(-1.5, 1.5, len(every))
    together = normal_between(z, *np.array(every).T)
    for k, (low, high) in enumerate(every):
        alone = normal_between(z[k : k + 1], np.array([low]), np.array([high]))
        assert [together[0][k], together[1][k]] == [alone[0][0], alone[1][0]]


@pytest.mark.parametrize("steep", [2.0, 50.0, 4000.0])
def test_a_density_that_falls_from_a_bound(steep: float) -> None:
    """exp(-steep x - x²/2) for x ≥ 0, times a normal density of y about 0.7 x: mean of x by quadrature, y given x."""
    precision = np.array([[1 + 0.7**2, -0.7], [-0.7, 1.0]])
    beyond, covariance = falling_from_bounds(np.array([-steep, 0.0]), np.linalg.inv(precision), 8.0)
    sd = float(np.sqrt(covariance[0, 0]))
    assert abs(beyond[0]) <= 8 * sd * (1 + 1e-9)
    found = truncnorm(-beyond[0] / sd, np.inf, loc=beyond[0], scale=sd)
    weights = [quad(lambda x, k=k: x**k * np.exp(-steep * x - x**2 / 2), 0, 30 / steep)[0] for k in (0, 1)]
    # Eight standard deviations from the mean, the mean beyond a bound is (1 - 2/64) over the slope.
    assert found.mean() == pytest.approx(weights[1] / weights[0], rel=0.035)
    assert found.std() == pytest.approx(found.mean(), rel=0.25)
    assert covariance[0, 1] / covariance[0, 0] == pytest.approx(0.7, rel=1e-6)
    assert beyond[1] / beyond[0] == pytest.approx(0.7, rel=1e-6)
    assert covariance[1, 1] - covariance[0, 1] ** 2 / covariance[0, 0] == pytest.approx(1.0, rel=1e-6)
