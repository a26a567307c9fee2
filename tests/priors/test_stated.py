"""What is given as priors and is none is named, before anything is fitted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

import bayestouch
from bayestouch.errors import InputError
from bayestouch.priors.parameters import Normal
from bayestouch.priors.stated import require_priors


@dataclass(frozen=True)
class Flat:
    """A prior of the user's own class."""

    support: tuple[float, float] = (0.0, 1.0)

    def log_density(self, value: float) -> np.ndarray:
        return np.zeros(np.shape(value))

    def quantile(self, probability: float) -> np.ndarray:
        return np.asarray(probability)


@pytest.mark.parametrize(
    ("priors", "words"),
    [
        ({"sigma": 0.45}, "prior of sigma: expected a prior, such as Normal(mean, sd), got 0.45"),
        ({"mu": Normal(0.2, 0.1), "sigma": "x"}, "prior of sigma: expected a prior, such as Normal(mean, sd), got 'x'"),
        (["sigma"], "priors: expected priors by name of the parameter, got ['sigma']"),
    ],
)
def test_what_is_no_prior_is_refused(priors: object, words: str) -> None:
    dataset = bayestouch.simulate(bayestouch.PadDesign(n_touches=1), seed=1).dataset
    with pytest.raises(InputError) as error:
        bayestouch.calibrate(dataset, priors=priors)  # type: ignore[arg-type]
    assert str(error.value) == words


def test_a_class_is_no_prior_and_one_of_the_user_is() -> None:
    require_priors({"sigma": Flat(), "mu": Normal(0.2, 0.1)})
    require_priors(None)
    with pytest.raises(InputError, match="prior of sigma: expected a prior"):
        require_priors({"sigma": Normal})  # type: ignore[dict-item]
