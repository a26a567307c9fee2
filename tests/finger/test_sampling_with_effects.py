"""First guess of the noise beside functions with unknown weights."""

from __future__ import annotations

import numpy as np
import pytest

import bayestouch
from bayestouch.calibration.with_effects import fit_stated
from bayestouch.effects.stated import StatedModel
from bayestouch.finger.density_with_effects import EffectPosterior
from bayestouch.finger.linear_chain import degrees_spent
from bayestouch.finger.sampling_with_effects import effect_fit
from bayestouch.sampling.rank_one import inverse_root


def test_degrees_of_freedom_are_those_of_each_reading_as_it_is() -> None:
    """Not of whitened readings, which mix the elements of a touch: by inverses of whole covariances, written out."""
    rng = np.random.default_rng(3)
    t, m, c = 7, 4, 5
    own, by_load = rng.uniform(0.5, 2.0, (t, m)), 3 * rng.standard_normal((t, m))
    columns = rng.standard_normal((c, t, m))
    root = inverse_root(own, (by_load,), np.ones((t, m), dtype=bool))
    white = np.einsum("tij,ctj->cti", root, columns)
    gram = np.eye(c) + white.reshape(c, -1) @ white.reshape(c, -1).T
    half = np.linalg.solve(np.linalg.cholesky(gram), white.reshape(c, -1)).reshape(c, t, m)
    without = np.zeros((t * m, t * m))
    for i in range(t):
        part = slice(i * m, (i + 1) * m)
        without[part, part] = np.diag(own[i]) + np.outer(by_load[i], by_load[i])
    flat = columns.reshape(c, -1)
    less = np.linalg.inv(without) - np.linalg.inv(without + flat.T @ flat)
    expected = (np.diag(less).reshape(t, m) * own).sum(axis=0)
    assert degrees_spent(half, root, own) == pytest.approx(expected, rel=1e-9)
    # All together they are fewer than the columns, which the errors of the loads partly hide.
    assert expected.sum() < c


@pytest.mark.parametrize("name", ["gain_drift", "baseline_drift"])
def test_the_map_of_a_posterior_with_a_drift_follows_the_noise(name: str) -> None:
    """Log ratios of the exact posterior to the normal one scatter little where the noise and what is missed vary.

    A part of each element in the gradient that held what the drift explains would move the response of the elements
    by hundreds of standard deviations.
    """
    design = bayestouch.FingerDesign(n_elements=6, touch_step_deg=20.0)
    made = bayestouch.simulate(design, effects={name: 0.05}, seed=5)
    stated = fit_stated(made.dataset, StatedModel("finger", "layer", ((name, {}),)), draws=8, seed=0, contact="layer")
    fitted, start = stated.fitted, stated.evaluation.start
    fit = effect_fit(fitted, stated.added, EffectPosterior.of(fitted, start.priors, start.fitted.model.known))
    at, density = fit.posterior.layout, fit.density()
    noise = slice(at.noise.start, at.log_discrepancy.stop)
    z = np.zeros((100, at.size))
    k = noise.stop - noise.start
    root = np.linalg.cholesky(fit.shape.covariance[:k, :k])
    normal = np.random.default_rng(2).standard_normal((100, k))
    z[:, noise] = fit.shape.centre[:k] + normal @ root.T
    vectors, log_derivative = fit.to_vectors(z)
    ratio = density(vectors) + log_derivative + 0.5 * (normal**2).sum(axis=1)
    assert np.isfinite(ratio).all()
    # Twelve coordinates: a proposal off by a third of a standard deviation in each has ratios that scatter by 1.2.
    assert ratio.std() < 1.0
