"""Reading touches of a finger with functions of place: the table against the finger."""

from __future__ import annotations

import numpy as np
import pytest
from known_fingers import true_chain
from place_cases import touches

from bayestouch.finger.place.chain import FingerWithPlaces
from bayestouch.finger.place.functions import MAP, PLACE, PlaceFunctions, Process
from bayestouch.finger.place.posterior import PlacePosterior
from bayestouch.finger.reading.places import table_with_places
from bayestouch.finger.reading.reader import FingerPosterior, IndenterPriors, TouchReadings

CHAIN = true_chain()
SURFACE = Process(14.0, 0.2)


def finger(kind: str, surface: Process | None) -> FingerWithPlaces:
    """A finger with functions of place that are known for sure."""
    rng, m = np.random.default_rng(6), CHAIN.n_elements
    own = Process(9.0, 0.03) if kind else None
    k, q = (0 if each is None else 2 * each.n_modes + 1 for each in (own, surface))
    places = PlacePosterior(
        PlaceFunctions(kind, own, surface),
        angle=CHAIN.angle + 0.01,
        response=1.1 * CHAIN.response,
        own=rng.standard_normal((m, k)),
        surface=rng.standard_normal(q),
        gains=np.zeros((m, k, 5 + q)),
        own_covariance=np.zeros((m, k, k)),
        covariance=np.zeros((3 * m + 2 + q,) * 2),
    )
    return FingerWithPlaces(CHAIN, places)


@pytest.mark.parametrize(("kind", "surface"), [(MAP, None), (PLACE, None), ("", SURFACE), (MAP, SURFACE)])
def test_density_by_table_is_that_by_the_finger(kind: str, surface: Process | None) -> None:
    built = finger(kind, surface)
    radius, angle, load = touches(20)
    readings = built.predict(radius, angle, load)
    assert np.abs(readings - CHAIN.predict(radius, angle, load)).max() > 10
    unknown = TouchReadings(readings, np.ones(readings.shape, dtype=int), load, np.ones(20))
    priors = IndenterPriors.of(built, 200.0)
    table = table_with_places(built, *priors.location.support)
    posterior = FingerPosterior(built, unknown, priors, np.ones(readings.shape), table)
    x = np.stack([np.log(radius / (CHAIN.outer_radius_mm - radius)), angle, load], axis=-1)[:, None]
    left = posterior.residual(x, np.arange(20))[:, 0]
    # Linear interpolation of both tables: 1e-4 of the peak, and twice that with rows of angle and width.
    np.testing.assert_allclose(left, 0.0, atol=5e-4 * CHAIN.response.max() * 230)


def test_arguments_of_a_finger_broadcast() -> None:
    built = finger(MAP, SURFACE)
    radius, angle, load = touches(3)
    whole = built.predict(radius[:, None], angle[:, None], np.stack([load, load], axis=1))
    assert whole.shape == (3, 2, CHAIN.n_elements)
    np.testing.assert_allclose(whole[:, 1], built.predict(radius, angle, load))
    np.testing.assert_allclose(built.predict(4.0, angle, load), built.predict(np.full(3, 4.0), angle, load))


def test_a_surface_that_is_more_curved_is_felt_as_a_sharper_tip() -> None:
    built = finger("", SURFACE)
    angle = np.linspace(-0.6, 0.6, 9)
    bent = built.places.log_curvature(angle)
    assert np.ptp(bent) > 0.1
    flat = np.full(9, CHAIN.outer_radius_mm)
    np.testing.assert_allclose(built.effective_radius(flat, angle), CHAIN.outer_radius_mm * np.exp(-bent))
    np.testing.assert_array_equal(built.effective_radius(0 * flat, angle), 0.0)
