"""What tables and files say of a finger's parameters and their priors."""

from __future__ import annotations

from dataclasses import replace

import pytest
from known_fingers import sensor

from bayestouch.errors import InputError
from bayestouch.finger.priors import FingerPriors
from bayestouch.priors.parameters import LogNormal, Normal, Prior


@pytest.mark.parametrize(
    ("stated", "said"),
    [
        (None, "noise of one raw reading (prior in units of 1 % of the element's peak)"),
        (LogNormal(0.1, 0.5), "noise of one raw reading"),
    ],
)
def test_a_prior_of_the_noise_that_was_not_stated_is_in_units_of_the_peak(stated: Prior | None, said: str) -> None:
    """A stated one is in the unit of the readings, which needs no words."""
    priors = FingerPriors(LogNormal(8.0, 0.1), Normal(0.0, 3.0), Normal(0.45, 0.02), LogNormal(1.0, 0.3), noise=stated)
    parameters = {each.name: each for each in priors.parameters("mV", discrepancy=True)}
    assert parameters["noise_sd"].description == said
    relative = {name for name, each in parameters.items() if each.relative}
    own = set() if stated else {"noise_sd"}
    assert relative == {"theta_s", "response", "discrepancy_sd", "force_noise_sd"} | own


@pytest.mark.parametrize(
    ("angles", "said"),
    [
        ((10.0, -5.0, 0.0, 10.0), "elements e01 and e04 have the same angle, 10 degrees"),
        ((0.0, 3.0, 3.0), "elements e02 and e03 have the same angle, 3 degrees"),
    ],
)
def test_elements_at_one_angle_are_named(angles: tuple[float, ...], said: str) -> None:
    finger = replace(sensor(), body=replace(sensor().body, element_angles_deg=angles))
    with pytest.raises(InputError, match=said):
        FingerPriors.of(finger)
