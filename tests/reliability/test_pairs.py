"""Which of two indenters made a touch, where readings are not linear in the location, against brute force."""

from __future__ import annotations

import numpy as np
import pytest

from bayestouch import FingerDesign
from bayestouch.contact import composite_radius
from bayestouch.reliability import (
    Annulus,
    KnownFinger,
    TouchPlaces,
    design_maps,
    distinguished,
    expected_finger,
    optimism,
    threshold_radii,
)
from bayestouch.reliability.designs import places_deg
from bayestouch.reliability.information import RadiusScale

# Elements 1.2 mm below the surface and 2.8 mm apart.
SHALLOW = expected_finger(
    FingerDesign(n_elements=8, noise_percent_peak=1.72, sensing_radius_mm=11.5, pitch_deg=14.0), calibrated=False
)
ABOVE_DEG, TOUCHES = 7.0, 1000


def brute_force(known: KnownFinger, tips: list[float], angle_deg: float, use_load: bool) -> float:
    """Share of touches with random noise that are named rightly by the sum of the likelihood over a fine grid."""
    rng, sd, typical = np.random.default_rng(1), known.noise.tactile_sd, known.typical_load
    radii = composite_radius(tips, known.outer_radius_mm)
    angle = np.radians(np.arange(angle_deg - 12, angle_deg + 12, 0.05 if use_load else 0.1))
    force = known.noise.force_sd
    load = np.linspace(typical - 6 * force, typical + 6 * force, 31) if use_load else np.linspace(4.0, 620.0, 155)
    angle, load = (grid.ravel() for grid in np.meshgrid(angle, load, indexing="ij"))
    table = [known.predict(TouchPlaces(np.full(len(load), r), angle, load)) / sd for r in radii]
    right = 0.0
    for true, radius in enumerate(radii):
        place = TouchPlaces(np.array([radius]), np.radians([angle_deg]), np.array([typical]))
        readings = known.predict(place) / sd + rng.standard_normal((TOUCHES, len(sd)))
        felt = typical + force * rng.standard_normal((TOUCHES, 1))
        evidence = np.empty((2, TOUCHES))
        for k, rows in enumerate(table):
            half = 0.5 * (rows**2).sum(axis=1)
            for some in np.array_split(np.arange(TOUCHES), 20):
                log = readings[some] @ rows.T - half
                if use_load:
                    log -= 0.5 * ((felt[some] - load) / force) ** 2
                top = log.max(axis=1)
                evidence[k, some] = top + np.log(np.exp(log - top[:, None]).sum(axis=1))
        right += 0.5 * float((evidence[true] > evidence[1 - true]).mean())
    return right


@pytest.mark.parametrize(
    ("use_load", "angle_deg", "expected"), [(False, ABOVE_DEG, 0.915), (True, ABOVE_DEG, 0.855), (False, 0.0, 0.975)]
)
def test_the_share_of_touches_that_are_named_rightly(use_load: bool, angle_deg: float, expected: float) -> None:
    """The tip that is distinguished in 95 % of the touches to first order, above an element and between two."""
    radius = float(RadiusScale.of(SHALLOW, np.radians([angle_deg]), use_load=use_load).threshold()[0])
    tips = [0.0, radius]
    found = distinguished(SHALLOW, tips, [angle_deg], use_load=use_load)[0]
    assert found[0, 1] == found[1, 0] and found[0, 0] == found[1, 1] == 0.5
    # Brute force with 1500 touches of each; shares of 2000 have a standard error of 0.004 to 0.008.
    assert found[0, 1] == pytest.approx(expected, abs=0.01)
    if angle_deg == ABOVE_DEG:
        assert found[0, 1] == pytest.approx(brute_force(SHALLOW, tips, angle_deg, use_load), abs=0.02)


@pytest.mark.parametrize(("use_load", "angle_deg"), [(False, 0.0), (True, 0.0), (True, ABOVE_DEG)])
def test_a_threshold_is_distinguished_with_its_probability(use_load: bool, angle_deg: float) -> None:
    radius = float(threshold_radii(SHALLOW, [angle_deg], use_load=use_load)[0])
    right = distinguished(SHALLOW, [0.0, radius], [angle_deg], use_load=use_load)[0, 0, 1]
    assert right == pytest.approx(0.95, abs=0.01)


def test_a_flat_may_be_distinguished_less_than_a_sharper_tip() -> None:
    """Above the element, without a load, no tip is distinguished from an edge in 95 %: by brute force 94.9."""
    tips = [0.0, 3.9, 10.0, np.inf]
    right = distinguished(SHALLOW, tips, [ABOVE_DEG], use_load=False)[0, 0, 1:]
    np.testing.assert_allclose(right, [0.915, 0.948, 0.909], atol=0.01)
    assert np.isnan(threshold_radii(SHALLOW, [ABOVE_DEG], use_load=False)).all()


def test_where_readings_are_linear_the_scale_is_kept() -> None:
    known = expected_finger(FingerDesign(n_elements=8, noise_percent_peak=1.72), calibrated=False)
    places = np.array([0.0, 2.2, 4.4])
    scale = RadiusScale.of(known, np.radians(places))
    np.testing.assert_array_equal(threshold_radii(known, places), scale.threshold())
    np.testing.assert_array_equal(
        distinguished(known, [0.0, 2.0], places)[:, 0, 1], scale.distinguished(0.0, 2.0)[:, 0]
    )


def test_nothing_is_distinguished_from_a_flat() -> None:
    assert np.isnan(threshold_radii(SHALLOW, [ABOVE_DEG], from_r_c=np.inf)).all()


def test_a_flat_that_only_the_readings_distinguish() -> None:
    """Between two elements the scale gives 85 % for an edge and a flat; 99.8 % of 4000 simulated touches are right."""
    design = FingerDesign(
        n_elements=6, sensing_radius_mm=11.9, noise_percent_peak=4.0, calibration_span_deg=40.0, samples_per_touch=1
    )
    known, place = expected_finger(design), places_deg(design, [0.25])
    scale = RadiusScale.of(known, np.radians(place), use_load=False)
    assert scale.distinguished(0.0, np.inf)[0, 0] == pytest.approx(0.853, abs=0.002)
    assert np.isnan(scale.threshold()).all()
    (radius,) = threshold_radii(known, place, use_load=False)
    assert radius == pytest.approx(15.3, abs=0.5)
    right = distinguished(known, [0.0, radius, np.inf], place, use_load=False)[0, 0, 1:]
    np.testing.assert_allclose(right, [0.95, 0.998], atol=0.005)
    assert design_maps(design, "noise_percent", [4.0], indenters_mm=[0.0], places=[0.25]).threshold_mm[0, 0] == radius
    (found,) = optimism(known, Annulus(9.4 / 12.7, 11.9 / 12.7), place)
    assert found.honest_mm == radius
