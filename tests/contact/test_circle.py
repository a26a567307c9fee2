"""Contact of true circles, for indenters that are small against their contact."""

import numpy as np
import pytest

from bayestouch.body.finger import surface_displacement_response
from bayestouch.contact import CircleContact, LayerContact, composite_radius
from bayestouch.contact.circle import circle_slope
from bayestouch.errors import InputError

PAPER = (9.4, 12.7, 0.46)
STIFF, SOFT = 0.2 / 0.3, 0.2 / 0.05  # P/μ in mm
MODES = np.arange(151)


@pytest.fixture(scope="module")
def layer():
    return LayerContact.for_body(*PAPER)


@pytest.mark.parametrize("radius", [0.5, 3.9, 25.25, np.inf, -30.0])
def test_slope_is_that_of_two_circles(radius):
    """Against numerical derivatives of a ray's length from the finger's centre to the indenter."""
    outer = 12.7
    theta = np.linspace(-0.03, 0.03, 13)

    def ray(angle):
        if np.isinf(radius):
            return outer / np.cos(angle)
        centre = outer + radius
        root = np.sqrt(radius**2 - (centre * np.sin(angle)) ** 2)
        return centre * np.cos(angle) - np.sign(radius) * root

    step = 1e-5
    numeric = (ray(theta + step) - ray(theta - step)) / (2 * step * outer)
    ratio = outer / composite_radius(radius, outer)
    # central differences: h²/6 times a third derivative of order (g³), plus rounding ε/h
    np.testing.assert_allclose(circle_slope(theta, ratio), numeric, atol=1e-9 * ratio**5 + 1e-10)
    np.testing.assert_allclose(circle_slope(1e-6, ratio), ratio * 1e-6, rtol=1e-9)


def test_physics_page(layer):
    """9 % narrower at r_c = 0.5 mm and μ = 0.3 MPa; 2 % or less from 3.9 mm up."""
    radii = np.array([0.5, 3.9, 6.01, 12.3, 25.25, np.inf])
    circle = layer.circle.half_width(STIFF, radii)
    parabola = layer.half_width(STIFF * composite_radius(radii, 12.7))
    change = 1 - circle / parabola
    assert round(100 * change[0]) == 9
    assert np.all((change[1:] > 0) & (change[1:] < 0.02))


@pytest.mark.parametrize(("load", "radius"), [(STIFF, 0.5), (STIFF, 3.9), (SOFT, 1.59), (SOFT, np.inf)])
def test_brute_force_mode_sum(layer, load, radius):
    """The circle's slope equation from q_k and U_k alone; taper and truncation as in the layer's test."""
    beta = float(layer.circle.half_angle(load, radius))
    count = int(5000 / beta)
    modes = np.arange(count + 1)
    spectrum = layer.circle.spectrum(load, radius, modes)
    spectrum = spectrum * np.cos(np.pi / 2 * np.clip(2 * modes / count - 1, 0, 1)) ** 2
    response = surface_displacement_response(
        modes, core_radius_mm=PAPER[0], outer_radius_mm=PAPER[1], poisson_ratio=PAPER[2]
    )
    theta = beta * np.array([0.1, 0.4, 0.7, 0.9, 0.97])
    slope = load / (np.pi * 12.7**2) * np.sin(np.outer(theta, modes)) @ (modes * response * spectrum)
    wanted = circle_slope(theta, 12.7 / composite_radius(radius, 12.7))
    np.testing.assert_allclose(slope, wanted, rtol=0, atol=1e-5 * wanted[-1])


def test_half_angle_carries_the_load(layer):
    """Round trip for many loads and radii at once, small loads included."""
    load = np.geomspace(1e-4, 3, 25)[:, None]
    radius = np.array([0.5, 1.59, 12.3, np.inf, -40.0, -20.0])  # the last two are hollows
    beta = layer.circle.half_angle(load, radius)
    assert beta.shape == (25, 6)
    assert np.all(np.diff(beta, axis=0) > 0)
    assert np.all(np.diff(beta, axis=1) > 0)
    spectrum = layer.circle.spectrum(load, radius, [0, 1])
    np.testing.assert_allclose(spectrum[..., 0], 1, atol=1e-12)
    # A contact much smaller than indenter and finger is the parabola's, up to (a/r)² times 0.2 for a small
    # tip, 1 where the curvatures of both circles count.
    parabola = layer.half_angle(load * composite_radius(radius, 12.7))
    tip = np.minimum(np.abs(radius), 12.7)
    assert np.all(np.abs(beta / parabola - 1) < 1.2 * (12.7 * parabola / tip) ** 2)


def test_knife_edge_and_no_load(layer):
    np.testing.assert_allclose(layer.circle.spectrum([STIFF, SOFT], 0.0, MODES), 1, atol=1e-12)
    assert layer.circle.half_width(0.0, 3.9) == pytest.approx(0, abs=1e-12)
    np.testing.assert_allclose(layer.circle.spectrum(0.0, 3.9, MODES), 1, atol=1e-12)
    np.testing.assert_allclose(layer.equivalent_kappa([STIFF, 0.0], [0.0, 3.9]), 0, atol=1e-12)


def test_contact_never_passes_the_quarter_circle(layer):
    width = layer.circle.half_width(np.geomspace(1, 500, 20), 0.5)
    assert np.all(np.diff(width) >= 0)
    assert np.all(np.sin(width / 12.7) * (12.7 + 0.5) < 0.5)


def test_convergence_in_terms_and_knots(layer):
    """24 terms: 1e-6 up to a/r_c = 0.6; 1e-3 of q_k near the quarter circle, where the slope is singular."""
    fine = CircleContact.for_body(*PAPER, terms=48, knots=400)
    for load, radius, tolerance in [
        (STIFF, 0.5, 1e-6),
        (STIFF, 12.3, 1e-6),
        (SOFT, 3.9, 1e-6),
        (SOFT, 1.0, 1e-5),
        (SOFT, 0.5, 1e-3),
    ]:
        ours, exact = (c.spectrum(load, radius, MODES) for c in (layer.circle, fine))
        np.testing.assert_allclose(ours, exact, rtol=0, atol=tolerance)
        widths = [float(c.half_width(load, radius)) for c in (layer.circle, fine)]
        assert widths[0] == pytest.approx(widths[1], rel=tolerance)


@pytest.mark.parametrize(
    ("load", "radius", "low", "high"),
    [
        (STIFF, 0.5, 6e-5, 2e-2),
        (STIFF, 3.9, 4e-4, 5e-3),
        (STIFF, np.inf, 8e-4, 1.5e-3),
        (SOFT, 0.5, 3e-3, 2e-1),
        (SOFT, 3.9, 1.6e-2, 2e-2),
        (SOFT, np.inf, 4e-3, 4e-3),
    ],
)
def test_equivalent_parabola(layer, load, radius, low, high):
    """How near one table comes (numbers in `bayestouch.contact.circle`): nearer than by P R/μ or width."""
    exact = layer.circle.spectrum(load, radius, MODES)
    kappa = layer.equivalent_kappa(load, radius)
    error = np.abs(layer.spectrum(kappa, MODES) - exact)
    assert error[:31].max() < low
    assert error.max() < high
    width = layer.circle.half_width(load, radius)
    grid = np.geomspace(kappa / 4, kappa * 4, 4001)
    same_width = grid[np.argmin(np.abs(layer.half_width(grid) - width))]
    for other in (same_width, load * composite_radius(radius, 12.7)):
        worse = np.abs(layer.spectrum(other, MODES) - exact)
        assert worse[:31].max() > error[:31].max()
        assert worse.max() > error.max()


@pytest.mark.parametrize(
    "arguments", [(-1.0, 3.9), (np.nan, 3.9), (1.0, -1.0), (1.0, -12.7), (1.0, np.nan), (1e6, np.inf)]
)
def test_impossible_input_is_refused(layer, arguments):
    with pytest.raises(InputError):
        layer.circle.half_angle(*arguments)
