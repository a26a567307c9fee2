"""Which priors of a calibration are stated ones."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from known_fingers import sensor

from bayestouch.finger.priors import DISCREPANCY, FingerPriors
from bayestouch.finger.stated import stated_of
from bayestouch.priors.parameters import LogNormal, Prior

GEOMETRY = ("sigma", "mu", "r_s", "theta_s")
ONE = LogNormal(1.0, float(np.log(3.0)))


@pytest.mark.parametrize(
    "stated",
    [
        {},
        {"response": ONE},
        {"noise_sd": LogNormal(1.0, float(np.log(10.0)))},
        {"force_noise_sd": ONE},
        {"response": LogNormal(4.0, 0.2), "discrepancy_sd": ONE},
    ],
)
def test_a_prior_about_one_is_a_stated_one_too(stated: dict[str, Prior]) -> None:
    """A default prior of median 1 is in units of the readings, as its description says."""
    unknown = FingerPriors.of(sensor())[0].with_stated({}, sensor().body)
    priors = FingerPriors(*(getattr(unknown, name) for name in ("sensing_radius", "angle", "poisson_ratio")), ONE)
    parameters = priors.with_stated(stated, sensor().body).parameters("counts", discrepancy=True)
    made: Any = SimpleNamespace(
        has_identified_map=False,
        has_effects=False,
        settings={"contact": "layer"},
        extra={},
        mode={},
        parameters=parameters,
    )
    found = stated_of(made)[1]["priors"]
    assert {name: prior for name, prior in found.items() if name not in GEOMETRY} == stated
    assert set(GEOMETRY) <= set(found) and DISCREPANCY not in found.values()
