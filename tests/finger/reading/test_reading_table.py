"""Lookup tables of readings: bilinear between knots, their edge beyond, and how far they go around."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayestouch.finger.reading.reading_table import ANGLES, ReadingTable

STEP = 2 * np.pi / 4096


def plane() -> ReadingTable:
    """Two elements read a, and 10 b + a b, where a counts knots of κ and b of the angle; 3 by 4 knots."""
    a, b = np.meshgrid(np.arange(3.0), np.arange(4.0), indexing="ij")
    rows = np.stack([a, 10 * b + a * b], axis=-1).reshape(-1, 2).astype(np.float32)
    return ReadingTable(2.0, 0.5, 0.25, -0.3, 0.1, (3, 4), rows)


def look_up(a: float, b: float) -> np.ndarray:
    """Readings at knot coordinates: log(1 + κ/2) = 0.5 + 0.25 a, angle = -0.3 + 0.1 b."""
    kappa, angle = 2 * np.expm1(0.5 + 0.25 * a), -0.3 + 0.1 * b
    return np.asarray(plane()(np.array([kappa]), np.array([angle]))[0], dtype=float)


@pytest.mark.parametrize(("a", "b"), [(0.0, 0.0), (0.25, 1.5), (1.7, 2.9), (1.0, 2.0), (0.5, 0.5)])
def test_between_knots(a: float, b: float) -> None:
    np.testing.assert_allclose(look_up(a, b), [a, 10 * b + a * b], atol=2e-5)


def test_beyond_the_table_its_edge_counts() -> None:
    """To a thousandth of a knot."""
    np.testing.assert_allclose(look_up(-3.0, 1.0), [0, 10], atol=1e-5)
    np.testing.assert_allclose(look_up(9.0, 1.0), [2, 12], atol=0.0021)
    np.testing.assert_allclose(look_up(1.0, -2.0), [1, 0], atol=1e-5)
    np.testing.assert_allclose(look_up(1.0, 9.0), [1, 33], atol=0.012)


def chain() -> Any:
    """One knot of κ = 0.3 and one of 0.8, modes 0 to 2, two elements with complex weights."""
    spectra = SimpleNamespace(
        spectra=np.array([[1.0, 0.5, 0.25, 9.0], [2.0, 0.7, 0.1, 9.0]]),
        kappa_scale=3.0,
        coordinates=np.array([0.2, 0.6]),
    )
    weights = np.array([[1.0, 0.3 + 0.4j, -0.2j], [0.5, -0.1 + 0.2j, 0.6 + 0.1j]])
    return SimpleNamespace(spectra=spectra, n_coefficients=2, n_elements=2, mode_weights=weights)


@pytest.mark.parametrize(("low", "high"), [(-0.3, 0.4), (0.1, 0.1001), (2.9, 3.4), (-20.5 * STEP, 7.5 * STEP)])
def test_identified_map(low: float, high: float) -> None:
    """Sums over modes: c0 + 2 Re Σ conj(weight) knot exp(i n θ); a column beyond either end at the least."""
    made = chain()
    table = ReadingTable.of_map(made, low, high)
    assert ANGLES == 4096 and table.angle_step == pytest.approx(STEP)
    angle = table.angle_first + STEP * np.arange(table.shape[1])
    # The ends, rounded outwards, and one more on either side.
    assert angle[0] <= low - STEP * (1 - 1e-9) and angle[0] > low - 2 * STEP - 1e-12
    assert angle[-1] >= high + STEP * (1 - 1e-9) and angle[-1] < high + 2 * STEP + 1e-12
    rows = table.rows.reshape(*table.shape, 2)
    for knot in range(2):
        for element in range(2):
            terms = made.mode_weights[element].conj() * made.spectra.spectra[knot, :3]
            wanted = terms[0].real + 2 * sum((terms[n] * np.exp(1j * n * angle)).real for n in (1, 2))
            np.testing.assert_allclose(rows[knot, :, element], wanted, atol=2e-6)
    assert (table.kappa_scale, table.kappa_first) == (3.0, 0.2) and table.kappa_step == pytest.approx(0.4)
