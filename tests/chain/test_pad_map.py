"""The tables of a pad over location and load, against functions written out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bayestouch.chain.pad_map import PadMap
from bayestouch.errors import InputError

LOADS = np.geomspace(0.5, 8.0, 40)


def sensitivity(x: np.ndarray, load: np.ndarray) -> np.ndarray:
    """Two elements whose width grows, and whose height falls, with the load."""
    centre = np.array([3.0, 8.0])
    width = 2.0 + 0.3 * np.log(load)[..., None]
    return (1 - 0.1 * np.log(load)[..., None]) * np.exp(-0.5 * ((x - centre) / width) ** 2)


def variance(x: np.ndarray, load: np.ndarray) -> np.ndarray:
    return 1e-4 * (1 + x**2 / 100) / load[..., None] * np.ones(2)


@pytest.fixture(scope="module")
def map_() -> PadMap:
    grid = np.arange(-1.0, 12.001, 0.1)[:, None]
    typical = np.full(len(grid), 2.0)
    mean, spread = sensitivity(grid, typical), variance(grid, typical)
    at = [np.full(len(grid), load) for load in LOADS]
    return PadMap(
        origin=grid[0],
        step=np.array([0.1]),
        low=np.array([0.0]),
        high=np.array([11.0]),
        offset=np.zeros(2),
        offset_variance=np.zeros(2),
        sensitivity=mean,
        variance=spread,
        covariance=np.zeros_like(mean),
        loads=LOADS,
        by_load=np.concatenate([sensitivity(grid, load) - mean for load in at], axis=-1),
        variance_by_load=np.concatenate([variance(grid, load) - spread for load in at], axis=-1),
    )


def test_sensitivity_and_its_variance_are_those_of_the_location_and_the_load(map_: PadMap) -> None:
    rng = np.random.default_rng(0)
    x, load = rng.uniform(0.5, 10.5, (50, 1)), rng.uniform(0.6, 7.5, 50)
    mean, spread, _ = map_.at(x, load)
    # Loads are 7 % apart; linear interpolation errs by h²/8 times the second derivative, which is below 0.3.
    np.testing.assert_allclose(mean, sensitivity(x, load), atol=0.3 * np.log(LOADS[1] / LOADS[0]) ** 2 / 8)
    np.testing.assert_allclose(spread, variance(x, load), rtol=2e-3)
    # Without a load: the tables themselves.
    np.testing.assert_allclose(map_.at(x)[0], sensitivity(x, np.full(50, 2.0)), atol=1e-5)


def test_a_location_that_is_not_known_has_no_sensitivity(map_: PadMap) -> None:
    """Nor has a load: draws of a touch for which no possible location was found are NaN. The others are as alone."""
    x, load = np.array([[4.0], [np.nan], [4.0]]), np.array([2.0, 2.0, np.nan])
    for found, alone in zip(map_.at(x, load)[:2], map_.at(x[:1], load[:1])[:2], strict=True):
        np.testing.assert_array_equal(found[:1], alone)
        assert np.isnan(found[1:]).all()


def test_slopes_are_the_derivatives_of_the_signal(map_: PadMap) -> None:
    rng = np.random.default_rng(1)
    x, load = rng.uniform(0.5, 10.5, (50, 1)), rng.uniform(0.6, 7.5, 50)
    # Both points of a difference lie between the same two loads.
    step = np.log(LOADS[1] / LOADS[0])
    load = LOADS[0] * np.exp((np.floor(np.log(load / LOADS[0]) / step) + 0.5) * step)
    by_load, along = map_.slopes(x, load)
    h = 1e-5
    more, less = ((load + d)[:, None] * map_.at(x, load + d)[0] for d in (h, -h))
    difference = (more - less) / (2 * h)
    np.testing.assert_allclose(by_load, difference, atol=1e-6)
    difference = (map_.at(x + h, load)[0] - map_.at(x - h, load)[0]) / (2 * h)
    np.testing.assert_allclose(along[:, 0], difference, atol=1e-6)


def test_it_is_constant_beyond_its_loads_and_survives_a_file(map_: PadMap) -> None:
    x = np.full((2, 1), 4.0)
    inside, beyond = (map_.at(x, np.array(each))[0] for each in ([0.5, 8.0], [0.01, 80.0]))
    np.testing.assert_allclose(beyond, inside)
    again = PadMap.from_arrays(map_.arrays())
    np.testing.assert_array_equal(again.at(x, np.array([1.0, 5.0]))[0], map_.at(x, np.array([1.0, 5.0]))[0])
    assert (map_.exact().at(x, np.array([1.0, 5.0]))[1] == 0).all()


def test_a_map_without_one_of_its_arrays_is_refused_in_words(map_: PadMap) -> None:
    arrays = {name: values for name, values in map_.arrays().items() if name != "map_sensitivity"}
    with pytest.raises(InputError, match="map_sensitivity"):
        PadMap.from_arrays(arrays)


def test_errors_that_elements_share_do_not_ask_for_those_of_effects(
    map_: PadMap, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Both are linear between grid points: 2 + 3 x and 5 x for two elements, and three errors of effects beside."""
    grid = np.arange(-1.0, 12.001, 0.1)[:, None]
    shared = np.concatenate([2 + 3 * grid, 5 * grid], axis=1)
    both = replace(map_, shared=shared, by_effect=np.tile(grid, 6), offset_by_effect=np.zeros((3, 2)))
    where = np.array([[[0.31], [7.77]], [[10.04], [-1.0]]])
    expected = np.concatenate([2 + 3 * where, 5 * where], axis=-1)[..., None, :]
    of_effects = np.broadcast_to(where[..., None], (2, 2, 3, 2))
    changes = both.changes(where)
    np.testing.assert_allclose(changes, np.concatenate([expected, of_effects], axis=-2), atol=1e-12)
    monkeypatch.setattr(PadMap, "changes", None)
    found = both.shared_at(where)
    np.testing.assert_array_equal(found, changes[..., :1, :])
    assert both.shared_at(np.zeros((0, 1))).shape == (0, 1, 2) and map_.shared_at(where).shape == (2, 2, 0, 2)
