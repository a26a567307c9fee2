"""Priors of a pad's kernel from what is stated of the sensor."""

from __future__ import annotations

import pytest
from scipy.stats import truncnorm

from bayestouch.chain.kernel_choice import kernel_for
from bayestouch.chain.kernels import LayerKernel
from bayestouch.data.sensor import Pad, Sensor


def test_rubber_that_is_not_stated_is_soft_rubber() -> None:
    """Poisson's ratio of an unknown rubber is 0.47 ± 0.03 below 0.4999: its quartiles by the truncated normal."""
    sensor = Sensor(name="pad", body=Pad((0.0, 10.0)), reading_unit="kPa", source={})
    kernel = kernel_for("layer", sensor, 10.0)
    assert isinstance(kernel, LayerKernel)
    expected = truncnorm(-0.47 / 0.03, 0.0299 / 0.03, loc=0.47, scale=0.03)
    for probability in (0.25, 0.5, 0.75):
        assert kernel.poisson_ratio.quantile(probability) == pytest.approx(expected.ppf(probability), rel=1e-9)
