"""Blocks of places that are held out together."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from bayestouch.diagnosis import blocks


def fitted(*place: np.ndarray) -> Any:
    model = SimpleNamespace(
        poses=lambda vector: SimpleNamespace(place=place), known=SimpleNamespace(n_touches=len(place[0]))
    )
    return SimpleNamespace(model=model, vector=None)


def test_places_of_a_finger() -> None:
    """72 places, each touched twice: 24 intervals of three."""
    angle = np.tile(np.arange(72.0), 2)
    found = blocks.place_blocks(fitted(angle))
    assert found is not None
    np.testing.assert_array_equal(found, np.tile(np.arange(72) * 24 // 72, 2))


def test_places_of_a_pad() -> None:
    """Five by five rectangles of a grid of 30 by 15."""
    x, y = (axis.ravel() for axis in np.meshgrid(np.arange(30.0), np.arange(15.0)))
    found = blocks.place_blocks(fitted(x, y))
    assert found is not None and len(np.unique(found)) == 25
    for each in np.unique(found):
        inside = found == each
        assert (np.ptp(x[inside]), np.ptp(y[inside]), inside.sum()) == (5.0, 2.0, 18)


def test_few_places_are_not_held_out() -> None:
    """Three places a block, and at least six blocks."""
    assert blocks.place_blocks(fitted(np.repeat(np.arange(17.0), 10))) is None
    found = blocks.place_blocks(fitted(np.repeat(np.arange(18.0), 10)))
    np.testing.assert_array_equal(np.unique(found), np.arange(6))
