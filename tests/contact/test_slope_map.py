"""The paper's S map against the contact solved without truncation."""

import numpy as np
import pytest
from scipy.optimize import brentq

from bayestouch.contact import LayerContact, composite_radius
from bayestouch.contact.slope_map import SlopeMap
from bayestouch.errors import InputError

BODY = {"core_radius_mm": 9.4, "outer_radius_mm": 12.7, "poisson_ratio": 0.46}
FLAT_KAPPA = 0.2 * 12.7 / 0.3


@pytest.fixture(scope="module")
def layer():
    return LayerContact.for_body(9.4, 12.7, 0.46)


def solved(coefficients, kappa, layer, centre=0.0):
    """Error of the load at the exact half-width, and largest error of q_k, for a flat."""
    beta = float(layer.half_angle(kappa))
    built = SlopeMap.for_contact(coefficients, half_angle_rad=beta, centre_rad=centre, **BODY)
    pressure = built.pressure(built.contact_angles)  # slope s/r_b
    load = built.load_over_modulus(pressure) * 12.7 / kappa - 1
    spectrum = built.spectrum(pressure) - layer.spectrum(kappa, np.arange(coefficients + 1))
    return load, np.max(np.abs(spectrum))


def test_shapes_are_the_papers():
    built = SlopeMap.for_contact(30, half_angle_rad=0.25, **BODY)
    assert built.slopes.shape == (4 * 30 + 2, 2 * 30 + 1)
    assert np.all(np.abs(built.contact_angles) < 0.25)
    assert built.outside.shape == (8 * 30 + 4, 2 * 30 + 1)
    # mode 1 tells the places outside apart: cos θ is never above the contact edge's
    assert np.all(built.outside[:, 2] < np.cos(0.25))


def test_forward_map_is_the_slope_of_the_surface(layer):
    """S p against du_r/ds by differences of u_r, for random p."""
    from bayestouch.body.finger import surface_displacement_response

    built = SlopeMap.for_contact(12, half_angle_rad=0.4, centre_rad=0.7, **BODY)
    p = np.random.default_rng(1).normal(size=25)
    response = surface_displacement_response(np.arange(13), **BODY)

    def displacement(theta):
        phase = np.outer(theta, np.arange(1, 13))
        return -(p[0] * response[0] + (np.sin(phase) * p[1::2] + np.cos(phase) * p[2::2]) @ response[1:])

    theta, step = built.centre_rad + built.contact_angles, 1e-5
    numeric = (displacement(theta + step) - displacement(theta - step)) / (2 * step * 12.7)
    np.testing.assert_allclose(built.slopes @ p, numeric, atol=1e-8)  # h² k³/6 at k = 12


def test_agrees_with_the_layer_and_converges(layer):
    """Flat at P/μ = 2/3 mm (β = 0.125): load and spectrum, n_c = 40 … 320 (n_c β = 5 … 40)."""
    errors = np.abs([solved(n, FLAT_KAPPA, layer) for n in (40, 80, 160, 320)])
    assert np.all(errors[:, 0] < [0.03, 0.015, 0.003, 0.0005])
    assert np.all(errors[:, 1] < [0.035, 0.012, 0.0035, 0.001])
    rate = -np.polyfit(np.log([40, 80, 160, 320]), np.log(errors[:, 1]), 1)[0]
    assert rate > 1.4  # q_k ~ k^-1.5 is what the series leaves out


def test_error_depends_on_resolution_of_the_contact_only(layer):
    """A contact twice as wide needs half the coefficients, to within the layer's own part in it."""
    wide = float(np.interp(2 * layer.half_angle(FLAT_KAPPA), layer.half_angles, layer.kappas))
    assert solved(40, wide, layer)[1] == pytest.approx(solved(80, FLAT_KAPPA, layer)[1], rel=0.3)


def test_location_is_a_rotation(layer):
    here, there = solved(60, FLAT_KAPPA, layer), solved(60, FLAT_KAPPA, layer, centre=2.1)
    np.testing.assert_allclose(there, here, atol=1e-9)


@pytest.mark.parametrize(("radius", "coefficients", "tolerance"), [(12.3, 160, 2e-3), (3.9, 160, 1e-2)])
def test_width_from_load(layer, radius, coefficients, tolerance):
    """n_c β = 14 and 10. Half the load's error, which at 10 is 1.5 % and at 14 about 1/4 %."""
    composite = composite_radius(radius, 12.7)

    def excess(half_angle):
        built = SlopeMap.for_contact(coefficients, half_angle_rad=half_angle, centre_rad=0.3, **BODY)
        return built.load_over_modulus(built.pressure(12.7 * built.contact_angles / composite)) - 2 / 3

    width = brentq(excess, 3 / coefficients * (1 + 1e-9), 1.0, xtol=1e-6)
    built = SlopeMap.for_contact(coefficients, half_angle_rad=width, centre_rad=0.3, **BODY)
    pressure = built.pressure(12.7 * built.contact_angles / composite)
    kappa = 2 / 3 * composite
    assert built.load_over_modulus(pressure) == pytest.approx(2 / 3, rel=1e-4)  # brentq to 1e-6 rad
    assert 12.7 * built.half_angle_rad == pytest.approx(float(layer.half_width(kappa)), rel=tolerance)
    exact = layer.spectrum(kappa, np.arange(coefficients + 1))
    np.testing.assert_allclose(built.spectrum(pressure), exact, atol=2 * tolerance)


def test_conditioning_with_and_without_zero_rows():
    """Stacked: all singular values within a factor of five. S alone: the part 2 n_c β/π, and none for p_0."""
    built = SlopeMap.for_contact(80, half_angle_rad=0.26, **BODY)
    stacked = built.singular_values()
    assert stacked[0] / stacked[-1] < 5
    alone = built.singular_values(outside_weight=0.0)
    expected = 2 * 80 * 0.26 / np.pi
    assert np.sum(alone > 0.5 * np.median(alone[: int(expected)])) == pytest.approx(expected, abs=4)
    assert alone[-1] < 1e-12 * alone[0]
    assert np.all(built.slopes[:, 0] == 0)
    # its smallest-pressure inverse therefore carries no load
    useless = built.pressure(built.contact_angles, outside_weight=0.0)
    assert abs(built.load_over_modulus(useless)) < 1e-6
    assert built.load_over_modulus(built.pressure(built.contact_angles)) > 1


def test_weight_of_the_zero_rows(layer):
    """Why equal weight: heavier ones bias the load low, lighter ones high."""
    beta = float(layer.half_angle(FLAT_KAPPA))
    built = SlopeMap.for_contact(80, half_angle_rad=beta, **BODY)
    loads = [
        built.load_over_modulus(built.pressure(built.contact_angles, outside_weight=w)) * 12.7 / FLAT_KAPPA - 1
        for w in (0.3, 1.0, 3.0)
    ]
    assert loads[0] > 0.03
    assert loads[2] < -0.03
    assert abs(loads[1]) < 0.015


@pytest.mark.parametrize(
    "call",
    [
        lambda: SlopeMap.for_contact(20, half_angle_rad=0.1, **BODY),
        lambda: SlopeMap.for_contact(20, half_angle_rad=4.0, **BODY),
    ],
)
def test_impossible_input_is_refused(call):
    with pytest.raises(InputError):
        call()
