"""Posteriors of touches on a pad as sums of normals: against quadrature, and their bookkeeping by hand."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy import optimize, stats

from bayestouch.pad.reading import components
from bayestouch.pad.reading.components import Components, components_of
from bayestouch.pad.reading.lattice import Lattice
from bayestouch.pad.reading.reader import PadTouches

OFFSET, SD = np.array([0.3, -0.2]), np.array([0.05, 0.04])
GAIN = np.array([[0.5, -0.3, 0.2], [0.4, 0.35, 0.25]])


class Plane:
    """Two elements read offset + P (gain · (1, place)), a plane over place; noise that is the same everywhere."""

    def __init__(self, dimensions: int, load_mean: float = 2.0) -> None:
        self.gain = GAIN[:, : dimensions + 1]
        self.map = SimpleNamespace(offset=OFFSET, slopes=self.slopes)
        self.load = load_mean

    def slopes(self, location: np.ndarray, load: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        sensitivity = self.gain[:, 0] + location @ self.gain[:, 1:].T
        return sensitivity, np.broadcast_to(self.gain[:, 1:].T, (*location.shape[:-1], *self.gain[:, 1:].T.shape))

    def predict(self, location: np.ndarray, load: np.ndarray, counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        variance = SD**2 / np.maximum(counts, 1)
        signal = load[..., None] * self.slopes(location)[0]
        return signal, np.broadcast_to(variance, signal.shape)


def lattice(dimensions: int, step: float = 0.25, low: float = -2.0, high: float = 2.0) -> Lattice:
    axis = np.arange(round((high - low) / step) + 1)
    place = np.stack(np.meshgrid(*[axis] * dimensions, indexing="ij"), axis=-1).reshape(-1, dimensions)
    return Lattice(place, low + step * place, step)


def touches(count: int) -> PadTouches:
    """Touches at 0.3 and -0.5 with a force sensor; one of them lacks an element."""
    readings = OFFSET + np.array([[0.9, 0.95], [1.3, 0.6]])
    counts = np.array([[4, 9], [1, count]])
    return PadTouches(readings, counts, np.array([2.0, 2.2]), np.array([0.1, 0.15]))


@pytest.mark.parametrize("count", [2, 0])
def test_sum_of_normals_is_the_posterior(count: int) -> None:
    """Over place and load, against quadrature: weights of places, means and variances."""
    reader, given = Plane(1), touches(count)
    parts = components_of(reader, given, lattice(1, 0.1))  # type: ignore[arg-type]
    x = np.linspace(-2.6, 2.6, 521)
    load = np.linspace(0.5, 3.5, 601)
    for touch in range(2):
        signal = load[None, :, None] * reader.slopes(x[:, None])[0][:, None]
        here = given.counts[touch] > 0
        z = (given.readings[touch] - OFFSET - signal) / (SD / np.sqrt(np.maximum(given.counts[touch], 1)))
        prior = (load - given.load[touch]) / given.load_sd[touch]
        density = np.exp(-0.5 * ((z**2)[..., here].sum(axis=-1) + prior**2))
        density /= density.sum()
        mean = np.array([(density.sum(axis=1) * x).sum(), (density.sum(axis=0) * load).sum()])
        mine = parts.touch == touch
        weight = np.exp(parts.log_weight[mine] - parts.log_weight[mine].max())
        weight /= weight.sum()
        found = weight @ parts.mean[mine]
        off = parts.mean[mine] - found
        spread = np.einsum("n,nij->ij", weight, parts.covariance[mine] + off[:, :, None] * off[:, None, :])
        wanted = [(density.sum(axis=1) * (x - mean[0]) ** 2).sum(), (density.sum(axis=0) * (load - mean[1]) ** 2).sum()]
        cross = (density * (x[:, None] - mean[0]) * (load - mean[1])).sum()
        # Readings go with the product of place and load, which is linear about each node: that leaves some hundredths
        # of an sd to the sampler.
        np.testing.assert_array_less(np.abs(found - mean), 0.03 * np.sqrt(wanted))
        np.testing.assert_allclose(np.diag(spread), wanted, rtol=0.04)
        assert spread[0, 1] == pytest.approx(cross, abs=0.04 * np.sqrt(np.prod(wanted)))


@pytest.mark.parametrize("load", [-0.02, 0.0, 0.05])
def test_a_force_sensor_below_zero_leaves_a_load_above(load: float) -> None:
    """At one known place the load is the mean of the readings' and the force sensor's, by their precisions."""
    reader, load_sd = Plane(1), 0.02
    nodes = Lattice(np.zeros((1, 1), dtype=np.int64), np.array([[0.4]]), 1e-6)
    given = PadTouches(
        OFFSET + 0.2 * (GAIN[:, 0] + 0.4 * GAIN[:, 1])[None], np.full((1, 2), 4), np.array([load]), np.array([load_sd])
    )
    parts = components_of(reader, given, nodes)  # type: ignore[arg-type]
    by_load = (GAIN[:, 0] + 0.4 * GAIN[:, 1]) / (SD / 2)
    precision = by_load @ by_load + 1 / load_sd**2
    assert len(parts.touch) == 1 and np.isfinite(parts.log_weight).all()
    np.testing.assert_allclose(
        parts.mean[0], [0.4, (0.2 * by_load @ by_load + load / load_sd**2) / precision], rtol=1e-6
    )
    assert parts.covariance[0, 1, 1] == pytest.approx(1 / precision, rel=1e-6)


def test_no_part_has_a_load_below_zero() -> None:
    """Neither the readings nor the force sensor show a load: the part stays at a twentieth of the least one."""
    nodes = Lattice(np.zeros((1, 1), dtype=np.int64), np.array([[0.4]]), 1e-6)
    given = PadTouches(OFFSET[None], np.full((1, 2), 4), np.array([-0.02]), np.array([0.02]))
    parts = components_of(Plane(1), given, nodes)  # type: ignore[arg-type]
    np.testing.assert_allclose(parts.mean, [[0.4, 0.05 * components.LEAST_LOAD * 2.0]], rtol=1e-6)


def test_in_the_plane() -> None:
    """Two elements and a load tell two coordinates: the best parts lie where the readings are met."""
    reader = Plane(2)
    at = np.array([[0.4, -0.6], [-0.9, 0.3]])
    load = np.array([2.0, 2.0])
    readings = OFFSET + load[:, None] * reader.slopes(at)[0]
    given = PadTouches(readings, np.full((2, 2), 400), load, np.full(2, 1e-4))
    parts = components_of(reader, given, lattice(2))  # type: ignore[arg-type]
    for touch in range(2):
        mine = parts.touch == touch
        weight = np.exp(parts.log_weight[mine] - parts.log_weight[mine].max())
        found = weight @ parts.mean[mine] / weight.sum()
        # Noise 0.05/20 over 2 · 0.3 a mm is 4 µm; a tenth of it.
        np.testing.assert_allclose(found, [*at[touch], 2.0], atol=4e-4)
        jacobian = 2.0 * reader.gain[:, 1:] / (SD / 20)[:, None]
        covariance = np.linalg.inv(jacobian.T @ jacobian)
        best = parts.covariance[mine][np.argmax(weight)]
        np.testing.assert_allclose(np.diag(best)[:2], np.diag(covariance), rtol=0.02)


def two_alike() -> PadTouches:
    """Two touches that differ in an error that both elements have in the second alone."""
    readings = OFFSET + np.array([[1.3, 0.6], [1.3, 0.6]])
    shared = np.array([[[0.0, 0.0]], [[0.3, -0.2]]])
    return PadTouches(readings, np.full((2, 2), 9), np.full(2, 2.0), np.full(2, 0.1), by_noise=shared)


@pytest.mark.parametrize("given", [touches(9), two_alike()], ids=["counts", "errors"])
@pytest.mark.parametrize("depth", [0.5, 4.0, 30.0])
@pytest.mark.parametrize("dimensions", [1, 2])
def test_search_weighs_nodes_by_their_evidence(
    monkeypatch: pytest.MonkeyPatch, dimensions: int, depth: float, given: PadTouches
) -> None:
    """Readings are normal about a node: noise, the load's prior, and a place of sd 0.6 steps about the node.

    The place moves the readings by the load that suits the node best, no less than a twentieth of the prior one. Each
    touch has the errors that its elements share, and not those of a touch of the same load before it.
    """
    monkeypatch.setattr(components, "_FIRST_DEPTH", depth)
    reader, nodes = Plane(dimensions), lattice(dimensions, 0.5, -3.0, 3.0)
    tables = reader.map.slopes(nodes.location)
    for index in components._with_same_elements(given):
        touch, node = components._search(reader, given, nodes, tables, index)  # type: ignore[arg-type]
        for one in index:
            variance, load, load_sd = SD**2 / given.counts[one], given.load[one], given.load_sd[one]
            reading, weights = given.readings[one] - OFFSET, []
            noise = np.diag(variance) + given.shared_by_noise[one].T @ given.shared_by_noise[one]
            for sensitivity, slope in zip(*tables, strict=True):
                by_reading = np.linalg.solve(noise, sensitivity)
                best = (reading @ by_reading + load / load_sd**2) / (sensitivity @ by_reading + 1 / load_sd**2)
                moved = max(best, 0.05 * load) * 0.6 * 0.5 * slope
                covariance = noise + load_sd**2 * np.outer(sensitivity, sensitivity) + moved.T @ moved
                weights.append(stats.multivariate_normal(load * sensitivity, covariance).logpdf(reading))
            wanted = np.flatnonzero(np.array(weights) > max(weights) - depth)
            np.testing.assert_array_equal(node[touch == one], wanted)


def test_groups_of_touches_with_the_same_elements() -> None:
    """The same counts, and loads within a tenth or so; at most 64 together."""
    counts = np.array([[1, 1], [1, 0], [1, 1], [1, 1], [1, 0]])
    given = PadTouches(np.zeros((5, 2)), counts, np.array([1.0, 1.0, 1.04, 1.06, 1.02]), np.ones(5))
    assert sorted(sorted(map(int, each)) for each in components._with_same_elements(given)) == [[0, 2], [1, 4], [3]]
    many = PadTouches(np.zeros((130, 1)), np.ones((130, 1), dtype=int), np.ones(130), np.ones(130))
    assert [len(each) for each in components._with_same_elements(many)] == [64, 64, 2]
    np.testing.assert_array_equal(np.concatenate(components._with_same_elements(many)), np.arange(130))


@pytest.mark.parametrize(("count", "stride"), [(1000, 1), (1001, 2), (2001, 4)])
def test_nodes_of_a_touch_that_is_hardly_located_are_thinned(count: int, stride: int) -> None:
    """To a thousand on a line; a touch with fewer keeps them all."""
    nodes = lattice(1, 1.0, 0.0, 2500.0)
    touch = np.array([0] * count + [1, 1])
    node = np.array([*range(count), 3, 5])
    kept, left, strides = components._thinned(touch, node, nodes, 2)
    np.testing.assert_array_equal(left, [*range(0, count, stride), 3, 5])
    np.testing.assert_array_equal(strides, [stride] * (len(left) - 2) + [1, 1])
    np.testing.assert_array_equal(kept, [0] * (len(left) - 2) + [1, 1])


def test_in_the_plane_every_other_node_leaves_a_quarter() -> None:
    nodes = lattice(2, 1.0, 0.0, 39.0)
    _, left, strides = components._thinned(np.zeros(1600, dtype=int), np.arange(1600), nodes, 1)
    assert set(strides) == {2} and len(left) == 400 and (nodes.place[left] % 2 == 0).all()


def test_parts_near_the_best_of_their_touch() -> None:
    weight = np.array([0.0, -11.9, -12.1, -50.0, -61.0, -63.0])
    made = Components(
        np.array([0, 0, 0, 2, 2, 2]), np.zeros((6, 1), dtype=int), weight, np.zeros((6, 2)), np.zeros((6, 2, 2))
    )
    kept = components._near_best(made, 3, 12.0)
    np.testing.assert_array_equal(kept, [True, True, False, True, True, False])
    np.testing.assert_array_equal(made.select(kept).log_weight, weight[kept])


class Bent(Plane):
    """Signals that go with the square of the load."""

    def slopes(self, location: np.ndarray, load: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        by_load, along = super().slopes(location)
        return (by_load, along) if load is None else (2 * load[..., None] * by_load, load[..., None, None] * along)

    def predict(self, location: np.ndarray, load: np.ndarray, counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        signal, variance = super().predict(location, load, counts)
        return load[..., None] * signal, variance


def test_parts_are_at_their_most_probable_places() -> None:
    """Readings that are not linear in the load, and a load that is hardly known: the gradient there is zero.

    A step that is left is below a tenth of an sd, and steps shrink by more than a half each time.
    """
    reader = Bent(1)
    readings = OFFSET + 9.0 * (GAIN[:, 0] + 0.4 * GAIN[:, 1])
    given = PadTouches(readings[None], np.full((1, 2), 4), np.array([2.0]), np.array([2.0]))
    nodes = lattice(1)
    parts = components_of(reader, given, nodes)  # type: ignore[arg-type]
    best = np.argmax(parts.log_weight)
    mean = parts.mean[best]
    np.testing.assert_allclose(mean, [0.4, 3.0], atol=0.05)
    node = nodes.location[parts.place[best, 0], 0]

    def cost(x: np.ndarray) -> float:
        signal = x[1] ** 2 * (GAIN[:, 0] + x[0] * GAIN[:, 1])
        z = np.r_[(readings - OFFSET - signal) / (SD / 2), (x[0] - node) / nodes.width, (x[1] - 2.0) / 2.0]
        return float(0.5 * z @ z)

    found = optimize.minimize(cost, mean, method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-12}).x
    off = found - mean
    assert off @ np.linalg.solve(parts.covariance[best], off) < 0.05**2
