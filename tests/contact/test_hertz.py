"""Hertz contact: appendix A of the paper, with the erratum for equation (8)."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import j1

from bayestouch.contact import HertzContact, composite_radius, indenter_radius
from bayestouch.contact.hertz import (
    elliptic_spectrum,
    half_width,
    pressure,
)
from bayestouch.errors import InputError

RUBBER = {"outer_radius_mm": 12.7, "shear_modulus_MPa": 0.3, "poisson_ratio": 0.46}
LOAD = 0.2  # N/mm


def arc_of_contact(radius):
    """Equation (8), corrected: the full width over r_b, rad."""
    outer, sigma = RUBBER["outer_radius_mm"], RUBBER["poisson_ratio"]
    composite = composite_radius(radius, outer)
    return 2 / outer * np.sqrt(2 * LOAD * (1 - sigma) * composite / (np.pi * RUBBER["shear_modulus_MPa"]))


def integrated(function, half_arc):
    """∫ f dθ over the contact; θ = β sin ψ takes the square roots out of the edges."""
    return quad(lambda psi: function(half_arc * np.sin(psi)) * half_arc * np.cos(psi), -np.pi / 2, np.pi / 2)[0]


@pytest.mark.parametrize("outer", [12.7, 3.7, 7.9, 12.6])
def test_a_flat_has_the_radius_of_the_finger(outer):
    """To the last bit: 1/(1/r_b) is another number for some fingers, and r_c of that is not infinite."""
    np.testing.assert_array_equal(composite_radius([0.0, np.inf, -np.inf], outer), [0.0, outer, outer])
    assert composite_radius(2.0, outer) == 1 / (1 / outer + 1 / 2.0)
    np.testing.assert_array_equal(indenter_radius(composite_radius([0.0, np.inf], outer), outer), [0.0, np.inf])


@pytest.mark.parametrize("radius", [0.5, 3.9, 12.3, 25.25, np.inf])
def test_pressure_integrates_to_load_with_corrected_width_only(radius):
    arc = arc_of_contact(radius)

    def load(width):
        return RUBBER["outer_radius_mm"] * integrated(
            lambda theta: pressure(theta, arc_rad=width, indenter_radius_mm=radius, **RUBBER), width / 2
        )

    assert load(arc) == pytest.approx(LOAD, rel=1e-9)  # quadrature
    # Equation (8) as printed: (1/r_b + 1/r_c) in the place of R. The load is then off by 1/R².
    composite = composite_radius(radius, RUBBER["outer_radius_mm"])
    printed = arc / composite
    assert load(printed) == pytest.approx(LOAD / composite**2, rel=1e-9)
    assert abs(load(printed) / LOAD - 1) > 0.5


def test_spectrum_is_that_of_the_pressure():
    """Equation (9) as printed is the pressure's Fourier coefficients by quadrature, and the spectrum p_k over 2 p_0."""
    arc = arc_of_contact(3.9)
    modes = np.array([1, 2, 7, 30, 80])

    def integral(k):
        of_width = {"arc_rad": arc, "indenter_radius_mm": 3.9, **RUBBER}
        return integrated(lambda theta: pressure(theta, **of_width) * np.cos(k * theta), arc / 2)

    scale = RUBBER["shear_modulus_MPa"] / (1 - RUBBER["poisson_ratio"]) * (1 + RUBBER["outer_radius_mm"] / 3.9)
    mean, printed = scale / 4 * (arc / 2) ** 2, scale / 2 * arc / modes * j1(arc / 2 * modes)
    assert mean == pytest.approx(integral(0) / (2 * np.pi), rel=1e-9)
    np.testing.assert_allclose(printed, [integral(k) / np.pi for k in modes], atol=1e-10)
    np.testing.assert_allclose(elliptic_spectrum(arc / 2, modes), printed / (2 * mean), rtol=1e-12)


def test_half_widths_of_the_physics_table():
    radii = np.array([0.5, 3.9, 12.3, 25.25, np.inf])
    composite = composite_radius(radii, 12.7)
    stiff = half_width(0.2 * composite / 0.3, 0.46)
    soft = half_width(0.2 * composite / 0.05, 0.46)
    np.testing.assert_allclose(stiff, [0.3320, 0.8269, 1.1967, 1.3916, 1.7061], atol=5.1e-5)
    np.testing.assert_allclose(soft, [0.8133, 2.0256, 2.9312, 3.4087, 4.1790], atol=5.1e-5)


def test_composite_radius_and_back():
    radii = np.array([0.0, 1e-6, 0.5, 12.7, 25.25, np.inf, -20.0])
    composite = composite_radius(radii, 12.7)
    assert composite[0] == 0
    assert composite[3] == pytest.approx(6.35)
    assert composite[5] == 12.7
    assert composite[6] > 12.7  # a hollow touches wider than a flat
    np.testing.assert_allclose(indenter_radius(composite, 12.7), radii, rtol=1e-9)
    assert indenter_radius(np.inf, 12.7) == -12.7


def test_spectrum_shape_and_limits():
    contact = HertzContact(12.7, 0.46)
    modes = np.arange(0, 200, 7)
    spectrum = contact.spectrum(np.array([[0.0, 1e-4, 8.0]]), modes)
    assert spectrum.shape == (1, 3, len(modes))
    assert np.all(spectrum[..., 0] == 1)
    assert np.all(spectrum[0, 0] == 1)  # knife edge
    # 1 - (ka/r_b)²/8 for narrow contacts; the next term is (ka/r_b)⁴/192
    z = modes * contact.half_width(1e-4) / 12.7
    np.testing.assert_allclose(spectrum[0, 1], 1 - z**2 / 8, atol=np.max(z) ** 4 / 192)


@pytest.mark.parametrize(
    "call",
    [
        lambda: composite_radius(-1.0, 12.7),
        lambda: composite_radius(np.nan, 12.7),
        lambda: indenter_radius(-0.1, 12.7),
        lambda: half_width(-1.0, 0.46),
        lambda: half_width(np.nan, 0.46),
        lambda: half_width(np.inf, 0.46),
        lambda: pressure(0.1, arc_rad=0.2, indenter_radius_mm=0.0, **RUBBER),
        lambda: HertzContact(12.7, 0.7),
        lambda: HertzContact(0.0, 0.46),
    ],
)
def test_impossible_input_is_refused(call):
    with pytest.raises(InputError):
        call()
