"""Errors of E maps as touches feel them, against the pressure spectra themselves."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayestouch.contact import contact_model
from bayestouch.finger.felt_map import NODES, FeltMap, chebyshev, shares_of_nodes
from bayestouch.finger.place.functions import spectrum

LENGTH = 9.0


class Spectra:
    """Spectra of the exact contact on the bonded layer, without the table that a chain has."""

    solved = contact_model("layer", (9.4, 12.7), 0.46)

    def at(self, kappa: np.ndarray, n: int) -> np.ndarray:
        return np.asarray(self.solved.spectrum(kappa, np.arange(n + 1)))


def test_nodes() -> None:
    """Chebyshev's of the second kind, from an edge to the largest P R."""
    np.testing.assert_allclose(chebyshev(2.0), [0, 1 - np.sqrt(0.5), 1, 1 + np.sqrt(0.5), 2], atol=1e-12)


def test_shares_of_the_nodes() -> None:
    """One at its node and none at the others; exact for a polynomial of degree four; constant beyond the last node."""
    nodes = chebyshev(3.0)
    np.testing.assert_allclose(shares_of_nodes(nodes, nodes), np.eye(NODES), atol=1e-12)
    at = np.array([0.1, 1.3, 2.9])
    np.testing.assert_allclose(shares_of_nodes(nodes, at) @ (nodes**4 - nodes), at**4 - at, rtol=1e-9)
    np.testing.assert_allclose(shares_of_nodes(nodes, np.array([4.0])), np.eye(NODES)[-1:], atol=1e-12)


@pytest.fixture(scope="module")
def felt() -> FeltMap:
    """The softest finger: 0.054 MPa, loads up to 260 N/m."""
    chain: Any = SimpleNamespace(outer_radius_mm=12.7, shear_modulus_MPa=0.054, spectra=Spectra())
    return FeltMap.of(chain, LENGTH, 260.0)


def test_what_touches_feel_of_each_wave(felt: FeltMap) -> None:
    """Of all waves of the process together, the polynomial errs by less than 1 % of its standard deviation."""
    radius, load = np.array([0.0, 1.4, 4.1, 8.5, 12.7]), np.array([200.0, 160, 240, 200, 180])
    found = felt(radius, load, np.zeros((5, 1)))[:, 0]
    weight_sd = np.sqrt(spectrum(LENGTH))
    n = felt.process.n_modes
    exact = Spectra().at(load / 1000 * radius / 0.054, n)
    # At angle zero only cosines are left.
    np.testing.assert_allclose(found[:, 2::2], 0.0, atol=1e-12)
    left = np.concatenate([found[:, :1], found[:, 1::2]], axis=1)
    wanted = exact * np.concatenate([weight_sd[:1], weight_sd[1::2]])
    assert np.sqrt(((left - wanted) ** 2).sum(axis=1)).max() < 0.01
    np.testing.assert_allclose(left[0], wanted[0], rtol=1e-6)


def test_an_edge_feels_a_function_of_standard_deviation_one(felt: FeltMap) -> None:
    away = np.array([[-70.0, 0.0, 31.0]])
    columns = felt(np.zeros(1), np.full(1, 200.0), away)[0]
    np.testing.assert_allclose((columns**2).sum(axis=1), 1.0, rtol=1e-6)
