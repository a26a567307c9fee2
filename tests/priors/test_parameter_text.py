"""Priors of R in posterior files."""

from __future__ import annotations

import json

import numpy as np
import pytest

from bayestouch import EdgeOrRound, IndenterDistribution, KnownTips, UniformCurvature
from bayestouch.priors.indenters import IndenterPrior
from bayestouch.priors.parameter_text import PriorOfOtherCode, parameters_from_json, parameters_to_json
from bayestouch.priors.parameters import LogNormal, Normal, Parameter, Prior, StudentT

OUTER = 12.7


def again(prior: Prior) -> Prior:
    return parameters_from_json(parameters_to_json([Parameter("R", "R", "R", "mm", prior)]))[0].prior


@pytest.mark.parametrize(
    "indenter",
    [
        UniformCurvature(0.3),
        IndenterDistribution(LogNormal(2.0, 0.5)),
        IndenterDistribution(StudentT(6.0, 1.0, 4.0), "R"),
        KnownTips((0, 2, np.inf), (0.5, 0.25, 0.25)),
        EdgeOrRound(0.3),
        EdgeOrRound(0.3, UniformCurvature(0.5)),
    ],
    ids=str,
)
def test_priors_of_radii_come_back_with_their_densities(indenter: IndenterPrior) -> None:
    prior = indenter.radius_prior(OUTER)
    back = again(prior)
    assert back == prior
    value, probability = np.array([0.0, 0.5, 2.0, 6.0, OUTER]), np.array([0.1, 0.4, 0.6, 0.9])
    np.testing.assert_array_equal(back.log_density(value), prior.log_density(value))
    np.testing.assert_array_equal(back.quantile(probability), prior.quantile(probability))


def test_whether_a_prior_is_relative_comes_back() -> None:
    """A file without the flag says it in the description."""
    away, own = Parameter("t", "t", "t", "", Normal(0, 1), "angle", True), Parameter("s", "s", "s", "", Normal(0, 1))
    text = parameters_to_json([away, own])
    assert parameters_from_json(text) == (away, own)
    plain = json.loads(text)
    for one, said in zip(plain, ("angle (the prior is of its departure)", "ratio"), strict=True):
        del one["relative"]
        one["description"] = said
    assert [each.relative for each in parameters_from_json(json.dumps(plain))] == [True, False]


def test_a_radius_from_a_density_of_other_code_keeps_its_description() -> None:
    class Mine(Normal):
        pass

    prior = IndenterDistribution(Mine(3.0, 1.0)).radius_prior(OUTER)
    assert again(prior) == PriorOfOtherCode(str(prior), *prior.support)
