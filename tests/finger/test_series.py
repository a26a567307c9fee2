"""The range of contacts that a series solves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from model_cases import three_times


@pytest.mark.parametrize("radii", [(0.2, 0.6), (0.7, 0.7), (0.5, 3.0)])
def test_contacts_reach_from_the_smallest_kappa_to_the_largest(radii: tuple[float, float]) -> None:
    """The knots have the κ of every tip, load and modulus of the range, and readings are those of the chain."""
    case = three_times()
    quick = case.quick.evaluator
    assert quick is not None and case.quick.pose is not None
    _, angle, load = case.quick.pose
    radius = np.resize([0.0, *radii], len(load))
    known = replace(quick.known, radius_mm=radius)
    series = quick.of(known, quick.finger, quick.layout, quick.sign, quick.reach, "layer")
    low, high = known.load_range()
    round_ = radius > 0
    kappa = np.array(
        [
            low[round_].min() / 1000 * min(radii) / np.exp(quick.reach.log_mu[1]),
            high[round_].max() / 1000 * max(radii) / np.exp(quick.reach.log_mu[0]),
        ]
    )
    np.testing.assert_allclose(series.template.coordinates[[0, -1]], np.log1p(kappa / series.template.kappa_scale))
    model = case.chain.at(radius, angle, load)
    found = replace(model, evaluator=series).predict(case.vector).touches
    assert np.abs((found - model.predict(case.vector).touches) / case.finger.peak).max() < 3e-5
