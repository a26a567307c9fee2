"""The map of a finger with a drift follows the values of the drift."""

from __future__ import annotations

import numpy as np
import pytest

import bayestouch
from bayestouch.calibration.with_effects import fit_stated
from bayestouch.effects.stated import StatedModel
from bayestouch.finger.density_with_effects import EffectPosterior
from bayestouch.finger.drift_nodes import DriftNodes
from bayestouch.finger.fit_with_effects import EffectFit, effect_fit
from bayestouch.finger.layout import FlatLayout


@pytest.fixture(scope="module")
def fit() -> EffectFit:
    data = bayestouch.simulate(bayestouch.FingerDesign(n_elements=3), seed=1, effects={"gain_drift": 0.04}).dataset
    model = StatedModel("finger", "layer", (("gain_drift", {}),))
    stated = fit_stated(data, model, draws=8, seed=0, contact="layer")
    start = stated.evaluation.start
    known = start.fitted.model.known
    return effect_fit(stated.fitted, stated.added, EffectPosterior.of(stated.fitted, start.priors, known))


def points(fit: EffectFit, n: int, end: float) -> tuple[np.ndarray, np.ndarray]:
    """Points of the normal proposal (n, d) with the drift's values so many sds from the fitted ones.

    Also half the sum of squares (n,) of the other coordinates.
    """
    at = fit.posterior.layout
    noise = slice(at.n_chain, at.further.start)
    k = noise.stop - noise.start
    normal = np.random.default_rng(4).standard_normal((n, at.further.start))
    out = np.concatenate([normal, np.full((n, at.n_further), end)], axis=1)
    out[:, noise] = fit.shape.centre[:k] + normal[:, noise] @ np.linalg.cholesky(fit.shape.covariance[:k, :k]).T
    return out, 0.5 * (normal**2).sum(axis=1)


@pytest.mark.parametrize("end", [-1.5, 0.0, 1.5])
def test_the_responses_are_as_wide_as_a_drift_of_this_size_leaves_them(fit: EffectFit, end: float) -> None:
    """Against the exact density by importance sampling, with the log sd and the log time of the drift held.

    With the precision at the fitted values the sds of the points are 2.3 times the exact ones at the lower end, and 0.6
    times at the upper one. The weighted sample is worth more than 240 draws: the error of an sd is 5 %.
    """
    z, squares = points(fit, 800, end)
    vectors, log_derivative = fit.to_vectors(z)
    log_weight = fit.density(vectors) + log_derivative + squares
    weight = np.exp(log_weight - log_weight.max())
    weight /= weight.sum()
    response = vectors[:, fit.posterior.layout.response]
    exact = np.sqrt(weight @ (response - weight @ response) ** 2)
    assert 1 / (weight**2).sum() > 100
    np.testing.assert_allclose(response.std(axis=0) / exact, 1.0, atol=0.2)


@pytest.mark.parametrize("end", [-1.0, 1.3])
def test_log_derivative_of_the_map(fit: EffectFit, end: float) -> None:
    point = points(fit, 1, end)[0][0]
    steps = 1e-5 * np.eye(len(point))
    jacobian = (fit.to_vectors(point + steps)[0] - fit.to_vectors(point - steps)[0]) / 2e-5
    assert fit.to_vectors(point)[1] == pytest.approx(np.linalg.slogdet(jacobian)[1], abs=1e-3)


def test_nodes_of_a_drift(fit: EffectFit) -> None:
    """The weight of a node is one there and beyond the outer ones; between them it goes with the inverse variance."""
    at, drifts = FlatLayout(1, False, n_further=2), fit.posterior.drifts
    vector, sd = np.arange(at.size) / 10, np.array([0.5, 0.4])
    nodes = DriftNodes.of(drifts, at, vector, sd)
    assert nodes is not None
    there = np.tile(vector, (9, 1))
    there[1:, at.further] = [
        np.log([value for _, values in each for value in values[:2]]) for each in nodes.others(drifts)
    ]
    np.testing.assert_allclose(nodes.weights(there), np.eye(9), atol=1e-12)
    far = np.tile(vector, (2, 1))
    far[:, at.further] += [[-50.0, 50.0], [50.0, -50.0]]
    np.testing.assert_array_equal(nodes.weights(far), np.eye(9)[[5, 7]])
    between = vector[None].copy()
    between[0, at.further.start] += sd[0]
    share = (1 - np.exp(-2 * sd[0])) / (1 - np.exp(-4 * sd[0]))
    np.testing.assert_allclose(nodes.weights(between)[0], (1 - share) * np.eye(9)[0] + share * np.eye(9)[6])


def test_no_nodes_without_a_drift_that_elements_share(fit: EffectFit) -> None:
    at = FlatLayout(1, False, n_further=2)
    (shared, values), *_ = fit.posterior.drifts
    own = (shared, (*values[:-1], 1.0))
    for drifts in ((), (own,), ((shared, values), own)):
        assert DriftNodes.of(drifts, at, np.zeros(at.size), np.ones(2)) is None
