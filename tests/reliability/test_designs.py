"""Questions of design: another sensor, how many calibration touches, how many samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bayestouch import InputError
from bayestouch.reliability import (
    Annulus,
    Effort,
    averaging_effort,
    calibration_effort,
    design_maps,
    expected_finger,
    pad_design_maps,
    sweet_spots,
)
from bayestouch.reliability.designs import PLACES, changed_design, places_deg
from bayestouch.reliability.pad_designs import changed_pad
from bayestouch.simulation import FingerDesign, PadDesign

DESIGN = FingerDesign(
    shear_modulus_MPa=0.08,
    sensing_radius_mm=10.3,
    n_elements=6,
    samples_per_touch=4,
    calibration_span_deg=40.0,
    edge_step_deg=4.0,
    flat_step_deg=8.0,
)
TIPS = (1.59, 6.01, 12.3)


def test_noise_is_all_there_is() -> None:
    """With half the noise all standard deviations halve: calibration errors come from noise too, priors are wide."""
    maps = design_maps(DESIGN, "noise_percent", [0.86, 1.72], indenters_mm=TIPS, places=[0.0, 0.5])
    # the force sensor's noise in the calibration stays: 0.5 % of the load against 1.72 % of the peak, in a part of it
    assert maps.sd("R")[1] / maps.sd("R")[0] == pytest.approx(2.0, rel=0.03)
    assert maps.threshold_mm[1] == pytest.approx(2 * maps.threshold_mm[0], rel=0.35)  # r_c is not a scale of its own
    assert maps.rms("theta_c").shape == (2,)
    known = expected_finger(maps.designs[0])
    spots = sweet_spots(known, TIPS, places_deg(DESIGN, [0.0, 0.5]), use_load=False)
    assert maps.sd("P")[0] == pytest.approx(spots.sd("P"))


def test_designs_change_what_they_say() -> None:
    depth = changed_design(DESIGN, "depth_mm", 1.7)
    assert depth.outer_radius_mm - depth.sensing_radius_mm == pytest.approx(1.7)
    assert depth.core_radius_mm == DESIGN.core_radius_mm
    thick = changed_design(DESIGN, "thickness_mm", 4.0)
    assert thick.outer_radius_mm - thick.core_radius_mm == pytest.approx(4.0)
    assert thick.sensing_radius_mm - thick.core_radius_mm == pytest.approx(0.9)
    close = changed_design(DESIGN, "spacing_mm", np.radians(DESIGN.pitch_deg) * DESIGN.sensing_radius_mm / 2)
    assert close.n_elements == 12
    assert close.pitch_deg == pytest.approx(DESIGN.pitch_deg / 2)
    for bad in (0.0, -1.0):
        with pytest.raises(InputError, match="pitch_deg"):
            changed_design(DESIGN, "spacing_mm", bad)
    with pytest.raises(InputError, match="vary"):
        changed_design(DESIGN, "colour", 1.0)  # type: ignore[arg-type]
    with pytest.raises(InputError):
        design_maps(DESIGN, "depth_mm", [5.0])  # below the core


def test_noise_as_a_strain_stays_when_the_peak_changes() -> None:
    deep = changed_design(DESIGN, "depth_mm", 2.9, noise_of="strain")

    def noise_strain(design: FingerDesign) -> float:
        outer = design.outer_radius_mm
        finger = Annulus(design.core_radius_mm / outer, design.sensing_radius_mm / outer)
        return float(finger.strain([0.0])[1].max() * design.noise_percent_peak)

    assert noise_strain(deep) == pytest.approx(noise_strain(DESIGN), rel=1e-9)
    assert deep.noise_percent_peak > DESIGN.noise_percent_peak


@pytest.mark.parametrize("elements", [6, 7])
def test_places_go_from_an_element_to_halfway(elements: int) -> None:
    design = replace(DESIGN, n_elements=elements)
    angles, places = design.element_angles_deg, places_deg(design, PLACES)
    assert np.abs(angles - places[0]).min() == pytest.approx(0, abs=1e-9)
    to_nearest = np.sort(np.abs(angles - places[-1]))[:2]
    assert to_nearest == pytest.approx([design.pitch_deg / 2] * 2)
    assert abs(places).max() <= design.pitch_deg / 2 + 1e-9


def test_sparse_elements_are_uneven() -> None:
    pitch = np.radians(DESIGN.pitch_deg) * DESIGN.sensing_radius_mm
    maps = design_maps(DESIGN, "spacing_mm", [0.7 * pitch, 1.5 * pitch], indenters_mm=TIPS)
    squares = (maps.sd("R") ** 2).mean(axis=1)
    between_over_above = squares[:, -1] / squares[:, 0]
    assert between_over_above[0] < between_over_above[1]
    assert maps.rms()[0] < maps.rms()[1]


def test_calibration_errors_shrink_as_the_root_of_the_touches() -> None:
    found = calibration_effort(DESIGN, (8.0, 4.0, 2.0), indenters_mm=TIPS, samples=50)
    assert list(found.count) == [14, 28, 54]
    extra = found.sd**2 - found.floor**2
    # priors take some of it where touches are few; places of touches relative to elements change
    assert extra[:2] * found.count[:2] == pytest.approx(extra[2] * found.count[2], rel=0.35)
    assert np.all(np.diff(found.sd) < 0)
    assert found.sd[-1] > found.floor


def test_lack_of_fit_is_not_averaged_away() -> None:
    places = places_deg(DESIGN, [0.0, 0.5])
    exact = expected_finger(DESIGN, calibrated=False)
    found = averaging_effort(exact, places, (1, 4, 16), indenters_mm=TIPS)
    assert found.sd == pytest.approx(found.sd[0] / np.sqrt(found.count), rel=1e-6)
    missing = averaging_effort(
        expected_finger(DESIGN, lack_of_fit_percent=1.72, calibrated=False), places, (1, 4, 16), indenters_mm=TIPS
    )
    # as large as the noise of a sample: variances add
    assert missing.floor == pytest.approx(found.sd[0], rel=1e-3)
    assert missing.sd**2 == pytest.approx(missing.floor**2 * (1 + 1 / missing.count), rel=1e-3)
    assert missing.enough(0.1) == pytest.approx(1 / 0.21, rel=1e-2)  # between 4 and 16


def test_a_finger_is_calibrated_with_the_loads_of_its_design() -> None:
    """Twice the load on rubber of twice the stiffness is the same contact: with twice the noise, R is as uncertain."""
    double = replace(
        DESIGN,
        load_range=(320.0, 480.0),
        shear_modulus_MPa=2 * DESIGN.shear_modulus_MPa,
        noise_percent_peak=2 * DESIGN.noise_percent_peak,
        force_noise_sd=2 * DESIGN.force_noise_sd,
    )
    one, two = (sweet_spots(expected_finger(each), TIPS, [0.0, 2.0]) for each in (DESIGN, double))
    assert expected_finger(double).typical_load == 400.0
    for name, factor in (("R", 1.0), ("theta_c", 1.0), ("P", 2.0)):
        assert two.noise_sd[name] == pytest.approx(factor * one.noise_sd[name], rel=1e-6)
        assert two.bias_rms[name] == pytest.approx(factor * one.bias_rms[name], rel=1e-6)


def test_a_force_sensor_without_noise_knows_the_load() -> None:
    exact, almost, usual = (
        sweet_spots(expected_finger(replace(DESIGN, force_noise_sd=sd)), TIPS, [0.0, 2.0]) for sd in (0.0, 0.01, 1.0)
    )
    assert (exact.sd("P") < 1e-3).all()
    assert exact.sd("R") == pytest.approx(almost.sd("R"), rel=1e-3)
    assert (exact.sd("R") < usual.sd("R")).all()


def test_impossible_efforts_and_noise_are_refused() -> None:
    with pytest.raises(InputError, match="noise_percent_peak: expected above zero"):
        design_maps(DESIGN, "noise_percent", [0.0])
    for nothing in (
        lambda: design_maps(DESIGN, "depth_mm", []),
        lambda: pad_design_maps(PadDesign(), "spacing_mm", []),
    ):
        with pytest.raises(InputError, match="values: expected one at least"):
            nothing()
    for percent in (-3.0, np.nan, np.inf):
        with pytest.raises(InputError, match="lack_of_fit_percent: expected a finite number, zero or larger"):
            expected_finger(DESIGN, lack_of_fit_percent=percent)
    with pytest.raises(InputError, match="flats_per_edge: expected above zero"):
        calibration_effort(DESIGN, flats_per_edge=0)
    with pytest.raises(InputError, match="one step at least"):
        calibration_effort(DESIGN, ())
    with pytest.raises(InputError, match="has 2 readings"):
        design_maps(replace(DESIGN, n_elements=2), "depth_mm", [2.5])


def test_another_pad() -> None:
    line = PadDesign(element_x_mm=(0.0, 6.0, 12.0, 18.0), element_y_mm=None, calibration_step_mm=1.0)
    maps = pad_design_maps(line, "noise_percent", [0.5, 1.0], places=[0.0, 0.5])
    assert maps.spots[0].location.ravel() == pytest.approx([6.0, 3.0])
    # noise drawn anew for calibrations of 24 places with 3 samples, whose own errors are part of it
    assert maps.sd()[1] / maps.sd()[0] == pytest.approx(2.0, rel=0.2)
    closer = changed_pad(line, "spacing_mm", 3.0)
    assert closer.element_x_mm == pytest.approx((0.0, 3.0, 6.0, 9.0))
    square = changed_pad(PadDesign(), "spacing_mm", 13.5)
    assert square.element_y_mm is not None
    assert max(square.element_y_mm) == pytest.approx(40.5)
    assert changed_pad(line, "thickness_mm", 4.0).thickness_mm == 4.0
    with pytest.raises(InputError, match="vary"):
        changed_pad(line, "depth_mm", 1.0)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="spacing_mm"):
        changed_pad(line, "spacing_mm", 0.0)
    with pytest.raises(InputError, match="one element"):
        changed_pad(replace(line, element_x_mm=(0.0,)), "spacing_mm", 2.0)


def test_spacing_of_a_pad_is_the_smallest_distance_between_elements() -> None:
    """Also away from the middle; on a regular pad the last bit is that of the elements in the middle."""
    uneven = PadDesign(element_x_mm=(0.0, 1.0, 5.0, 10.0, 15.0), element_y_mm=None)
    assert changed_pad(uneven, "spacing_mm", 4.0).element_x_mm == (0.0, 4.0, 20.0, 40.0, 60.0)
    even = tuple(4.4 * e for e in range(7))
    factor = 3.0 / (even[3] - even[2])
    assert changed_pad(replace(uneven, element_x_mm=even), "spacing_mm", 3.0).element_x_mm == tuple(
        factor * x for x in even
    )
    with pytest.raises(InputError, match="two elements are at the same place"):
        changed_pad(replace(uneven, element_x_mm=(0.0, 5.0, 10.0, 10.0)), "spacing_mm", 4.0)


def test_effort_is_interpolated() -> None:
    effort = Effort("R", np.array([1, 10, 100]), np.array([1.0, 0.5, 0.2]), 0.19)
    assert effort.needed(2.0) == 1
    assert effort.needed(0.5) == pytest.approx(10)
    assert 10 < effort.needed(0.3) < 100
    assert effort.enough(0.05) == np.inf
    assert 10 < effort.enough(0.1) <= 100
