"""The model of a pad: what it computes at once is what it computes apart."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from drifting_pad import pad_of

from bayestouch.chain.kernels import GaussianKernel
from bayestouch.effects import Setting
from bayestouch.effects.readout import Memory
from bayestouch.pad.map_basis import MapBasis
from bayestouch.pad.model import PadModel
from bayestouch.priors.parameters import LogNormal


@pytest.mark.parametrize("with_map", [False, True])
@pytest.mark.parametrize("logarithmic", [False, True])
def test_prediction_with_derivatives(with_map: bool, logarithmic: bool) -> None:
    """Also over the logarithms of a gain and of an offset, if their priors are log-normal."""
    model = pad_of(9, GaussianKernel(6.0), with_map=with_map)
    if logarithmic:
        priors = list(model.priors)
        priors[0], priors[2] = LogNormal(5.0, 0.3), LogNormal(0.3, 0.4)
        model = replace(model, priors=tuple(priors))
    vector = model.start(model.pad)
    vector[model.n_chain :] = np.linspace(-1.0, 1.0, len(vector) - model.n_chain)
    predicted, derivatives, samples = model.with_derivatives(vector)
    assert samples is None
    assert np.array_equal(predicted.touches, model.predict(vector).touches)
    step = 1e-5
    moved = [
        model.predict(vector + sign * step * np.eye(len(vector))[i]).touches
        for i in range(len(vector))
        for sign in (1, -1)
    ]
    differences = (np.array(moved[::2]) - np.array(moved[1::2])) / (2 * step)
    # Differences err by the third derivative times step² / 6, and by rounding: 1e-16 of a reading over the step.
    assert derivatives == pytest.approx(differences, rel=1e-6, abs=1e-9 * np.abs(predicted.touches).max())


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


def with_memory(zero: float) -> tuple[PadModel, np.ndarray]:
    """A pad with a memory of a tenth, whose readings and offsets are higher by `zero`; and its vector."""
    model = pad_of(9, GaussianKernel(6.0))
    place = model.element_place
    memory = Memory.suited(Setting(False, 2, place, ((-2.0, 8.0),), 1.0, "N", "", False, 1.0, 15.0, 150.0))
    assert memory is not None
    history = replace(model.known.history, readings=model.known.history.readings + zero)
    model = replace(model, observed=replace(model.known, history=history), effects=(memory,))
    values = [p.to_unconstrained(v) for p, v in zip(memory.parameters, (0.1, 20.0, 0.5), strict=True)]
    vector = np.append(model.start(model.pad), values)
    vector[2:4] += zero
    return model, vector


def test_what_remains_of_a_touch_is_a_share_of_what_it_read_above_the_readings_without_touch() -> None:
    """With a zero of a hundred peaks the pad reads as much more, also after the touch with a missing reading."""
    (model, vector), (higher, above) = with_memory(0.0), with_memory(500.0)
    assert np.isnan(model.known.history.readings).sum() == 1
    np.testing.assert_allclose(higher.predict(above).touches, model.predict(vector).touches + 500.0, atol=1e-9)


def test_derivatives_over_the_readings_without_touch_with_a_memory() -> None:
    model, vector = with_memory(3.0)
    _, derivatives, _ = model.with_derivatives(vector)
    step = np.eye(len(vector)) * 1e-5
    for i in (2, 3):
        up, down = (model.predict(vector + sign * step[i]).touches for sign in (1, -1))
        assert derivatives[i] == pytest.approx((up - down) / 2e-5, rel=1e-6, abs=1e-7)
        assert derivatives[i, :, i - 2].min() < 0.95
