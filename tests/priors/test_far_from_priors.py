"""Posterior means against priors: distances by hand."""

from __future__ import annotations

import numpy as np
import pytest

from bayestouch.priors.far_from_priors import far_from_priors
from bayestouch.priors.parameters import LogNormal, Normal, Parameter, Uniform

NOMINAL = {"theta_s": (-12.0, 0.0, 12.0), "x_s": (0.0, 6.0, 12.0)}
QUESTION = "is a value or a unit wrong in sensor.toml, or a column of the tables?"


def said(parameter: Parameter, *means: float) -> list[str]:
    """Notes on draws with these means, of one value or of each element."""
    draws = np.array(means)[None, None] * np.array([0.9, 1.1])[None, :, None]
    return list(far_from_priors([parameter], {parameter.name: draws if len(means) > 1 else draws[..., 0]}, NOMINAL))


def test_a_modulus_in_another_unit() -> None:
    """log(220/0.205)/log(1.35) = 23.3."""
    stated = Parameter("mu", "", "", "MPa", LogNormal(220.0, np.log(1.35)))
    assert said(stated, 0.205) == [
        "mu: 0.205 MPa was found, 23 standard deviations of its prior from 220 MPa, the centre of the prior: "
        + QUESTION
    ]


@pytest.mark.parametrize(("sds", "far"), [(3.9, False), (4.1, True), (-4.1, True)])
def test_the_limit_is_four_standard_deviations(sds: float, far: bool) -> None:
    for prior, found in ((Normal(0.4, 0.02), 0.4 + 0.02 * sds), (LogNormal(0.4, 0.3), 0.4 * np.exp(0.3 * sds))):
        assert bool(said(Parameter("sigma", "", "", "", prior), found)) == far


def test_elements_depart_from_their_nominal_angles() -> None:
    """Two of three are 12 degrees off, with a prior of 2 degrees; the farthest is named."""
    angle = Parameter("theta_s", "", "", "degree", Normal(0.0, 2.0), relative=True)
    assert said(angle, -12.5, 12.5, 0.0) == [
        "theta_s of e02: 12.5 degree was found, 6 standard deviations of its prior from 0 degree, the centre of the "
        "prior (2 elements are more than 4 away): " + QUESTION
    ]
    assert not said(angle, -12.0, 1.0, 13.0)


def test_what_has_no_stated_value() -> None:
    """Priors in units of the data, and those without a standard deviation that excludes anything."""
    assert not said(Parameter("response", "", "", "", LogNormal(1.0, 1.0), relative=True), 1e5, 2e5)
    assert not said(Parameter("sigma", "", "", "", Uniform(0.0, 0.5)), 0.49)
    assert not list(far_from_priors([Parameter("mu", "", "", "", LogNormal(1.0, 0.1))], {}, NOMINAL))
