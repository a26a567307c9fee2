"""The map of a pad as weights of smooth functions: sizes, and what is left out, worked out by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from drifting_pad import map_of

from bayestouch.chain.noise import Noise
from bayestouch.chain.pad import PadChain
from bayestouch.pad import map_basis
from bayestouch.pad.candidates import kernel_shape
from bayestouch.pad.map_basis import MapBasis
from bayestouch.pad.residual_map import MapDiscrepancy


def shape(position: list[float]) -> PadChain:
    """Elements on a line whose kernel is 1/(1 + distance²)."""

    def kernel(distance: np.ndarray, values: np.ndarray) -> Any:
        return 1 / (1 + distance**2)

    m = len(position)
    return PadChain(cast(Any, kernel), np.zeros(0), np.full(m, 7.0), np.zeros(m), np.array(position)[:, None])


def test_size_of_the_map_beside_an_element() -> None:
    """At distance 1 the kernel is 1/2: 2 sqrt(3² + (8/2)²) = 10, whatever the gain of the element."""
    touch = np.array([[1.0]])
    basis = map_of(shape([0.0]), touch, 5.0, np.array([2.0]), 3.0, 8.0)
    assert basis.sensitivity(touch, np.array([0.3])) == pytest.approx(np.array([[3.0]]), rel=1e-6)
    assert basis.columns(touch) == pytest.approx(np.array([[[10.0]]]), rel=1e-6)


def calibrated(noise: Noise, reads: int) -> Any:
    """Two elements and 101 touches at places 0.5 mm apart under loads of 2, with a map of the length 20 mm."""
    place, chain = np.linspace(0.0, 50.0, 101)[:, None], shape([10.0, 40.0])
    misfit = MapDiscrepancy(
        location=place,
        load=np.full(101, 2.0),
        variance=np.full((101, 2), 1e3),
        amplitude=np.array([7.0, 3.0]),
        shape=kernel_shape(chain, place),
        misfit=0.1,
        relative=0.4,
        length_mm=20.0,
    )
    known = SimpleNamespace(counts=np.full((101, 2), reads), n_elements=2)
    fit = SimpleNamespace(misfit=misfit, known=known, chain=chain, predicted=lambda: np.full((101, 2), 5.0))
    return SimpleNamespace(fit=fit, shape=chain, noise=noise)


@pytest.mark.parametrize(
    ("sd", "noise", "variance"),
    [
        # Means of four readings; the model error, which an effect perhaps explains, does not count.
        ([0.2, 0.1], Noise(np.array([0.2, 0.1]), np.array([0.9, 0.9]), 0.1), [0.01, 0.0025]),
        # The calibration finds less noise than a search that begins without a map: 0.4² + (0.06 5)².
        ([1.2, 1.4], Noise(np.zeros(2), np.array([0.4, 0.4]), 0.06), [0.25, 0.25]),
    ],
)
def test_what_the_map_leaves_out_is_small_beside_the_noise(
    sd: list[float], noise: Noise, variance: list[float]
) -> None:
    """The variance of the map is a² (A² + B² K²), and that of its functions the sum of their squares."""
    model = calibrated(noise, 4)
    basis, place = MapBasis.of(model, np.array(sd)), model.fit.misfit.location
    kernel = 1 / (1 + (place - np.array([10.0, 40.0])) ** 2)
    whole = np.array([7.0, 3.0]) ** 2 * (0.1**2 + (0.4 * kernel) ** 2)
    functions = basis.columns(place)
    left = 2.0**2 * (whole - (functions**2).sum(axis=0)) / variance
    assert left.max() <= 0.001
    assert left.min() >= -1e-9
    assert basis.n_weights < 2 * 101


def test_so_many_functions_at_most(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 14 functions for two elements each has 7, but not fewer than the smallest number."""
    model = calibrated(Noise(np.full(2, 1e-3), np.zeros(2)), 1)
    monkeypatch.setattr(map_basis, "MOST_FUNCTIONS", 14)
    monkeypatch.setattr(map_basis, "LEAST_FUNCTIONS", 5)
    assert MapBasis.of(model, model.noise.tactile_sd).n_weights == 2 * 7
    monkeypatch.setattr(map_basis, "LEAST_FUNCTIONS", 9)
    assert MapBasis.of(model, model.noise.tactile_sd).n_weights == 2 * 9
