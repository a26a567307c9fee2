"""The inversion of a regression, beside one on a much finer grid."""

from __future__ import annotations

import numpy as np
import pytest

from bayestouch.array_types import FloatArray
from bayestouch.baselines import Regression, RegressionTouches, read_by_regression

SD, FORCE_SD = 0.03, 0.01
CENTRES = np.array([[x, y] for x in (0.0, 6.0) for y in (0.0, 7.0, 14.0, 21.0)])


def bumps(inputs: FloatArray) -> FloatArray:
    """Readings (k, 8) of elements 6 to 7 mm apart at locations and loads (k, 3)."""
    square = ((inputs[:, None, :2] - CENTRES) ** 2).sum(axis=2)
    return np.asarray(inputs[:, 2:] ** 0.8 * np.exp(-square / (2 * 4.0**2)))


def of_element(element: int, inputs: FloatArray) -> tuple[FloatArray, FloatArray]:
    return bumps(inputs)[:, element], np.full(len(inputs), SD)


REGRESSION = Regression("bumps", tuple(lambda x, e=e: of_element(e, x) for e in range(8)), 0.0)  # type: ignore[misc]


def drawn(count: int) -> tuple[RegressionTouches, RegressionTouches]:
    """Touches whose ranges are the prior, and touches that the regression describes exactly, with loads measured."""
    draw = np.random.default_rng(3)
    edges = np.array([[-3.0, -3.0, 1.0], [9.0, 22.5, 3.0]])
    known = RegressionTouches(edges[:, :2], edges[:, 2], bumps(edges))
    at = draw.uniform(*edges, (count, 3))
    readings = bumps(at) + SD * draw.standard_normal((count, 8))
    measured = at[:, 2] + FORCE_SD * draw.standard_normal(count)
    return known, RegressionTouches(at[:, :2], measured, readings)


def on_a_fine_grid(held: RegressionTouches) -> tuple[FloatArray, FloatArray]:
    """Mean (t, 2) and sd (t, 2) of the location on a grid of 0.01 mm about each reference."""
    step = np.linspace(-0.6, 0.6, 121)
    offsets = np.stack(np.meshgrid(step, step, indexing="ij"), axis=-1).reshape(-1, 2)
    means, sds = [], []
    assert held.load is not None
    for place, load, reading in zip(held.location, held.load, held.readings, strict=True):
        places = place + offsets
        inputs = np.column_stack([places, np.full(len(places), load)])
        mean = bumps(inputs)
        sd = np.hypot(SD, 0.8 * mean / load * FORCE_SD)
        density = -(0.5 * ((reading - mean) / sd) ** 2 + np.log(sd)).sum(axis=1)
        weight = np.exp(density - density.max())
        weight /= weight.sum()
        means.append(weight @ places)
        sds.append(np.sqrt(weight @ (places - means[-1]) ** 2))
    return np.array(means), np.array(sds)


def test_locations_are_those_of_a_much_finer_grid() -> None:
    """With 61 nodes along each axis, 0.22 and 0.47 mm apart, they were up to 2 standard deviations from these."""
    known, held = drawn(40)
    read = read_by_regression(REGRESSION, known, held, FORCE_SD)
    mean, sd = on_a_fine_grid(held)
    # Touches near the border have wide posteriors, which the prior or the fine grid cuts.
    inner = ((held.location > [-1.0, -1.0]) & (held.location < [7.0, 20.5])).all(axis=1) & (sd < 0.15).all(axis=1)
    assert inner.sum() >= 15 and np.median(sd[inner]) < 0.12
    np.testing.assert_array_less(np.abs(read.location - mean)[inner] / sd[inner], 0.05)
    np.testing.assert_allclose(read.location_sd[inner], sd[inner], rtol=0.05)


@pytest.mark.slow
def test_regions_and_intervals_have_their_share_of_references() -> None:
    """Touches that the regression describes exactly; the limits are 3 standard errors of the count about 90 %."""
    known, held = drawn(100)
    read = read_by_regression(REGRESSION, known, held, FORCE_SD)
    assert held.load is not None
    low, high = read.load_interval.T
    assert 81 <= read.location_inside.sum() <= 99
    assert 81 <= ((low <= held.load) & (held.load <= high)).sum() <= 99
