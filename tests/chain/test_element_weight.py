"""Averages along the arc: of a kernel that is written out and integrated."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from bayestouch.chain.element_weight import ElementWeight

MODES = np.arange(30.0)


def mean_of_cosine(k: float, width: float, tails: float, radius: float) -> float:
    """Mean of cos(k s/r) over an even weight on (-w/2, w/2), and exponentials with the same variance, w²/12."""
    length = width / np.sqrt(24)
    even = quad(lambda s: 2 / width * np.cos(k * s / radius), 0, width / 2)[0]
    sides = quad(lambda s: np.exp(-s / length) / length * np.cos(k * s / radius), 0, 40 * length, limit=200)[0]
    return (1 - tails) * even + tails * sides


@pytest.mark.parametrize("tails", [0.0, 0.4, 1.0])
def test_each_element_has_its_own_width(tails: float) -> None:
    widths, radii = np.array([0.8, 2.5, 4.0]), np.array([9.0, 10.3, 11.0])
    found = ElementWeight(widths, tails).of_modes(MODES, radii)
    wanted = [[mean_of_cosine(k, w, tails, r) for k in MODES] for w, r in zip(widths, radii, strict=True)]
    np.testing.assert_allclose(found, wanted, atol=1e-8)


def test_one_width_is_that_of_all_and_a_point_has_none() -> None:
    radii = np.array([9.0, 10.3])
    same = ElementWeight(np.full(2, 1.5)).of_modes(MODES, radii)
    np.testing.assert_array_equal(ElementWeight(1.5).of_modes(MODES, radii), same)
    np.testing.assert_array_equal(ElementWeight(0.0, 0.3).of_modes(MODES, radii), np.ones((2, 30)))


def test_weights_of_several_fingers_are_those_of_each() -> None:
    radii = np.array([[9.0, 10.3], [9.1, 10.2]])
    one, two = ElementWeight(np.array([1.0, 2.0]), 0.2), ElementWeight(np.array([3.0, 0.5]), 0.9)
    together = ElementWeight.stacked([one, two])
    assert together is not None
    wanted = [each.of_modes(MODES, row) for each, row in zip((one, two), radii, strict=True)]
    np.testing.assert_allclose(together.of_modes(MODES, radii), wanted, rtol=1e-12)
    shared = ElementWeight.stacked([ElementWeight(1.0), ElementWeight(2.0)])
    assert shared is not None
    wanted = [ElementWeight(w).of_modes(MODES, row) for w, row in zip((1.0, 2.0), radii, strict=True)]
    np.testing.assert_allclose(shared.of_modes(MODES, radii), wanted, rtol=1e-12)
    assert ElementWeight.stacked([None, None]) is None
