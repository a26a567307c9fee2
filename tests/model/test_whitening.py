"""Whitening: the inverse of what it makes of readings is the covariance of their noise, written out."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from bayestouch.model.noise import AddedNoise, NoiseModel
from bayestouch.model.whitening import Whitening

SD, PEAK = np.array([1.0, 2.0, 0.5]), np.array([100.0, 80.0, 120.0])
SIGNAL = np.array([[90.0, -20.0, 5.0], [3.0, 60.0, 110.0]])
BY_LOAD = np.array([[0.5, -0.2, 0.1], [0.0, 0.3, 0.6]])
NOISE = NoiseModel(SD, np.array([3.0, 2.0]), PEAK, AddedNoise(share=0.03, power=0.5, common=0.02, common_touch=0.01))


def observed() -> Any:
    """Touches of 6 and 2 reads, of which one element lacks two, and one all; rows of 3, 3 and 2 reads."""
    readings = np.array([[1.0, 2.0, 3.0], [1.0, np.nan, 3.0]])
    means = SimpleNamespace(readings=readings, counts=np.array([[6, 6, 4], [2, 9, 2]]))
    deviation = np.array([[0.1, 0.2, 0.3], [-0.1, np.nan, -0.3], [0.0, 0.0, 0.0]])
    return SimpleNamespace(
        means=means, row_touch=np.array([0, 0, 1]), weight=np.array([3.0, 3.0, 2.0]), deviation=deviation
    )


def own(touch: int) -> np.ndarray:
    return SD**2 + (0.03 * PEAK) ** 2 * np.abs(SIGNAL[touch]) / PEAK


def test_covariance_of_touches() -> None:
    """Own noise over the reads, the error of the load, and the error that all elements share."""
    white = Whitening.of(observed(), NOISE, SIGNAL, BY_LOAD)
    for touch, reads, most, here in (
        (0, np.array([6, 6, 4]), np.full((3, 3), 6) - 2 * np.diag([0, 0, 1]), [0, 1, 2]),
        (1, 2, 2, [0, 2]),
    ):
        by_load = BY_LOAD[touch] * NOISE.load_sd[touch]
        shared = (0.02**2 / most + 0.01**2) * np.outer(PEAK, PEAK)
        wanted = np.diag(own(touch) / reads) + np.outer(by_load, by_load) + shared
        root = white.root[touch][np.ix_(here, here)]
        np.testing.assert_allclose(root.T @ root, np.linalg.inv(wanted[np.ix_(here, here)]), rtol=1e-10)
    assert not white.root[1][1].any() and not white.root[1][:, 1].any()
    np.testing.assert_array_equal(white.present, [[True, True, True], [True, False, True]])


def test_rows_through_the_root() -> None:
    white = Whitening.of(observed(), NOISE, SIGNAL, BY_LOAD)
    rows = np.array([[1.0, 2.0, 3.0], [4.0, np.nan, 6.0]])
    found = white.touches(rows)
    np.testing.assert_allclose(found[0], white.root[0] @ rows[0])
    np.testing.assert_allclose(found[1], white.root[1] @ [4, 0, 6])
    np.testing.assert_allclose(white.touches(np.stack([rows, 2 * rows]))[1], 2 * found)


def test_samples() -> None:
    """Deviations of rows of so many reads; what all samples of a touch share is not in them."""
    white = Whitening.of(observed(), NOISE, SIGNAL, BY_LOAD)
    for row, touch, reads, here in ((0, 0, 3, [0, 1, 2]), (1, 0, 3, [0, 2]), (2, 1, 2, [0, 1, 2])):
        wanted = (np.diag(own(touch)) + 0.02**2 * np.outer(PEAK, PEAK)) / reads
        unit = np.zeros((3, 3, 3))
        unit[:, row] = np.eye(3)
        rows = white.samples(unit)[:, row]
        np.testing.assert_allclose(
            (rows @ rows.T)[np.ix_(here, here)], np.linalg.inv(wanted[np.ix_(here, here)]), rtol=1e-10
        )
    assert not white.samples(np.ones((3, 3)))[1, 1].any()


def test_density_of_deviations_changes_with_the_noise_as_that_of_independent_ones() -> None:
    """Three samples of two elements have four independent deviations; a single sample has none."""
    touch, elements = np.array([0, 0, 0, 1]), 2
    rng = np.random.default_rng(0)
    deviation = rng.normal(size=(3, elements))
    deviation -= deviation.mean(axis=0)
    # An orthonormal basis of the plane in which deviations from a mean lie.
    basis = np.array([[1, -1, 0], [1, 1, -2]]) / np.sqrt([[2], [6]])
    independent = basis @ deviation
    found, wanted = [], []
    for sd in (0.7, 2.0):
        white = Whitening(np.zeros((2, elements, elements)), np.full((4, elements), sd), np.zeros((4, elements)))
        inside = white.log_volume_within(touch)
        assert inside[1] == 0
        found.append(inside[0] - 0.5 * ((deviation / sd) ** 2).sum())
        wanted.append(stats.norm(0, sd).logpdf(independent).sum())
    assert found[1] - found[0] == pytest.approx(wanted[1] - wanted[0], rel=1e-12)


def test_volume_of_deviations_with_a_shared_error() -> None:
    """By the determinant of the covariance of one sample, of which n - 1 of n are independent."""
    sd, shared = np.array([1.0, 0.5, 2.0]), np.array([2.0, 1.0, 0.3])
    white = Whitening(np.zeros((1, 3, 3)), np.tile(sd, (4, 1)), np.tile(shared, (4, 1)))
    _, log_determinant = np.linalg.slogdet(np.diag(sd**2) + np.outer(shared, shared))
    assert white.log_volume_within(np.zeros(4, dtype=int))[0] == pytest.approx(-3 * 0.5 * log_determinant, rel=1e-12)


def test_rows_without_readings_have_no_volume() -> None:
    """Also where the elements of a touch lack different rows: each element has one deviation less than readings."""
    sd = np.array([[0.5, 2.0], [0.5, 2.0], [0.5, 2.0], [np.inf, np.inf]])
    white = Whitening(np.zeros((1, 2, 2)), sd, np.zeros((4, 2)))
    assert white.log_volume_within(np.zeros(4, dtype=int))[0] == pytest.approx(
        -2 * np.log(0.5) - 2 * np.log(2.0), 1e-12
    )
    sd[0, 1] = np.inf
    white = Whitening(np.zeros((1, 2, 2)), sd, np.zeros((4, 2)))
    assert white.log_volume_within(np.zeros(4, dtype=int))[0] == pytest.approx(-2 * np.log(0.5) - np.log(2.0), 1e-12)
