"""Groups on request of a calibration whose posterior is known in closed form: one reading, one parameter."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm

from bayestouch.model.requested import groups_of_draws
from bayestouch.results.schema import GROUPS

SEEN, NOISE, PRIOR = 3.0, 0.5, 2.0


class OneReading:
    """A reading, `SEEN`, of a parameter with a normal prior about zero."""

    def touch_log_likelihood(self, vectors: np.ndarray) -> np.ndarray:
        return norm.logpdf(SEEN, vectors, NOISE)

    def log_priors(self, vectors: np.ndarray) -> dict[str, np.ndarray]:
        return {"gain": norm.logpdf(vectors[:, 0], 0, PRIOR)}

    def prior_draws(self, n: int, rng: np.random.Generator) -> np.ndarray:
        return PRIOR * rng.standard_normal((n, 1))

    def named(self, vectors: np.ndarray) -> dict[str, np.ndarray]:
        return {"gain": vectors[..., 0]}

    def replicated(self, vectors: np.ndarray, rng: np.random.Generator, *, from_prior: bool) -> np.ndarray:
        return (vectors + NOISE * rng.standard_normal(vectors.shape))[:, :, None]


def test_groups_of_one_reading() -> None:
    """Draws of the posterior have shape (chain, draw, d); each group is that of the closed form."""
    variance = 1 / (1 / NOISE**2 + 1 / PRIOR**2)
    mean = variance * SEEN / NOISE**2
    draws = mean + np.sqrt(variance) * np.random.default_rng(1).standard_normal((4, 5000, 1))
    groups = groups_of_draws(OneReading(), draws, GROUPS, seed=2)
    np.testing.assert_allclose(groups["log_likelihood"]["whole_touch"], norm.logpdf(SEEN, draws, NOISE))
    np.testing.assert_allclose(groups["log_prior"]["gain"], norm.logpdf(draws[..., 0], 0, PRIOR))
    # 20,000 draws: standard deviations to 0.5 %, and four times that is allowed
    assert np.std(groups["prior"]["gain"]) == pytest.approx(PRIOR, rel=0.02)
    assert np.std(groups["prior_predictive"]["reading"]) == pytest.approx(np.hypot(PRIOR, NOISE), rel=0.02)
    again = groups["posterior_predictive"]["reading"]
    assert again.shape == (4, 5000, 1, 1)
    assert np.std(again) == pytest.approx(np.sqrt(variance + NOISE**2), rel=0.02)
    assert np.mean(again) == pytest.approx(mean, abs=0.02)


def test_only_groups_that_are_asked_for_are_made() -> None:
    assert groups_of_draws(OneReading(), np.zeros((1, 2, 1)), ("log_prior",), seed=2).keys() == {"log_prior"}
