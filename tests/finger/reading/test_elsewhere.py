"""Which touches may be at a distant location: the rule written out."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayestouch.chain.finger import FingerChain
from bayestouch.finger.reading import elsewhere
from bayestouch.finger.reading.elsewhere import distant_places, fits_as_well
from bayestouch.finger.reading.reader import FingerPosterior, IndenterPriors, TouchReadings


def test_settings() -> None:
    assert (pytest.approx(np.radians(6)), 8.0) == (elsewhere.APART, elsewhere.AS_WELL)


def test_a_place_that_fits_about_as_well() -> None:
    """Half the sum of squares of readings and load may be larger by less than eight."""
    # Residual of the one reading: w of the place.
    posterior: Any = SimpleNamespace(
        residual=lambda x, blocks: x[..., :1],
        touches=SimpleNamespace(load=np.array([10.0, 10.0, np.nan, np.nan]), load_sd=np.full(4, 2.0)),
    )
    mode = np.tile([1.0, 0.0, 12.0], (4, 1))
    place = np.array([[np.sqrt(17.9), 1.0, 10.0], [np.sqrt(18.1), 1.0, 10.0], [np.sqrt(16.9), 1.0, 50.0], [4.2, 1, 0]])
    np.testing.assert_array_equal(fits_as_well(posterior, mode, place), [True, False, True, False])


def test_the_best_of_the_distant_places() -> None:
    """Of a finger with two elements and a touch between them: none within 6° of the mode, and the best of the others.

    The readings are those of a touch at -20°, which is distant, so that it is the one that fits best.
    """
    one = np.ones(2)
    chain = FingerChain(9.4, 12.7, 5.0 * one, 9.9 * one, np.radians([-20.0, 20.0]), 0 * one, 0.46, 0.15, 300.0)
    radius = 12.7 * 0.35
    # 150 N/m is the load of the templates, half the largest one.
    readings = chain.predict(np.full(2, radius), np.radians([-20.0, 15.0]), np.full(2, 150.0))
    touches = TouchReadings(readings, np.ones((2, 2), dtype=np.int64), np.full(2, 150.0), one)
    posterior = FingerPosterior(chain, touches, IndenterPriors.of(chain, 100.0), np.full((2, 2), 0.01))
    found = distant_places(posterior, np.array([[0.0, np.radians(5), 150.0], [0.0, np.radians(15), 150.0]]))
    np.testing.assert_allclose(found[0], [np.log(0.35 / 0.65), np.radians(-20), 150.0], rtol=1e-6)
    assert abs(np.degrees(found[1, 1]) - 15) > 6


def test_both_ends_of_a_full_ring_are_one_place() -> None:
    angles, one = np.radians(np.arange(-180, 180, 30.0)), np.ones(12)
    chain = FingerChain(9.4, 12.7, 5.0 * one, 9.9 * one, angles, 0 * one, 0.46, 0.15, 300.0)
    priors = IndenterPriors.of(chain, 100.0)
    low, high = priors.location.support
    assert high - low == pytest.approx(2 * np.pi)
    readings = chain.predict(6.0, low + 0.01, 100.0)[None]
    touches = TouchReadings(readings, np.ones((1, 12), dtype=np.int64), np.array([100.0]), np.ones(1))
    found = distant_places(
        FingerPosterior(chain, touches, priors, np.full((1, 12), 0.01)), np.array([[0.0, low + 0.01, 100.0]])
    )
    turned = (found[0, 1] - low - 0.01 + np.pi) % (2 * np.pi) - np.pi
    assert abs(turned) > np.radians(6)
