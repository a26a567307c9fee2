"""emcee's sampler with a vectorised log density."""

from __future__ import annotations

import emcee
import numpy as np
import pytest

from bayestouch.array_types import FloatArray
from bayestouch.sampling.sampler import ArraySampler


def normal(points: FloatArray) -> FloatArray:
    return np.asarray(-0.5 * (points**2).sum(axis=1))


def test_its_chains_are_those_of_emcee() -> None:
    start = np.random.default_rng(1).standard_normal((8, 2))
    chains = []
    for kind in (ArraySampler, emcee.EnsembleSampler):
        sampler = kind(8, 2, normal, vectorize=True)
        sampler.run_mcmc(emcee.State(start, random_state=np.random.RandomState(2).get_state()), 20)
        chains.append(sampler.get_chain())
    np.testing.assert_array_equal(*chains)


def test_control_c_in_a_density_prints_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    def stopped(points: FloatArray) -> FloatArray:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        ArraySampler(8, 2, stopped, vectorize=True).run_mcmc(np.random.default_rng(1).standard_normal((8, 2)), 1)
    assert capsys.readouterr() == ("", "")
