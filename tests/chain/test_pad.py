"""The chain of a pad: kernels, derivatives, and the tables that stand for it."""

from __future__ import annotations

import numpy as np
import pytest

from bayestouch.chain.kernel_choice import kernel_for, kernel_names
from bayestouch.chain.kernels import derivatives
from bayestouch.chain.pad import PadChain, element_pitch
from bayestouch.chain.pad_map import PadMap
from bayestouch.data.sensor import Pad, Rubber, Sensor
from bayestouch.errors import InputError

SENSOR = Sensor(name="pad", body=Pad((0.0, 6.0, 12.0)))
VALUES = {
    "gaussian": (2.5,),
    "constant": (),
    "half-space": (3.0, 1.0),
    "half-space-line": (3.0, 1.0),
    "layer": (5.0, 0.8, 0.48, 1.0),
    "layer-line": (5.0, 0.8, 0.48, 1.0),
}


def chain(name: str, dimensions: int) -> PadChain:
    kernel = kernel_for(name, SENSOR, 6.0)
    rng = np.random.default_rng(1)
    position = 6.0 * np.arange(3)[:, None] + rng.normal(size=(3, dimensions))
    return PadChain(kernel, np.array(VALUES[name]), np.array([1.0, 2.0, 0.5]), np.array([0.1, 0.0, -0.2]), position)


@pytest.mark.parametrize("name", kernel_names(1))
def test_kernels_are_one_above_the_element_and_fall(name: str) -> None:
    kernel, values = kernel_for(name, SENSOR, 6.0), np.array(VALUES[name])
    distance = np.linspace(0, 4, 50)
    response = kernel(distance, values)
    assert response[0] == pytest.approx(1, abs=1e-12)
    if name != "constant":
        assert (np.diff(response) < 0).all()
    for start in kernel.starts:
        assert len(start) == len(kernel.parameters)
        for value, parameter in zip(start, kernel.parameters, strict=True):
            assert np.isfinite(parameter.prior.log_density(value))


def test_half_space_under_a_point_and_a_line() -> None:
    # Boussinesq and Flamant: (1 + (x/z)²) to the power -5/2 and -2.
    x = np.linspace(0, 20, 30)
    ball, line = kernel_for("half-space", SENSOR, 6.0), kernel_for("half-space-line", SENSOR, 6.0)
    values = np.array([3.0, 0.0])
    np.testing.assert_allclose(ball(x, values), (1 + (x / 3) ** 2) ** -2.5, rtol=1e-12)
    np.testing.assert_allclose(line(x, values), (1 + (x / 3) ** 2) ** -2, rtol=1e-12)


@pytest.mark.parametrize("suffix", ["", "-line"])
def test_thick_layer_is_a_half_space(suffix: str) -> None:
    # What the base reflects falls with (depth/thickness) cubed or faster: 1e-5 at 1/50, and 20 of it in the tails.
    x = np.linspace(0, 9, 20)
    layer, half_space = kernel_for("layer" + suffix, SENSOR, 6.0), kernel_for("half-space" + suffix, SENSOR, 6.0)
    thick = layer(x, np.array([150.0, 0.02, 0.48, 1.0]))
    np.testing.assert_allclose(thick, half_space(x, np.array([3.0, 1.0])), atol=5e-4)


def test_negative_ring_of_the_layer_is_above_the_base_and_deepest_if_incompressible() -> None:
    layer, x = kernel_for("layer", SENSOR, 6.0), np.linspace(4, 20, 100)
    ring = {
        (depth, sigma): layer(x, np.array([5.0, depth, sigma, 1.0])).min()
        for depth in (1.0, 0.8)
        for sigma in (0.3, 0.4999)
    }
    # At the base the stress all but does not change sign: a tenth of the ring at four fifths of the depth, or less.
    assert ring[0.8, 0.4999] < ring[0.8, 0.3] < -0.001
    assert min(ring[1.0, 0.3], ring[1.0, 0.4999]) > 0.1 * ring[0.8, 0.4999]


@pytest.mark.parametrize("name", kernel_names(1))
@pytest.mark.parametrize("dimensions", [1, 2])
def test_derivatives_are_those_of_the_sensitivity(name: str, dimensions: int) -> None:
    pad = chain(name, dimensions)
    location = np.random.default_rng(2).uniform(0, 12, (20, dimensions))
    derivatives = pad.sensitivity_derivatives(location)
    assert derivatives.shape == (20, 3, len(pad.layout)) == (20, 3, len(pad.flat))
    for k in range(len(pad.flat)):
        step = np.zeros(len(pad.flat))
        step[k] = 1e-5 * max(abs(pad.flat[k]), 1.0)
        up, down = (pad.with_flat(pad.flat + sign * step).sensitivity(location) for sign in (1, -1))
        # Errors of the two central differences: h² f'''/6 with h = 1e-4 of a value of order 1, and rounding 1e-16/1e-5.
        np.testing.assert_allclose(derivatives[..., k], (up - down) / (2 * step[k]), atol=2e-6)


def test_flat_and_back() -> None:
    pad = chain("layer", 2)
    again = pad.with_flat(pad.flat)
    np.testing.assert_array_equal(again.position, pad.position)
    np.testing.assert_array_equal(again.values, pad.values)
    assert (
        pad.layout[0] == "gain[0]"
        and pad.layout[9] == "y_s[0]"
        and pad.layout[-4:]
        == (
            "h",
            "depth_share",
            "sigma",
            "a",
        )
    )


def test_predict_is_linear_in_the_load() -> None:
    pad = chain("gaussian", 2)
    location = np.array([[1.0, 2.0], [5.0, 0.0]])
    one, three = pad.predict(location, [1.0, 1.0]), pad.predict(location, [3.0, 3.0])
    np.testing.assert_allclose(three - pad.offset, 3 * (one - pad.offset), rtol=1e-12, atol=1e-15)


def test_kernels_of_many_pads_are_those_of_each() -> None:
    rng = np.random.default_rng(3)
    for name in kernel_names(1):
        pad = chain(name, 2)
        flats = pad.flat * rng.uniform(0.9, 1.0, (7, len(pad.flat)))
        location = rng.uniform(0, 12, (20, 2))
        each = [pad.with_flat(flat).sensitivity(location) for flat in flats]
        np.testing.assert_allclose(pad.sensitivities(flats, location), each, rtol=1e-12, atol=1e-14)


def test_slope_at_the_element_is_zero() -> None:
    for name in kernel_names(1):
        # By symmetry; the difference itself is exact there but for rounding, 1e-16 over 2e-4.
        found = derivatives(kernel_for(name, SENSOR, 6.0), np.zeros(1), np.array(VALUES[name]))
        assert found.over_distance[0] == pytest.approx(0, abs=1e-8)


def test_priors_centre_on_what_is_stated() -> None:
    stated = Sensor(
        name="pad",
        body=Pad((0.0, 6.0), thickness_mm=5.0, depth_mm=4.0),
        rubber=Rubber(poisson_ratio=0.45),
    )
    by_name = {parameter.name: parameter.prior for parameter in kernel_for("layer", stated, 6.0).parameters}
    assert by_name["h"].quantile(0.5) == pytest.approx(5.0)
    assert by_name["depth_share"].mean == pytest.approx(0.8)
    assert by_name["sigma"].mean == pytest.approx(0.45)
    assert kernel_for("half-space", stated, 6.0).parameters[0].prior.quantile(0.5) == pytest.approx(4.0)
    with pytest.raises(InputError, match="unknown kernel"):
        kernel_for("gaussian-line", stated, 6.0)


def test_pitch() -> None:
    assert element_pitch([[0.0], [6.0], [12.0]], 30) == 6
    assert element_pitch([[0.0]], 30) == 7.5


def tables(pad: PadChain, low: float, high: float, step: float) -> PadMap:
    dimensions = pad.position.shape[1]
    axis = np.arange(low - 6 * step, high + 6.5 * step, step)
    grid = np.stack(np.meshgrid(*[axis] * dimensions, indexing="ij"), axis=-1)
    sensitivity = pad.sensitivity(grid)
    box = np.full(dimensions, low), np.full(dimensions, high)
    return PadMap(
        origin=np.full(dimensions, axis[0]),
        step=np.full(dimensions, step),
        low=box[0],
        high=box[1],
        offset=pad.offset,
        offset_variance=np.full(3, 0.01),
        sensitivity=sensitivity,
        variance=0.1 * sensitivity**2,
        covariance=-0.02 * sensitivity,
    )


@pytest.mark.parametrize("dimensions", [1, 2])
def test_tables_follow_the_chain(dimensions: int) -> None:
    pad = chain("gaussian", dimensions)
    map_ = tables(pad, -4.0, 16.0, 2.5 / 6)
    location = np.random.default_rng(3).uniform(-4, 16, (5, 40, dimensions))
    sensitivity, variance, covariance = map_.at(location)
    # Cubic splines on h = w/6: 3/384 (h/w)^4 = 6e-6 of a peak of 2 a coordinate, and what the ends disturb.
    np.testing.assert_allclose(sensitivity, pad.sensitivity(location), atol=5e-5)
    np.testing.assert_allclose(variance, 0.1 * pad.sensitivity(location) ** 2, atol=5e-5)
    np.testing.assert_allclose(covariance, -0.02 * sensitivity, atol=1e-12)
    value, slopes = map_.slopes(location)
    np.testing.assert_allclose(value, sensitivity, atol=1e-12)
    for axis in range(dimensions):
        step = np.zeros(dimensions)
        step[axis] = 1e-5
        up, down = map_.at(location + step)[0], map_.at(location - step)[0]
        # Of the spline itself: rounding 1e-16 / 1e-5 and the square of the step.
        np.testing.assert_allclose(slopes[..., axis, :], (up - down) / 2e-5, atol=1e-8)


def test_tables_and_their_variance() -> None:
    map_ = tables(chain("gaussian", 1), -4.0, 16.0, 0.4)
    again = PadMap.from_arrays(map_.arrays())
    location = np.array([[3.3], [7.7]])
    np.testing.assert_array_equal(again.at(location)[0], map_.at(location)[0])
    _, variance, covariance = map_.at(location)
    load = np.array([2.0, 0.5])
    expected = 0.01 + 2 * load[:, None] * covariance + load[:, None] ** 2 * variance
    np.testing.assert_allclose(map_.reading_variance(variance, covariance, load), np.maximum(expected, 0), rtol=1e-12)
    exact = map_.exact()
    assert not exact.reading_variance(*exact.at(location)[1:], load).any()
    np.testing.assert_array_equal(map_.inside(np.array([[-4.1], [0.0], [16.0], [16.1]])), [False, True, True, False])
