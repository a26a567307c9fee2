"""Mixtures of Student-t for many touches: density by scipy, and merging and counting of places by hand."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from bayestouch.pad.reading import proposal
from bayestouch.pad.reading.components import Components
from bayestouch.pad.reading.proposal import ManyParts, WithLogLoad, count_places, many_parts
from bayestouch.sampling.streams import BlockStreams

ROOT = np.array([[2.0, 0.0], [0.6, 0.5]])


def mixture() -> ManyParts:
    """Touches with two parts and with one."""
    weight = np.array([[0.7, 0.3], [1.0, 0.0]])
    mean = np.array([[[0.0, 1.0], [6.0, -2.0]], [[3.0, 3.0], [3.0, 3.0]]])
    root = np.array([[ROOT, np.eye(2)], [np.diag([0.5, 4.0]), np.eye(2)]])
    return ManyParts(weight, mean, root)


def exact(made: ManyParts, touch: int, x: np.ndarray, d: int = 2) -> np.ndarray:
    """Student-t with (dof + d)/2 = 8."""
    total = np.zeros(len(x))
    for weight, mean, root in zip(made.weight[touch], made.mean[touch], made.root[touch], strict=True):
        scale = (root @ root.T)[:d, :d]
        total += weight * stats.multivariate_t(mean[:d], scale, df=16 - d).pdf(x)
    return np.log(total)


def test_density() -> None:
    made = mixture()
    x = np.random.default_rng(0).normal(2.0, 3.0, (2, 5, 2))
    found = made.log_density(x)
    for touch in range(2):
        np.testing.assert_allclose(found[touch], exact(made, touch, x[touch]), rtol=1e-10)
    assert (made.n_blocks, made.dimension) == (2, 2)
    first = made.without_last()
    for touch in range(2):
        np.testing.assert_allclose(
            first.log_density(x[..., :1])[touch], exact(made, touch, x[touch, :, :1], 1), rtol=1e-10
        )


def test_a_load_below_zero_has_a_logarithm() -> None:
    """As if it were one sd: no load is below zero. A load far above its sd has its own logarithm."""
    mean = np.array([[[3.0, -0.04], [3.0, 0.02], [3.0, 2.0]]])
    root = np.array([[np.diag([0.5, 0.1]), [[0.5, 0.0], [0.03, 0.04]], np.diag([0.5, 0.1])]])
    made = WithLogLoad.of(ManyParts(np.full((1, 3), 1 / 3), mean, root)).parts
    np.testing.assert_allclose(made.mean[0, :, 1], np.log([0.1, 0.05, 2.0]))
    np.testing.assert_allclose(made.root[0, :, 1], [[0.0, 1.0], [0.6, 0.8], [0.0, 0.05]])
    np.testing.assert_array_equal(made.mean[0, :, 0], 3.0)


def test_draws_are_from_the_density() -> None:
    """Shares, means and covariances of 40,000 draws, within five standard errors."""
    n = 40_000
    made = mixture()
    x, log_q = made.draw(BlockStreams(3, np.arange(2)), n)
    np.testing.assert_allclose(log_q, made.log_density(x))
    covariance = 14 / 12 * np.stack([ROOT @ ROOT.T, np.eye(2)])
    mean = made.weight[0] @ made.mean[0]
    off = made.mean[0] - mean
    wanted = np.einsum("k,kij->ij", made.weight[0], covariance + off[:, :, None] * off[:, None, :])
    np.testing.assert_allclose(x[0].mean(axis=0), mean, atol=5 * np.sqrt(wanted.max() / n))
    np.testing.assert_allclose(np.cov(x[0].T), wanted, atol=5 * wanted.max() * np.sqrt(3 / n))
    # Kurtosis 3 + 6/(14 - 4): the sd of an sd is sqrt(2.6/4n) of it; four of them.
    np.testing.assert_allclose(x[1].std(axis=0), np.sqrt(14 / 12) * np.array([0.5, 4.0]), rtol=4 * np.sqrt(2.6 / 4 / n))


def test_some_touches() -> None:
    made = mixture()
    np.testing.assert_allclose(made.select([0]).log_density(np.ones((1, 3, 2)))[0], exact(made, 0, np.ones((3, 2))))
    assert made.select([1]).weight.shape == (1, 1) and made.select(np.array([True, False])).weight.shape == (1, 2)


def positive() -> ManyParts:
    """Mixtures of location and load, with loads from 2 to 6 N."""
    made = mixture()
    return ManyParts(made.weight, np.abs(made.mean) + np.array([0.0, 2.0]), 0.3 * made.root)


def test_mixtures_of_the_logarithm_of_the_load() -> None:
    """A Student-t of x and ln P, by the change of variables; spreads of ln P are those of P over its centre."""
    given = positive()
    made = WithLogLoad.of(given)
    x = np.random.default_rng(0).uniform(0.5, 6.0, (2, 5, 2))
    found = made.log_density(x)
    for touch in range(2):
        total = np.zeros(5)
        for weight, mean, root in zip(given.weight[touch], given.mean[touch], given.root[touch], strict=True):
            scaled = np.diag([1, 1 / mean[1]]) @ root
            log = stats.multivariate_t([mean[0], np.log(mean[1])], scaled @ scaled.T, df=14)
            total += weight * log.pdf(np.column_stack([x[touch, :, 0], np.log(x[touch, :, 1])])) / x[touch, :, 1]
        np.testing.assert_allclose(found[touch], np.log(total), rtol=1e-10)
    draws, log_q = made.draw(BlockStreams(3, np.arange(2)), 1000)
    np.testing.assert_allclose(log_q, made.log_density(draws))
    assert (draws[..., 1] > 0).all()
    assert np.isneginf(made.log_density(np.array([[[1.0, 0.0]], [[1.0, -2.0]]]))).all()
    np.testing.assert_allclose(
        made.without_last().log_density(x[..., :1]), given.without_last().log_density(x[..., :1])
    )
    np.testing.assert_allclose(made.select([1]).log_density(x[1:]), found[1:])


def test_parts_are_weighed_by_the_density() -> None:
    """Two parts far apart get the shares of their peaks; the broad part has a tenth, and 1.5 times the whole spread."""
    root = 0.1 * np.array([[np.eye(2), np.eye(2)]])
    given = WithLogLoad.of(ManyParts(np.array([[0.5, 0.5]]), np.array([[[-3.0, 4.0], [3.0, 4.0]]]), root))

    def log_density(x: np.ndarray) -> np.ndarray:
        return np.where(x[..., 0] > 0, np.log(4.0), 0.0) - 0.5 * (np.abs(x[..., 0]) - 3) ** 2 / 0.01

    made = given.weighed_by(log_density, np.array([-9.0]), np.array([9.0])).parts
    np.testing.assert_allclose(made.weight[0], [0.72, 0.18, 0.1], rtol=1e-9)
    np.testing.assert_allclose(made.mean[0, :, 0], [3.0, -3.0, 0.8 * 3 - 0.2 * 3])
    # Of the location: the spread of each part, and of two places 6 mm apart with shares 0.8 and 0.2.
    np.testing.assert_allclose(made.root[0, 2, 0, 0], 1.5 * np.sqrt(0.1**2 + 0.8 * 0.2 * 6**2))


def test_a_part_beyond_the_region_is_weighed_at_its_edge() -> None:
    """The density at the edge over that of the mixture there; it is minus infinity at the centre of the part."""
    mean, root = np.array([[[-1.0, 4.0], [0.5, 4.0]]]), np.tile(np.eye(2), (1, 2, 1, 1))
    given = WithLogLoad.of(ManyParts(np.array([[0.5, 0.5]]), mean, root))

    def log_density(x: np.ndarray) -> np.ndarray:
        return np.where(x[..., 0] < 0, -np.inf, given.log_density(x))

    made = given.weighed_by(log_density, np.array([0.0]), np.array([9.0])).parts
    np.testing.assert_allclose(made.weight[0], [0.45, 0.45, 0.1], rtol=1e-9)


def test_parts_that_all_lie_beyond_the_region_move_to_its_end() -> None:
    """Those of the first touch: 4 and 6 of their sd below the region, at the same load. The second has one 2 sd off."""
    mean = np.array([[[-4.0, 4.0], [-6.0, 5.0]], [[-4.0, 4.0], [-2.0, 4.0]]])
    given = WithLogLoad.of(ManyParts(np.full((2, 2), 0.5), mean, np.tile(np.eye(2), (2, 2, 1, 1))))
    made = given.reaching(np.array([0.0]), np.array([9.0])).parts
    np.testing.assert_array_equal(made.mean[..., 0], [[0.0, 0.0], [-4.0, -2.0]])
    np.testing.assert_allclose(np.exp(made.mean[..., 1]), mean[..., 1])
    np.testing.assert_array_equal(made.weight, given.parts.weight)
    np.testing.assert_array_equal(made.root, given.parts.root)


def parts(touch: list[int], place: list[list[int]], weight: list[float]) -> Components:
    n, d = len(touch), len(place[0])
    mean = np.column_stack([np.array(place, dtype=float), np.arange(n)])
    covariance = np.tile(np.eye(d + 1), (n, 1, 1)) * (1 + np.arange(n))[:, None, None]
    return Components(np.array(touch), np.array(place), np.log(weight), mean, covariance)


def test_parts_in_order_of_weight() -> None:
    """Shares add up to one; roots are five per cent wider; parts that are not there lie at the heaviest."""
    made = many_parts(parts([0, 0, 1], [[0], [9], [4]], [1.0, 3.0, 7.0]), 2)
    np.testing.assert_allclose(made.weight, [[0.75, 0.25], [1.0, 0.0]])
    np.testing.assert_allclose(made.mean, [[[9, 1], [0, 0]], [[4, 2], [4, 2]]])
    np.testing.assert_allclose(made.root[0, 0], 1.05 * np.sqrt(2) * np.eye(2))
    np.testing.assert_allclose(made.root[0, 1], 1.05 * np.eye(2))
    np.testing.assert_allclose(made.root[1], 1.05 * np.array([np.sqrt(3) * np.eye(2), np.eye(2)]))


@pytest.mark.parametrize(("most", "left"), [(4, 4), (3, 2), (2, 2), (1, 1)])
def test_neighbours_are_merged(monkeypatch: pytest.MonkeyPatch, most: int, left: int) -> None:
    """Two by two, with mean and covariance kept."""
    monkeypatch.setattr(proposal, "_MOST_PARTS", most)
    given = parts([0] * 4, [[0], [1], [2], [3]], [1.0, 3.0, 2.0, 2.0])
    weight, mean, covariance = proposal._merged(given, slice(0, 4))
    assert len(weight) == left
    if left == 2:
        np.testing.assert_allclose(weight, [0.5, 0.5])
        np.testing.assert_allclose(mean, [[0.75, 0.75], [2.5, 2.5]])
        # First pair: 1/4 · 1 + 3/4 · 2 on the diagonal, and 1/4 · 3/4 between places one apart.
        np.testing.assert_allclose(covariance[0], 1.75 * np.eye(2) + 3 / 16)
    whole = np.array([1, 3, 2, 2]) / 8
    total = whole @ given.mean
    np.testing.assert_allclose(weight @ mean, total)
    about = given.mean - total
    wanted = np.einsum("n,nij->ij", whole, given.covariance + about[:, :, None] * about[:, None, :])
    about = mean - total
    np.testing.assert_allclose(
        np.einsum("n,nij->ij", weight, covariance + about[:, :, None] * about[:, None, :]), wanted
    )


@pytest.mark.parametrize(
    ("weight", "places"),
    [
        ([1.0, 0.5, 0.2], 1),
        ([1.0, 0.1, 1.0], 2),
        ([1.0, 0.5, 0.98], 1),
        ([1.0, 0.48, 0.98], 2),
        # The lesser place must hold a twentieth: 0.06 of 1.07, 0.05 of 1.06.
        ([1.0, 0.01, 0.06], 2),
        ([1.0, 0.01, 0.05], 1),
        # A thousandth of the highest is no node: the place beyond stands alone.
        ([1.0, 0.0009, 0.3], 2),
        ([0.2, 0.15, 1.0, 0.15, 0.2], 1),
        ([0.5, 0.1, 1.0, 0.1, 0.5], 3),
    ],
)
def test_separate_places(weight: list[float], places: int) -> None:
    """Of a line: two peaks are one where the valley is more than half of the lesser one."""
    given = parts([0] * len(weight), [[i] for i in range(len(weight))], weight)
    assert count_places(given, 1).tolist() == [places]


def test_neighbours_in_the_plane_touch_at_corners() -> None:
    given = parts([0, 0, 1, 1], [[0, 0], [1, 1], [0, 0], [2, 0]], [1.0, 0.9, 1.0, 0.9])
    assert count_places(given, 2).tolist() == [1, 2]
