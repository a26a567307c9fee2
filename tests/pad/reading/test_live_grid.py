"""Regions of the live reader of a pad: what is beyond their ends, and touches with long tails beside the elements."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

import bayestouch
from bayestouch.pad.reading.live import PadLive
from bayestouch.pad.reading.live_grid import Region
from bayestouch.pad.reading.reader import PadTouches
from bayestouch.reading.live import HeldTouch
from bayestouch.reading.options import Options

READS = 3


def beyond(end: float, half_width: float, turned: float) -> float:
    """Share of ∫ (change of the value)² beyond `end` of the variance inside, logistic density, value x + turned x³."""
    x = np.linspace(-half_width, 40.0, 400_001)
    density, value = stats.logistic.pdf(x), x + turned * x**3
    inside = x <= end
    mean = np.average(value[inside], weights=density[inside])
    squares = (value - mean) ** 2 * density
    return float(squares[~inside].sum() / squares[inside].sum())


@pytest.mark.parametrize("turned", [0.0, 0.01])
@pytest.mark.parametrize("reach", [4.0, 6.0, 9.0])
def test_the_share_of_the_variance_beyond_an_end(reach: float, turned: float) -> None:
    """Tails of a logistic density are exponential; a value that bends adds little beyond the end."""
    region = Region(np.array([-9.0]), np.array([50.0]), np.zeros(1), np.eye(1), 61, np.array([[20.0, reach]]))
    place, weights, ends = region.nodes()
    mass = weights * stats.logistic.pdf(place[:, 0])
    load = 3 + place[:, 0] + turned * place[:, 0] ** 3
    load_sd = np.sqrt(np.cov(load, aweights=mass / mass.sum(), ddof=0))
    ((below, above),) = region.beyond(mass / mass.sum(), ends, load, float(load_sd))
    assert below == 0.0  # an end of the calibrated region
    assert above == pytest.approx(beyond(reach, 9.0, turned), rel=0.15)


def test_each_end_of_each_coordinate_is_looked_at() -> None:
    """The second coordinate is logistic about the first: only its own ends are too near."""
    reach = np.array([[8.0, 8.0], [4.0, 6.0]])
    covariance = np.array([[1.0, 2.0], [2.0, 5.0]])  # the second given the first has a variance of 1
    region = Region(np.full(2, -60.0), np.full(2, 60.0), np.zeros(2), covariance, 31, reach)
    place, weights, ends = region.nodes()
    mass = weights * stats.norm.pdf(place[:, 0]) * stats.logistic.pdf(place[:, 1] - 2 * place[:, 0])
    shares = region.beyond(mass / mass.sum(), ends, np.ones(len(mass)), 1.0)
    assert shares[0] == pytest.approx([0.0, 0.0], abs=1e-6)
    assert shares[1] == pytest.approx([beyond(4.0, 6.0, 0.0), beyond(6.0, 4.0, 0.0)], rel=0.15)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("rest", [0.0, 1e-300])
def test_a_region_with_nothing_but_an_end_of_the_posterior(rest: float) -> None:
    """All mass is at the last node: no warning, which would end a loop in which warnings are errors."""
    region = Region(np.array([-9.0]), np.array([50.0]), np.zeros(1), np.eye(1), 25, np.full((1, 2), 5.0))
    place, _, ends = region.nodes()
    mass = np.append(np.full(24, rest), 1.0)
    ((below, above),) = region.beyond(mass, ends, np.where(mass > 0.5, 3.0, 0.0), 0.0)
    assert below == 0.0
    assert above > 1.0
    assert len(place) == 25


@pytest.fixture(scope="module")
def live() -> PadLive:
    """Two rows of four elements, 6.75 mm apart."""
    dataset = bayestouch.simulate(bayestouch.PadDesign(n_touches=5), seed=3).dataset
    return PadLive.of(bayestouch.calibrate(dataset, kernel="gaussian", e_map="model", draws=64, seed=1), Options())


@pytest.mark.parametrize("place", [(9.7, 0.0), (-3.0, 0.0)])
def test_a_long_tail_beside_the_elements(live: PadLive, place: tuple[float, float]) -> None:
    """A touch 3 mm beyond the last column: the location has a tail to 20 sd, without which the sd is 20 % too small."""
    reader, load = live.reader.sampler.reader, 1.4
    sensitivity, _, _ = reader.map.at(np.array([place]), np.array([load]))
    reading = reader.map.offset + load * sensitivity[0]
    touch, _ = live.read(HeldTouch.none(8).after(reading, load, READS))
    sd = reader.measured_load_sd(np.array([load]), np.array([READS]))
    touches = PadTouches(
        reading[None], np.full((1, 8), READS), np.array([load]), sd, reader.noise.load_scatter, np.zeros((1, 0, 9))
    )
    x = np.linspace(max(place[0] - 5, reader.map.low[0]), min(place[0] + 5, reader.map.high[0]), 250)
    y = np.linspace(reader.map.low[1], 6.0, 300)
    felt = load + np.hypot(sd, reader.noise.load_scatter) * np.linspace(-4, 4, 9)
    grid = np.stack([each.ravel() for each in np.meshgrid(x, y, felt, indexing="ij")], axis=-1)
    log = reader.log_density(touches, grid[None], np.array([0]))[0]
    weight = np.exp(log - log.max())
    for k, name in enumerate(("x", "y")):
        mean = np.average(grid[:, k], weights=weight)
        spread = np.sqrt(np.average((grid[:, k] - mean) ** 2, weights=weight))
        assert touch[name][0] == pytest.approx(mean, abs=0.05 * spread)
        assert touch[name][1] == pytest.approx(spread, rel=0.03)
    assert not touch.flags
