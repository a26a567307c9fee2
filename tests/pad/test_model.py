"""The model of a pad: what it computes together is what it computes apart."""

from __future__ import annotations

import numpy as np
import pytest
from drifting_pad import pad_of

from bayestouch.chain.kernels import GaussianKernel
from bayestouch.model.base import SensorModel
from bayestouch.pad.map_basis import MapBasis


@pytest.mark.parametrize("with_map", [False, True])
def test_prediction_with_derivatives(with_map: bool) -> None:
    model = pad_of(9, GaussianKernel(6.0), with_map=with_map)
    vector = model.start(model.pad)
    vector[model.n_chain :] = np.linspace(-1.0, 1.0, len(vector) - model.n_chain)
    together, apart = model.with_derivatives(vector), SensorModel.with_derivatives(model, vector)
    assert np.array_equal(together[0].touches, apart[0].touches)
    assert np.array_equal(together[1], apart[1])


def test_map_at_the_stated_locations() -> None:
    """Its functions are computed once there; elsewhere they are computed anew."""
    model = pad_of(9, GaussianKernel(6.0), with_map=True)
    assert isinstance(model.map, MapBasis)
    vector = model.start(model.pad)
    without = model.predict(vector).touches
    weights = np.linspace(-1.0, 1.0, len(vector) - model.n_chain)
    vector[model.n_chain :] = weights
    place = np.stack(model.poses(vector).place, axis=1)
    added = model.load[:, None] * model.map.sensitivity(place, weights)
    assert model.predict(vector).touches == pytest.approx(without + added, rel=1e-12)
