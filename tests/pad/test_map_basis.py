"""The map of a pad as weights of smooth functions: sizes and numbers of knots worked out by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from bayestouch.chain.pad import PadChain
from bayestouch.chain.smooth import PlaceBasis
from bayestouch.pad.map_basis import MapBasis


def shape(position: list[float]) -> PadChain:
    """Elements on a line whose kernel is 1/(1 + distance²)."""

    def kernel(distance: np.ndarray, values: np.ndarray) -> Any:
        return 1 / (1 + distance**2)

    m = len(position)
    return PadChain(cast(Any, kernel), np.zeros(0), np.full(m, 7.0), np.zeros(m), np.array(position)[:, None])


def test_size_of_the_map_beside_an_element() -> None:
    """At distance 1 the kernel is 1/2: 2 sqrt(3² + (8/2)²) = 10, whatever the gain of the element."""
    knot = np.array([[1.0]])
    basis = MapBasis((PlaceBasis.at(knot, 5.0),), np.array([2.0]), 3.0, 8.0, shape([0.0]))
    assert basis.sensitivity(knot, np.array([0.3])) == pytest.approx(np.array([[3.0]]), rel=1e-6)
    assert basis.columns(knot) == pytest.approx(np.array([[[10.0]]]), rel=1e-6)


def test_at_most_sixty_knots_of_an_element() -> None:
    """A grid of 101 nodes on all of which the map may be as large: each element keeps 60, and no more."""
    misfit = SimpleNamespace(length_mm=1.0, misfit=1.0, relative=0.0, amplitude=np.ones(2))
    known = SimpleNamespace(location=np.array([[0.0], [50.0]]))
    model: Any = SimpleNamespace(fit=SimpleNamespace(misfit=misfit, known=known), shape=shape([10.0, 40.0]))
    assert MapBasis.of(model).n_weights == 2 * 60
