"""Lattices over pads: step, ends and number of nodes worked out from the map's curvature."""

from __future__ import annotations

import warnings
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayestouch.pad.reading.lattice import Lattice, lattice_for


def reader(bend: float | list[float], low: list[float], high: list[float], sd: float = 0.5, load: float = 2.0) -> Any:
    """Elements read bend/2 · x² per N with noise `sd`; the map's grid has steps of 0.5 and 1.5 mm."""
    bends = np.atleast_1d(bend)
    step = np.array([0.5, 1.5])[: len(low)]
    axes = [a + s * np.arange(int((b - a) / s) + 1) for a, b, s in zip(low, high, step, strict=True)]
    first = np.meshgrid(*axes, indexing="ij")[0]
    made = SimpleNamespace(
        low=np.array(low),
        high=np.array(high),
        step=step,
        n_elements=len(bends),
        dimensions=len(low),
        sensitivity=0.5 * bends * first[..., None] ** 2,
    )

    def predict(location: np.ndarray, load: np.ndarray, counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        assert (counts == 1).all() and location.min() == min(low) and location.max() >= max(high)
        signal = load * 0.5 * bends * location[:, :1] ** 2
        return signal, np.full(signal.shape, sd**2)

    return SimpleNamespace(map=made, load=load, usable=np.ones(len(bends), dtype=bool), predict=predict)


@pytest.mark.parametrize("bend", [0.17, 0.57])
def test_step_by_curvature(bend: float) -> None:
    """Curvature P bend over half a step, bend P (step/2)²/2, is 0.3 sd."""
    found = lattice_for(reader(bend, [-20.0], [30.0]))
    step = np.sqrt(8 * 0.3 * 0.5 / (2.0 * bend))
    assert found.step == pytest.approx(step) and found.width == pytest.approx(0.6 * step)
    n = int(np.ceil((50 + 2 * step) / step)) + 1
    np.testing.assert_allclose(found.location[:, 0], -20 - step + step * np.arange(n))
    np.testing.assert_array_equal(found.place[:, 0], np.arange(n))
    assert found.location[-1, 0] >= 30 + step > found.location[-2, 0]


def test_the_sharpest_element_that_responds_counts() -> None:
    made = reader([0.15, 0.6, 9.0], [-20.0], [30.0])
    made.usable[2] = False
    assert lattice_for(made).step == pytest.approx(1.0)  # sqrt(1.2/1.2)


def test_an_element_without_a_signal_does_not_count() -> None:
    """Its noise where it has a signal is that of no place, and numpy warns of a mean of nothing."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = lattice_for(reader([0.6, 0.0], [-20.0], [30.0]))
    assert found.step == lattice_for(reader(0.6, [-20.0], [30.0])).step


def test_noise_is_that_where_the_signal_is_large() -> None:
    """Above three tenths of its peak, here 0.7 instead of 0.1."""
    made = reader(0.6, [-20.0], [20.0])
    plain = made.predict

    def predict(*given: Any) -> tuple[np.ndarray, np.ndarray]:
        signal, _ = plain(*given)
        return signal, np.where(np.abs(signal) > 0.3 * np.abs(signal).max(), 0.7, 0.1) ** 2

    made.predict = predict
    assert lattice_for(made).step == pytest.approx(np.sqrt(8 * 0.3 * 0.7 / 1.2))


def test_twenty_steps_over_the_longest_side_at_the_least() -> None:
    found = lattice_for(reader(1e-6, [0.0, 0.0], [40.0, 15.0]))
    assert found.step == 2.0
    np.testing.assert_allclose(found.location.min(axis=0), [-2, -2])
    # 44/2 and 19/2 steps.
    assert found.place.max(axis=0).tolist() == [22, 10] and len(found.place) == 23 * 11
    np.testing.assert_array_equal(found.location, -2.0 + 2.0 * found.place)
    # The same where no element responds, whatever the map: the whole side in one step otherwise.
    dead = reader(0.6, [0.0, 0.0], [40.0, 15.0])
    dead.usable[:] = False
    assert lattice_for(dead).step == 2.0


@pytest.mark.parametrize(("low", "high"), [([0.0], [2000.0]), ([0.0, 0.0], [100.0, 60.0])])
def test_no_more_than_twenty_thousand_nodes(low: list[float], high: list[float]) -> None:
    """Steps grow by five per cent as long as the region has more, with three nodes more a side."""
    wanted = lattice_for(reader(50.0, low, high, sd=0.01)).step
    step, size = np.sqrt(8 * 0.3 * 0.01 / 100.0), np.array(high) - low
    while np.prod(size / step + 3) > 20000:
        step *= 1.05
    assert wanted == pytest.approx(step) and np.prod(size / (step / 1.05) + 3) > 20000
    nodes = len(lattice_for(reader(50.0, low, high, sd=0.01)).place)
    assert 20000 / 1.05 ** len(low) * 0.98 < nodes < 20000 * 1.02
    assert isinstance(lattice_for(reader(50.0, low, high, sd=0.01)), Lattice)
