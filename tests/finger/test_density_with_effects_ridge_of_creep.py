"""The map of a posterior of a finger with a creep that is slower than the touches are held."""

from __future__ import annotations

import numpy as np
import pytest

import bayestouch
from bayestouch.calibration.with_effects import fit_stated
from bayestouch.effects.stated import StatedModel
from bayestouch.finger.density_with_effects import EffectPosterior
from bayestouch.finger.fit_with_effects import EffectFit, effect_fit


@pytest.fixture(scope="module")
def fit() -> EffectFit:
    design = bayestouch.FingerDesign(
        n_elements=3, samples_per_touch=4, calibration_span_deg=24.0, edge_step_deg=4.0, flat_step_deg=8.0,
        touch_radii_mm=(3.9,), touch_span_deg=2.0, contact="hertz",
    )  # fmt: skip
    made = bayestouch.simulate(design, effects={"creep": 0.15, "creep.time": 4.0}, seed=5)
    model = StatedModel("finger", "hertz", (("crosstalk", {}), ("creep", {})))
    stated = fit_stated(made.dataset, model, draws=8, seed=0, contact="hertz")
    start = stated.evaluation.start
    known = start.fitted.model.known
    return effect_fit(stated.fitted, stated.added, EffectPosterior.of(stated.fitted, start.priors, known))


def points(fit: EffectFit, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Points of the normal proposal (n, d), and half their sum of squares (n,)."""
    at, chain = fit.posterior.layout, fit.posterior.layout.n_chain
    normal = np.random.default_rng(4).standard_normal((n, at.size))
    out = normal.copy()
    out[:, chain:] = fit.shape.centre + normal[:, chain:] @ np.linalg.cholesky(fit.shape.covariance).T
    return out, 0.5 * (normal**2).sum(axis=1)


def test_log_derivative_of_the_map(fit: EffectFit) -> None:
    assert len(fit.to_vectors.ridges.each) == 1
    for point in points(fit, 3)[0]:
        steps = 1e-5 * np.eye(len(point))
        jacobian = (fit.to_vectors(point + steps)[0] - fit.to_vectors(point - steps)[0]) / 2e-5
        assert fit.to_vectors(point)[1] == pytest.approx(np.linalg.slogdet(jacobian)[1], abs=1e-3)


def test_the_map_reaches_along_the_ridge(fit: EffectFit) -> None:
    """The weights of points are nearly even, and do not follow the time constant."""
    z, squares = points(fit, 500)
    vectors, log_derivative = fit.to_vectors(z)
    log_weight = fit.density(vectors) + log_derivative + squares
    weight = np.exp(log_weight - log_weight.max())
    assert weight.sum() ** 2 / (weight**2).sum() > 0.2 * len(z)
    last = fit.posterior.layout.n_chain - 1
    mean = weight @ vectors[:, last] / weight.sum()
    sd = np.sqrt(weight @ (vectors[:, last] - mean) ** 2 / weight.sum())
    assert vectors[:, last].mean() == pytest.approx(mean, abs=0.3 * sd)
    assert vectors[:, last].std() == pytest.approx(sd, rel=0.2)
    for power in (z[:, last], z[:, last] ** 2):
        assert abs(np.corrcoef(power, log_weight)[0, 1]) < 0.3
