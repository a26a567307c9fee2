"""The corner on half-plane and layer."""

import numpy as np
import pytest
from scipy.integrate import quad

from bayestouch.body.finger import surface_displacement_response
from bayestouch.contact import CornerContact, LayerContact
from bayestouch.contact.compliance import wedge_transform
from bayestouch.contact.corner import half_plane_half_width
from bayestouch.contact.hertz import elliptic_spectrum
from bayestouch.errors import InputError

PAPER = (9.4, 12.7, 0.46)
FINGER = {"face_slope": 1.0, "outer_radius_mm": 12.7, "poisson_ratio": 0.46}
MODES = np.arange(151)


def half_plane_spectrum(load):
    """Spectrum of the corner on a round finger taken as a half-plane: a wedge's and a Hertz pressure."""
    width = half_plane_half_width(load, **FINGER)[..., np.newaxis]
    wedge, ellipse = 2 * FINGER["face_slope"], np.pi * width / (2 * 12.7)
    spectra = wedge_transform(width / 12.7 * MODES), elliptic_spectrum(width[..., 0] / 12.7, MODES)
    return (wedge * spectra[0] + ellipse * spectra[1]) / (wedge + ellipse)


@pytest.fixture(scope="module")
def corner():
    return CornerContact.for_body(*PAPER)


def test_wedge_transform_is_that_of_its_pressure():
    for z in (0.0, 0.3, 4.0, 40.0):
        # arccosh(1/t) by t = 1/cosh u: integrable, smooth
        direct = quad(lambda u, z=z: u * np.cos(z / np.cosh(u)) * np.sinh(u) / np.cosh(u) ** 2, 0, 60, limit=400)[0]
        assert wedge_transform(z) == pytest.approx(2 / np.pi * direct, abs=1e-9)


def test_johnsons_wedge():
    """P = E* a cot α with E* = 2μ/(1-σ), for loads so small that the finger's roundness does not show."""
    width = half_plane_half_width(1e-6, **FINGER)
    assert width == pytest.approx(1e-6 * 0.54 / 2, rel=1e-6)


@pytest.mark.parametrize("load", [0.1, 2 / 3, 4.0])
@pytest.mark.parametrize("face_slope", [0.3, 1.0])
def test_brute_force_mode_sum(load, face_slope):
    """Faces plus finger curvature within the contact, from q_k and U_k alone; nothing outside.

    Taper as in the layer's test. The tolerance is the collocation error, which near the tip is 1e-4.
    """
    contact = CornerContact.for_body(*PAPER, face_slope=face_slope)
    beta = float(contact.half_angle(load))
    count = int(2000 / beta)
    modes = np.arange(count + 1)
    spectrum = contact.spectrum(load, modes)
    assert spectrum[0] == pytest.approx(1, abs=1e-12)
    spectrum = spectrum * np.cos(np.pi / 2 * np.clip(2 * modes / count - 1, 0, 1)) ** 2
    response = surface_displacement_response(
        modes, core_radius_mm=PAPER[0], outer_radius_mm=PAPER[1], poisson_ratio=PAPER[2]
    )
    theta = beta * np.array([0.05, 0.2, 0.5, 0.8, 0.95])
    slope = load / (np.pi * 12.7**2) * np.sin(np.outer(theta, modes)) @ (modes * response * spectrum)
    wanted = face_slope + theta
    np.testing.assert_allclose(slope, wanted, rtol=0, atol=1e-4 * wanted[-1])
    beyond = np.array([1.05 * beta, 1.5 * beta, 1.0, np.pi])
    outside = 2 * np.cos(np.outer(beyond, modes)) @ spectrum - 1
    np.testing.assert_allclose(outside, 0, atol=1e-5 / beta)  # mean pressure is of order 1/β in this unit


def test_small_loads_go_to_the_half_plane(corner):
    """First correction: the curvature term by perturbation, as for the parabola; next the layer's β²."""
    load = np.array([0.0, 1e-3, 1e-2, 0.1])
    widths = half_plane_half_width(load, **FINGER)
    beta = widths / 12.7
    moment = 2 + 2 * quad(lambda psi: np.sin(psi) ** 2 * np.arccosh(1 / np.sin(psi)), 0, np.pi / 2)[0]
    expected = widths * (1 - (1 - 2 * 0.46) / (2 * 0.54 * np.pi) * moment * beta)
    # the layer narrows a parabola's contact by 5 β² at this core; twice that, and more, for the wedge
    np.testing.assert_allclose(corner.half_width(load), expected, rtol=15 * beta[-1] ** 2, atol=1e-15)
    difference = np.abs(corner.spectrum(load, MODES) - half_plane_spectrum(load)).max(axis=1)
    assert np.all(difference < [1e-14, 1e-7, 1e-5, 1e-3])


def test_layer_narrows_the_corner(corner):
    load = np.linspace(0.2, 50, 40)
    assert np.all(corner.half_width(load) < half_plane_half_width(load, **FINGER))
    assert np.all(np.diff(corner.half_width(load)) > 0)


def test_blunt_corner_is_a_flat():
    """Faces of slope → 0 leave the finger's curvature alone: the flat of the layer's table."""
    blunt = CornerContact.for_body(*PAPER, face_slope=1e-7)
    layer = LayerContact.for_body(*PAPER)
    load = np.array([0.3, 2.0, 8.0])
    np.testing.assert_allclose(blunt.half_width(load), layer.half_width(load * 12.7), rtol=1e-5)
    np.testing.assert_allclose(blunt.spectrum(load, MODES), layer.spectrum(load * 12.7, MODES), atol=1e-5)


def test_terms_and_knots(corner):
    fine = CornerContact.for_body(*PAPER, terms=20, knots=500)
    load = np.linspace(0, 4, 101)
    np.testing.assert_allclose(corner.half_width(load), fine.half_width(load), atol=2e-6)
    np.testing.assert_allclose(corner.spectrum(load, MODES), fine.spectrum(load, MODES), atol=1e-5)


@pytest.mark.parametrize(
    "call",
    [
        lambda c: c.half_width(-1.0),
        lambda c: c.half_width(1e4),
        lambda c: c.spectrum(np.nan, [0]),
        lambda c: CornerContact.for_body(*PAPER, face_slope=0.0),
    ],
)
def test_impossible_input_is_refused(corner, call):
    with pytest.raises(InputError):
        call(corner)
