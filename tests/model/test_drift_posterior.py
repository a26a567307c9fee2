"""Size and time of a drift: their likelihood against dense covariance matrices, and the quadrature over them."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest
from pad_cases import CASES, recovered
from scipy import stats

from bayestouch.model.added import AddedEffect
from bayestouch.model.drift_filter import gaps
from bayestouch.model.drift_likelihood import DriftLikelihood
from bayestouch.model.drift_posterior import drift_posterior, moments
from bayestouch.model.fitting import Fitted

SIZES, TIMES = (0.003, 0.02), (15.0, 150.0)
DRIFTS = [case for case in CASES if case.name.endswith("_drift")]


def matern(time: np.ndarray, length: float) -> np.ndarray:
    """Correlation (t, t): (1 + √3 d/l) exp(-√3 d/l)."""
    lag = np.sqrt(3) * np.abs(time[:, None] - time) / length
    return np.asarray((1 + lag) * np.exp(-lag))


def written_out(fitted: Fitted, size: float, length: float) -> float:
    """Log density of the whitened means, normal about the prior means of the parameters, by scipy.stats."""
    model, linear, root = fitted.model, fitted.linear, fitted.whitening.root
    t, m = root.shape[:2]
    drift, values = fitted.drifts[0]
    if drift.name == "baseline_drift":
        scale = np.tile(model.peak, (t, 1))
    else:
        scale = model.predict(fitted.vector).touches - model.zero(fitted.vector)
    one_for_each = drift.name == "baseline_drift" or values[2] == 1.0
    between = np.eye(m) if one_for_each else np.ones((m, m))
    of_drift = np.einsum("tu,ef,te,uf->teuf", matern(model.known.touch_time_s, length), between, scale, scale)
    white = np.einsum("tij,tjuf->tiuf", root, of_drift)
    white = np.einsum("tiuf,ugf->tiug", white, root).reshape(t * m, t * m)
    covariance = np.eye(t * m) + linear.jacobian / linear.precision @ linear.jacobian.T + size**2 * white
    return float(stats.multivariate_normal(linear.jacobian @ linear.pull, covariance).logpdf(linear.residual.ravel()))


@pytest.mark.parametrize("case", DRIFTS, ids=lambda case: case.key)
def test_likelihood_is_that_of_the_exact_process(case: object) -> None:
    fitted = recovered(case, 1).fitted  # type: ignore[arg-type]
    pairs = list(product(SIZES, TIMES))
    found = DriftLikelihood.of(fitted, 0)(*np.array(pairs).T)
    wanted = np.array([written_out(fitted, *pair) for pair in pairs])
    # Up to a constant. Wide priors make the dense matrix uneven: its determinant is known to a thousandth.
    np.testing.assert_allclose(found - found[0], wanted - wanted[0], atol=0.01, rtol=1e-5)


def test_weights_of_another_drift_are_integrated_out() -> None:
    """As parameters of prior sd one: with a second drift that does nothing the likelihood is the same."""
    fitted = recovered(DRIFTS[0], 1).fitted
    (drift, values) = fitted.drifts[0]
    two = replace(fitted, drifts=((drift, values), (drift, (1e-9, *values[1:]))))
    pair = np.array([0.01, 0.02]), np.array([60.0, 30.0])
    np.testing.assert_allclose(DriftLikelihood.of(two, 0)(*pair), DriftLikelihood.of(fitted, 0)(*pair), atol=1e-4)
    # One that does the same takes all of it up: the likelihood prefers none besides.
    same = replace(fitted, drifts=((drift, values), (drift, values)))
    less, more = DriftLikelihood.of(same, 0)(np.array([1e-6, values[0]]), np.full(2, values[1]))
    assert less > more


def test_sessions_have_courses_of_their_own() -> None:
    rng = np.random.default_rng(3)
    gap = np.array([np.inf, 4.0, 9.0, np.inf, 2.0, 5.0, 1.0])
    rows, scale = rng.standard_normal((7, 3, 1)), rng.standard_normal((7, 3, 2))
    nothing = np.zeros((0, 0)), np.zeros(0)
    one, two = (DriftLikelihood(rows[part], scale[part], gap[part], *nothing) for part in (slice(3), slice(3, 7)))
    pair = np.array([0.5, 2.0]), np.array([3.0, 20.0])
    both = DriftLikelihood(rows, scale, gap, *nothing)(*pair)
    np.testing.assert_allclose(both, one(*pair) + two(*pair), rtol=1e-12)


def test_touches_are_taken_in_the_order_of_time() -> None:
    observed = SimpleNamespace(
        touch_time_s=np.array([50.0, 10.0, 120.0, 13.0, 100.0]), sessions=((0.0, 60.0), (90.0, 130.0))
    )
    order, gap = gaps(observed)  # type: ignore[arg-type]
    np.testing.assert_array_equal(order, [1, 3, 0, 4, 2])
    np.testing.assert_array_equal(gap, [np.inf, 3.0, 37.0, np.inf, 20.0])


@pytest.mark.parametrize("factor", [0.2, 1.0, 5.0])
def test_moments_of_a_normal_density(factor: float) -> None:
    """Wherever the first grid is, and whatever its size."""
    mean, covariance = np.array([3.0, -1.0]), np.array([[0.04, -0.05], [-0.05, 0.25]])
    density = stats.multivariate_normal(mean, covariance)
    found = moments(density.logpdf, mean + factor * np.array([0.5, -0.8]), factor**2 * np.diag([0.25, 0.64]))
    np.testing.assert_allclose(found[0], mean, atol=0.003)
    np.testing.assert_allclose(found[1], covariance, rtol=0.01)


def test_moments_of_a_skewed_density() -> None:
    """Logarithms of gamma variables of shape 5, those of a variance that five squares fix: ψ(5), ψ'(5)."""
    gamma = stats.gamma(5)
    mean, covariance = moments(
        lambda x: (gamma.logpdf(np.exp(x)) + x).sum(axis=1), np.array([0.0, 3.0]), np.diag([0.3, 0.3])
    )
    assert mean == pytest.approx(1.5061, abs=0.01)
    # Beyond 3.6 sd on the long side lies a fiftieth of the variance; grids that suit it to a fifth are as good.
    assert np.diag(covariance) == pytest.approx(0.2213, rel=0.05)


@pytest.mark.parametrize("case", DRIFTS, ids=lambda case: case.key)
def test_value_and_sd_are_those_of_a_fine_grid(case: object) -> None:
    fitted = recovered(case, 1).fitted  # type: ignore[arg-type]
    (size, time, *_), (sd_size, sd_time, *_) = drift_posterior(fitted, 0)
    logs = [np.log(v) + np.linspace(-5, 5, 33) * s / v for v, s in ((size, sd_size), (time, sd_time))]
    grid = np.stack(np.meshgrid(*logs, indexing="ij"), axis=-1).reshape(-1, 2)
    of_size, of_time = (each.prior for each in fitted.drifts[0][0].parameters[:2])
    log = DriftLikelihood.of(fitted, 0)(*np.exp(grid).T) + grid.sum(axis=1)
    log += of_size.log_density(np.exp(grid[:, 0])) + of_time.log_density(np.exp(grid[:, 1]))
    weight = np.exp(log - log.max())
    weight /= weight.sum()
    mean = weight @ grid
    sd = np.sqrt(weight @ (grid - mean) ** 2)
    # Seven nodes each way leave out what is beyond 3.6 sd, of a skewed posterior a hundredth of its variance or two.
    assert sd_size / size == pytest.approx(sd[0], rel=0.03)
    assert sd_time / time == pytest.approx(sd[1], rel=0.03)
    assert np.log([size, time]) == pytest.approx(mean, abs=0.05 * float(sd.min()))


def test_draws_are_log_normal() -> None:
    """Of size and time: of logarithms with the stated mean and sd; never negative."""
    (drift, values) = recovered(DRIFTS[1], 1).fitted.drifts[0]
    added = AddedEffect(drift, (0.02, 100.0, *values[2:]), (0.01, 60.0, float("nan")))
    normal = np.random.default_rng(1).standard_normal(40000)
    for which, (value, share) in enumerate(((0.02, 0.5), (100.0, 0.6))):
        logs = np.log(added.draws(which, normal))
        # 40,000 draws: their mean is known to a two-hundredth of an sd, their sd to 0.4 %.
        assert logs.mean() == pytest.approx(np.log(value), abs=0.02 * share)
        assert logs.std() == pytest.approx(share, rel=0.016)
    np.testing.assert_array_equal(added.draws(2, normal), values[2])
