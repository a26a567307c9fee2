"""The proposal that follows the radius: pieces of exponentials and Student-t, written out."""

from __future__ import annotations

from functools import partial
from itertools import pairwise

import numpy as np
import pytest
from scipy import stats
from scipy.integrate import quad

from bayestouch.finger.reading.profile import DOF, KNOTS, REACH, TAIL, ProfileProposal
from bayestouch.sampling.streams import BlockStreams

HEIGHT = np.array([[-2.0, 0.5, 0.5, -1.0], [0.0, -3.0, -0.2, -0.7]])


def proposal() -> ProfileProposal:
    """Two touches, four knots from -1 and from 2."""
    rng = np.random.default_rng(0)
    root = np.stack([rng.uniform(0.5, 1.5, (2, 4)), rng.normal(size=(2, 4)), rng.uniform(0.5, 1.5, (2, 4))], axis=-1)
    return ProfileProposal(np.array([-1.0, 2.0]), np.array([0.5, 0.25]), HEIGHT, rng.normal(size=(2, 4, 2)), root)


def marginal(block: int, w: float) -> float:
    """Straight logarithms between knots, and tails that fall by 0.9 a unit."""
    made = proposal()
    knots = made.first[block] + made.step[block] * np.arange(4)
    beyond = max(knots[0] - w, w - knots[-1], 0.0)
    return float(np.exp(np.interp(w, knots, HEIGHT[block]) - 0.9 * beyond))


def test_settings() -> None:
    assert (KNOTS, REACH, TAIL, DOF) == (25, 6.5, 0.9, 20.0)


@pytest.mark.parametrize("block", [0, 1])
def test_density(block: int) -> None:
    """Location and load are Student-t about a centre and with a root that go straight from knot to knot."""
    made = proposal()
    knots = made.first[block] + made.step[block] * np.arange(4)
    total = sum(quad(partial(marginal, block), a, b)[0] for a, b in pairwise(knots))
    total += (np.exp(HEIGHT[block, 0]) + np.exp(HEIGHT[block, -1])) / 0.9
    for w in (knots[0] - 3.0, knots[0], knots[0] + 0.1, knots[1] + 0.2, knots[3] - 0.01, knots[3] + 2.0):
        place = np.array([w, 0.3, -0.4])
        centre = [np.interp(w, knots, made.centre[block, :, i]) for i in range(2)]
        l11, l21, l22 = (np.interp(w, knots, made.root[block, :, i]) for i in range(3))
        root = np.array([[l11, 0.0], [l21, l22]])
        wanted = np.log(marginal(block, w) / total) + stats.multivariate_t(centre, root @ root.T, df=20).logpdf(
            place[1:]
        )
        found = made.log_density(np.tile(place, (2, 1, 1)))[block, 0]
        assert found == pytest.approx(wanted, abs=1e-7)


def test_draws() -> None:
    """Their density is the one stated; shares of w and spreads of the rest are right to five standard errors."""
    n = 20_000
    made = proposal()
    x, log_q = made.draw(BlockStreams(1, np.arange(2)), n)
    np.testing.assert_allclose(log_q, made.log_density(x), atol=1e-5)  # directions are drawn with 24 bits
    for block in range(2):
        knots = made.first[block] + made.step[block] * np.arange(4)
        ends = [knots[0] - 40, *knots, knots[-1] + 40]
        mass = np.array([quad(partial(marginal, block), a, b, limit=200)[0] for a, b in pairwise(ends)])
        found = np.histogram(x[block, :, 0], ends)[0] / n
        np.testing.assert_allclose(found, mass / mass.sum(), atol=5 * np.sqrt(0.25 / n))
        w = np.clip(x[block, :, 0], knots[0], knots[-1])
        centre = np.stack([np.interp(w, knots, made.centre[block, :, i]) for i in range(2)], axis=1)
        l11, l21, l22 = (np.interp(w, knots, made.root[block, :, i]) for i in range(3))
        z1 = (x[block, :, 1] - centre[:, 0]) / l11
        z2 = (x[block, :, 2] - centre[:, 1] - l21 * z1) / l22
        # Variance of a Student-t with 20 degrees of freedom: 20/18; kurtosis 3.375.
        np.testing.assert_allclose([z1.var(), z2.var()], 20 / 18, rtol=5 * np.sqrt(2.4 / n))
        assert abs(np.corrcoef(z1, z2)[0, 1]) < 5 / np.sqrt(n)
        above = x[block, :, 0][x[block, :, 0] > knots[-1]] - knots[-1]
        assert above.mean() == pytest.approx(1 / 0.9, rel=5 / np.sqrt(len(above)))


def test_some_touches() -> None:
    made = proposal()
    x = np.random.default_rng(1).normal(1.0, 1.0, (2, 5, 3))
    whole = made.log_density(x)
    np.testing.assert_allclose(made.select([1]).log_density(x[1:]), whole[1:])
    np.testing.assert_allclose(made.select(np.array([True, False])).log_density(x[:1]), whole[:1])
    assert (made.select([1]).n_blocks, made.dimension) == (1, 3)
