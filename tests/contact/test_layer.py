"""Frictionless contact on the bonded layer, against printed numbers, limits and brute-force mode sums."""

import numpy as np
import pytest
from scipy.special import jv

from bayestouch.body.finger import surface_displacement_response
from bayestouch.contact import LayerContact, composite_radius
from bayestouch.contact.chebyshev import bessel_over_argument, pressure_shapes, shape_transforms
from bayestouch.contact.compliance import SurfaceCompliance
from bayestouch.contact.hertz import elliptic_spectrum
from bayestouch.contact.hertz import half_width as hertz_half_width
from bayestouch.contact.table import collocation_places
from bayestouch.errors import InputError

PAPER = (9.4, 12.7, 0.46)
SHALLOW = (11.43, 12.7, 0.48)
RADII = np.array([0.5, 3.9, 12.3, 25.25, np.inf])


@pytest.fixture(scope="module")
def layer():
    return LayerContact.for_body(*PAPER)


def displacement(modes, body):
    core, outer, sigma = body
    return surface_displacement_response(modes, core_radius_mm=core, outer_radius_mm=outer, poisson_ratio=sigma)


@pytest.mark.parametrize(
    ("modulus", "half_widths", "centre_pressures"),
    [
        (0.3, [0.3307, 0.8097, 1.1490, 1.3203, 1.5854], [0.38500, 0.15731, 0.11096, 0.09664, 0.08062]),
        (0.05, [0.7969, 1.8411, 2.5004, 2.8159, 3.2883], [0.15984, 0.06960, 0.05176, 0.04625, 0.04003]),
    ],
)
def test_physics_table(layer, modulus, half_widths, centre_pressures):
    """Every half-width and centre pressure of the physics page to the last digit (finite elements: 5e-4)."""
    kappa = 0.2 * composite_radius(RADII, 12.7) / modulus
    np.testing.assert_allclose(layer.half_width(kappa), half_widths, rtol=0, atol=5.1e-5)
    np.testing.assert_allclose(
        layer.pressure(kappa, [0.0], load_N_per_mm=0.2)[..., 0], centre_pressures, rtol=0, atol=5.1e-6
    )


@pytest.mark.parametrize("body", [PAPER, SHALLOW, (9.4, 12.7, 0.5), (9.4, 12.7, 0.3)])
@pytest.mark.parametrize("kappa", [0.32, 8.5, 50.0])
def test_brute_force_mode_sum(body, kappa):
    """The slope equation inside and no pressure outside, from nothing but q_k and U_k.

    Up to 190,000 modes (5000/β), tapered by cos² over the upper half so that what is cut off interferes away:
    its part of the sum falls like the third power of distance to the edge x modes, which is at least 150, and
    is below the collocation error.
    """
    contact = LayerContact.for_body(*body)
    outer = body[1]
    count = int(5000 / contact.half_angle(kappa))
    modes = np.arange(count + 1)
    spectrum = contact.spectrum(kappa, modes)
    assert spectrum[0] == pytest.approx(1, abs=1e-14)
    spectrum = spectrum * np.cos(np.pi / 2 * np.clip(2 * modes / count - 1, 0, 1)) ** 2
    beta = float(contact.half_angle(kappa))
    theta = beta * np.array([0.0, 0.1, 0.35, 0.6, 0.8, 0.9, 0.97])
    phase = np.outer(theta, modes)
    # du_r/ds = P/(π r_b² μ) Σ k U_k q_k sin kθ = r_b θ/R
    slope = np.sin(phase) @ (modes * displacement(modes, body) * spectrum)
    wanted = np.pi * outer**3 * theta / kappa
    np.testing.assert_allclose(slope, wanted, rtol=0, atol=1e-5 * np.pi * outer**3 * beta / kappa)
    # p = P/(2π r_b) [q_0 + 2 Σ q_k cos kθ]
    pressure = (2 * np.cos(phase) @ spectrum - 1) / (2 * np.pi * outer)
    direct = contact.pressure(kappa, theta, load_N_per_mm=1.0)
    np.testing.assert_allclose(pressure, direct, rtol=0, atol=1e-6 * direct[0])
    beyond = beta + np.array([0.03 * beta, 0.1 * beta, 0.5, 1.0, np.pi - beta])
    outside = (2 * np.cos(np.outer(beyond, modes)) @ spectrum - 1) / (2 * np.pi * outer)
    np.testing.assert_allclose(outside, 0, atol=1e-6 * direct[0])
    assert np.all(contact.pressure(kappa, beyond, load_N_per_mm=1.0) == 0)


def solved(body, beta, terms, modes=4000):
    compliance = SurfaceCompliance.for_body(*body, modes=modes)
    places = collocation_places(terms)
    return np.linalg.solve(compliance.slope([beta], places, terms)[0], beta * places)


def slope_residual(body, beta, coefficients, modes=4000):
    """Largest error of the slope relative to its value at the edge, between the collocation places too."""
    t = np.linspace(0.003, 0.9999, 400)
    built = SurfaceCompliance.for_body(*body, modes=modes).slope([beta], t, len(coefficients))[0] @ coefficients
    return np.max(np.abs(built / beta - t)), np.sqrt(np.mean((built / beta - t) ** 2))


@pytest.mark.parametrize("beta", [0.03, 0.1, 0.26])
def test_eight_terms_solve_the_slope_equation(beta):
    largest, rms = slope_residual(PAPER, beta, solved(PAPER, beta, 8))
    assert rms < 2.0e-6
    assert largest < 6e-6  # next to the edge, where the curvature term's square root is hardest
    if beta <= 0.1:
        assert rms < 1e-6


def test_convergence_in_terms():
    """Slope error falls at least like M^-2.5 (theory: M^-3), the load much faster."""
    terms = np.array([6, 12, 24, 48])
    error = [slope_residual(PAPER, 0.26, solved(PAPER, 0.26, m))[0] for m in terms]
    rate = -np.polyfit(np.log(terms), np.log(error), 1)[0]
    assert 2.5 < rate < 4
    loads = [solved(PAPER, 0.26, m)[0] for m in (8, 16, 60)]
    assert abs(loads[0] / loads[2] - 1) < 3e-7
    assert abs(loads[1] / loads[2] - 1) < 5e-8


@pytest.mark.parametrize("beta", [0.01, 0.1, 1.0])
def test_convergence_in_modes(beta):
    """The remainder falls like k^-2 against q_k ~ k^-1.5: doubling the modes gains a factor of 4 or more."""
    load = {m: solved(PAPER, beta, 12, modes=m)[0] for m in (100, 200, 400, 12_800)}
    error = [abs(load[m] / load[12_800] - 1) for m in (100, 200, 400)]
    assert error[2] < 1e-6  # the default
    assert error[0] < 3e-5
    assert error[2] < error[0] / 10 or error[0] < 1e-8


def test_default_terms_follow_the_layers_thickness():
    for body in (PAPER, SHALLOW, (12.3, 12.7, 0.48)):
        contact = LayerContact.for_body(*body)
        finer = LayerContact.for_body(*body, terms=2 * contact.coefficients.shape[1])
        np.testing.assert_allclose(contact.kappas[1:], finer.kappas[1:], rtol=1e-5)


def test_split_of_the_compliance_is_the_discs():
    """k U_k - A - B/k is O(1/k²) once the bond is out of sight: the disc's constants are the right ones."""
    for sigma in (0.2, 0.46, 0.5):
        remainder = SurfaceCompliance.for_body(9.4, 12.7, sigma, modes=2000).remainder_mm
        k = np.arange(1, 2001)
        np.testing.assert_allclose((remainder * k**2)[200:], (1 - sigma) * 12.7, rtol=0.01)


def test_small_contacts_go_to_hertz():
    """a/a_Hertz → 1, and the first correction is that of the finger's roundness alone:

    kappa/kappa_Hertz = 1 + 4 (1-2σ)/(3π (1-σ)) β, from the curvature term by perturbation.
    """
    for core in (9.4, 6.0):
        contact = LayerContact.for_body(core, 12.7, 0.3)
        kappa = np.array([2e-3, 1e-2, 4e-2])
        beta = contact.half_angle(kappa)
        ratio = (hertz_half_width(kappa, 0.3) / (12.7 * beta)) ** 2
        expected = 1 + 4 * (1 - 0.6) / (3 * np.pi * 0.7) * beta
        np.testing.assert_allclose(ratio, expected, rtol=0, atol=15 * np.max(beta) ** 2)
    assert contact.half_angle(0.0) == 0
    np.testing.assert_array_equal(contact.spectrum(0.0, [0, 5, 100]), 1)


def test_thick_layer_is_hertz_and_thin_layer_is_narrower():
    """An incompressible disc has no curvature term, so a thick layer leaves Hertz by β² only (times the
    logarithm of the core's radius, of a disc that gives way as a whole); the bond narrows the contact by more
    the nearer it is.
    """
    kappa = np.geomspace(1e-2, 20, 30)
    hertz = hertz_half_width(kappa, 0.5)
    beta = hertz / 12.7
    modes = np.arange(60)
    previous = np.full_like(kappa, np.inf)
    for core in (0.5, 2.0, 6.0, 9.4, 11.43, 12.2):
        contact = LayerContact.for_body(core, 12.7, 0.5)
        width = contact.half_width(kappa)
        assert np.all(width < previous)
        previous = width
        if core <= 6:
            assert np.all(np.abs(width / hertz - 1) < 2 * beta**2)
            ellipse = elliptic_spectrum(beta, modes)
            assert np.all(np.abs(contact.spectrum(kappa, modes) - ellipse) < 2 * beta[:, None] ** 2)
    assert width[-1] < 0.5 * hertz[-1]


def test_pressure_is_a_pressure(layer):
    kappa = np.geomspace(1e-4, layer.kappas[-1] * (1 - 1e-9), 40)
    beta = layer.half_angle(kappa)
    assert np.all(np.diff(beta) > 0)
    # Gauss-Chebyshev nodes: sum is exact for the load and the spectrum's low modes
    psi = (np.arange(400) + 0.5) * np.pi / 400
    for k, b in zip(kappa, beta, strict=True):
        theta = b * np.cos(psi)
        pressure = layer.pressure(k, theta, load_N_per_mm=0.2)
        assert np.all(pressure > 0)
        np.testing.assert_allclose(pressure, pressure[::-1], rtol=1e-9)
        weight = 12.7 * b * np.sin(psi) * np.pi / 400
        # midpoint rule in ψ for sin² ψ x polynomial: exact
        assert np.sum(pressure * weight) == pytest.approx(0.2, rel=1e-12)
        for mode in (3, 20):
            moment = np.sum(pressure * np.cos(mode * theta) * weight) / 0.2
            assert layer.spectrum(k, [mode])[0] == pytest.approx(moment, abs=1e-12)


def test_everything_depends_on_load_radius_and_modulus_through_kappa_alone(layer):
    theta = np.linspace(-0.2, 0.2, 41)
    one = layer.pressure(0.2 * 3.0 / 0.3, theta, load_N_per_mm=0.2)
    other = layer.pressure(0.4 * 3.0 / 0.6, theta, load_N_per_mm=0.4)
    np.testing.assert_allclose(other, 2 * one, rtol=1e-12)


def test_interpolation_error(layer):
    """96 knots against 1536: what the table adds to half-widths and spectra."""
    fine = LayerContact.for_body(*PAPER, knots=1536)
    kappa = np.geomspace(1e-4, layer.kappas[-1] * (1 - 1e-9), 2000)
    np.testing.assert_allclose(layer.half_width(kappa), fine.half_width(kappa), rtol=1e-7)
    modes = np.arange(0, 151, 5)
    np.testing.assert_allclose(layer.spectrum(kappa, modes), fine.spectrum(kappa, modes), rtol=0, atol=1e-6)


def test_shapes_of_arrays(layer):
    assert layer.half_width(1.0).shape == ()
    assert layer.spectrum(1.0, [0, 1]).shape == (2,)
    assert layer.spectrum(np.ones((3, 2)), np.arange(7)).shape == (3, 2, 7)
    assert layer.pressure(np.ones(3), np.zeros(5), load_N_per_mm=[1.0, 2.0, 3.0]).shape == (3, 5)


def test_bessel_recurrence_and_transforms():
    z = np.concatenate([[0.0, 1e-12, 1e-4], np.linspace(0.01, 300, 4001)])
    ours = bessel_over_argument(z, 47)
    exact = np.stack([jv(n, z[1:]) / z[1:] for n in range(1, 48)], axis=-1)
    np.testing.assert_allclose(ours[1:], exact, rtol=0, atol=1e-14)
    np.testing.assert_array_equal(ours[0], np.r_[0.5, np.zeros(46)])
    psi = (np.arange(400) + 0.5) * np.pi / 400
    for argument in (0.0, 3.3, 60.0):
        weighted = pressure_shapes(np.cos(psi), 10) * (np.cos(argument * np.cos(psi)) * np.sin(psi))[:, None]
        np.testing.assert_allclose(shape_transforms(argument, 10), weighted.sum(axis=0) * np.pi / 400, atol=1e-12)


@pytest.mark.parametrize(
    "call",
    [
        lambda c: c.half_width(-1.0),
        lambda c: c.half_width(np.nan),
        lambda c: c.half_width(c.kappas[-1] * 1.001),
        lambda c: c.spectrum([1.0, np.inf], [0, 1]),
        lambda c: c.pressure(0.0, [0.0], load_N_per_mm=1.0),
        lambda c: LayerContact.for_body(12.7, 9.4, 0.46),
        lambda c: LayerContact.for_body(0.0, 9.4, 0.46),
        lambda c: LayerContact.for_body(9.4, 12.7, 0.51),
        lambda c: LayerContact.for_body(9.4, 12.7, 0.46, largest_half_angle=2.0),
    ],
)
def test_impossible_input_is_refused(layer, call):
    with pytest.raises(InputError) as error:
        call(layer)
    assert "\n" not in str(error.value)
