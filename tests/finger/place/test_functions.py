"""Functions of place: their process, and what touches feel of them."""

from __future__ import annotations

import numpy as np
import pytest
from known_fingers import true_chain

from bayestouch.finger.place.functions import (
    MAP,
    PLACE,
    PlaceFunctions,
    Process,
    fourier,
    process_modes,
    spectrum,
    turned_back,
)

CHAIN = true_chain()
RNG = np.random.default_rng(3)
RADIUS, ANGLE, LOAD = RNG.uniform(2.0, 12.7, 9), RNG.uniform(-0.6, 0.6, 9), RNG.uniform(150, 250, 9)


@pytest.mark.parametrize("length", [4.0, 9.0, 26.0])
def test_process_has_a_matern_correlation(length: float) -> None:
    away = np.radians(np.array([0.0, 0.5, 1.0, 2.0]) * length)
    weights = spectrum(length)
    found = fourier(away, process_modes(length)) @ (weights * fourier(np.zeros(1), process_modes(length))[0])
    scaled = np.sqrt(5.0) * away / np.radians(length)
    # Modes that are left out hold half a percent of the power, which the others have instead.
    np.testing.assert_allclose(found, (1 + scaled + scaled**2 / 3) * np.exp(-scaled), atol=7e-3)


def test_a_touch_feels_the_map_through_its_own_pressure() -> None:
    """The elastic E map itself, as weights: readings of blunt touches are those of the chain."""
    functions = PlaceFunctions(MAP, Process(4.5, 0.02))
    n = functions.own.n_modes  # type: ignore[union-attr]
    # the elastic response to an edge, in modes of the angle from element to load
    around = 2 * np.pi * np.arange(512) / 512
    edge = np.stack([CHAIN.table(np.zeros(512), np.tile(around[:, None], (1, CHAIN.n_elements)))])[0]
    transform = np.fft.rfft(edge, axis=0) / 512
    weights = np.zeros((CHAIN.n_elements, 2 * n + 1))
    weights[:, 0], weights[:, 1::2] = transform[0].real, 2 * transform[1 : n + 1].real.T
    columns = functions.own_columns(CHAIN, RADIUS, ANGLE, LOAD)
    standard = weights / functions.own.weight_sd  # type: ignore[union-attr]
    found = np.einsum("tmk,mk->tm", columns, standard)
    # Modes beyond those of the process hold less than a thousandth of the peak under a tip of 2 mm.
    wanted, limit = CHAIN.predict(RADIUS, ANGLE, LOAD), 2e-3 * CHAIN.response.max() * 200
    np.testing.assert_allclose(found, wanted, atol=limit)
    np.testing.assert_allclose(functions.own_readings(CHAIN, RADIUS, ANGLE, LOAD, standard), wanted, atol=limit)


def test_powers_are_cosines_and_sines() -> None:
    angle = RNG.uniform(-3.0, 3.0, (4, 5))
    found = fourier(angle, 90)
    for k in range(91):
        # A rounding of each product: far below any reading.
        np.testing.assert_allclose(found[..., max(2 * k - 1, 0)], np.cos(k * angle), atol=1e-13)
        if k:
            np.testing.assert_allclose(found[..., 2 * k], np.sin(k * angle), atol=1e-13)


def test_weights_are_turned_to_the_angle_of_each_element() -> None:
    weights, own, angle = RNG.standard_normal((3, 13)), RNG.uniform(-1, 1, 3), RNG.uniform(-1, 1, 8)
    found = fourier(angle, 6) @ turned_back(weights, own).T
    for e in range(3):
        away = angle - own[e]
        wanted = weights[e, 0] + sum(
            weights[e, 2 * k - 1] * np.cos(k * away) + weights[e, 2 * k] * np.sin(k * away) for k in range(1, 7)
        )
        np.testing.assert_allclose(found[:, e], wanted, atol=1e-13)


def test_functions_of_the_place_are_the_same_for_all_indenters() -> None:
    functions = PlaceFunctions(PLACE, Process(6.0, 0.03))
    columns = functions.own_columns(CHAIN, RADIUS, ANGLE, LOAD)
    np.testing.assert_array_equal(columns, functions.own_columns(CHAIN, 0 * RADIUS, ANGLE, LOAD))
    sd = np.sqrt((columns**2).sum(axis=-1)) / LOAD[:, None]
    # cos² + sin² at every place: the size is that of the process, as a share of the response
    np.testing.assert_allclose(sd, np.broadcast_to(0.03 * CHAIN.response, sd.shape), rtol=1e-9)


def test_surface_adds_to_the_curvature_of_every_touch() -> None:
    """Readings over a weight, by a difference of the chain at radii that follow from the definition."""
    functions = PlaceFunctions(surface=Process(12.0, 0.1))
    process = functions.surface
    assert process is not None
    weight, outer, bent = 3, CHAIN.outer_radius_mm, 0.07

    def readings(value: float) -> np.ndarray:
        f = bent + value * process.weight_sd[weight] * fourier(ANGLE, process.n_modes)[:, weight]
        return CHAIN.predict(1 / (1 / RADIUS + np.expm1(f) / outer), ANGLE, LOAD)

    effective = 1 / (1 / RADIUS + np.expm1(bent) / outer)
    columns = functions.surface_columns(CHAIN, effective, ANGLE, LOAD, np.full(len(LOAD), bent))
    wanted = (readings(0.5) - readings(-0.5)) / 1.0
    # Differences of the table, linear between its knots, over steps of 2 % of R: within 3 % of the largest.
    np.testing.assert_allclose(columns[:, :, weight], wanted, atol=0.03 * np.abs(wanted).max())


def test_an_edge_feels_no_curvature() -> None:
    functions = PlaceFunctions(surface=Process(12.0, 0.1))
    assert not functions.surface_columns(CHAIN, 0 * RADIUS, ANGLE, LOAD).any()
