"""The annulus and the contact on it against finite elements that share no code with them."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest
from fem_oracle import Body, ContactCurve, graded, through_gauss_points

from bayestouch.body.finger import radial_strain_response, surface_displacement_response
from bayestouch.contact.layer import LayerContact

CORE, OUTER, POISSON = 9.4, 12.7, 0.46
RADII = [9.5, 9.9, 10.3, 10.7]
PEAKS = [-0.02922, -0.05857, -0.07865, -0.09785]  # e_rr below a line load P/μ = 1 mm
FINGER = {"core_radius_mm": CORE, "outer_radius_mm": OUTER, "poisson_ratio": POISSON}


@lru_cache(maxsize=3)
def _annulus(spacing: float) -> tuple[Body, np.ndarray]:
    """Half annulus with elements of `spacing` mm near the load, and its displacement under P/μ = 1 mm."""
    lateral = graded(np.pi, spacing / OUTER, 1.03, 0.04)
    body = Body("annulus", lateral, through_gauss_points(CORE, OUTER, spacing, RADII), POISSON)
    return body, body.solve(body.line_load())


def _line_load_series(radius: float, theta: np.ndarray, n_modes: int = 400) -> np.ndarray:
    response = radial_strain_response(np.arange(n_modes), radius, **FINGER)
    series = response[0] + 2 * np.cos(np.outer(theta, np.arange(1, n_modes))) @ response[1:]
    return -series / (2 * np.pi * OUTER)


@pytest.mark.parametrize(("radius", "peak"), list(zip(RADII, PEAKS, strict=True)))
def test_line_load_strain_profile(radius: float, peak: float) -> None:
    theta = np.linspace(0, np.pi, 361)
    series = _line_load_series(radius, theta)
    assert series[0] == pytest.approx(peak, abs=0.5e-5)
    body, u = _annulus(0.06)
    # The elements' own error is 2.5e-5 of the peak at 9.5 mm and less elsewhere (third order, next test).
    assert np.abs(body.normal_strain(u, theta, radius) - series).max() < 1e-4 * np.abs(series).max()


@pytest.mark.parametrize("radius", RADII)
def test_finite_elements_converge_to_the_series(radius: float) -> None:
    theta = np.linspace(0, np.pi, 181)
    series = _line_load_series(radius, theta)
    errors = []
    for spacing in (0.24, 0.12, 0.06):
        body, u = _annulus(spacing)
        errors.append(np.abs(body.normal_strain(u, theta, radius) - series).max())
    rates = np.log2(np.divide(errors[:-1], errors[1:]))
    # Strains of quadratic elements at Gauss points are of third order; a wrong series would leave an error.
    assert np.all(rates > 2.5), (errors, rates)


@pytest.mark.parametrize("mode", [0, 1, 2, 7, 15])
def test_single_modes(mode: int) -> None:
    theta = np.linspace(0, np.pi, 37)
    strain = radial_strain_response([mode], 10.3, **FINGER) * np.cos(mode * theta)
    surface = surface_displacement_response([mode], **FINGER) * np.cos(mode * theta)
    errors = []
    for n in (1, 2):
        lateral = np.linspace(0, np.pi, 60 * n + 1)
        body = Body("annulus", lateral, through_gauss_points(CORE, OUTER, 0.25 / n, [10.3]), POISSON)
        u = body.solve(body.pressure_load(lambda x: -np.cos(mode * x)))
        errors.append(
            [
                np.abs(body.surface_displacement(u, theta) - surface).max() / np.abs(surface).max(),
                np.abs(body.normal_strain(u, theta, 10.3) - strain).max() / np.abs(strain).max(),
            ]
        )
    # Third order in elements of 0.25 mm by 3°, of which mode 15 has four a half-wave; rounding below 1e-7.
    assert np.all(np.log2(np.divide(errors[0], errors[1])) > 2.5) or np.max(errors) < 1e-6, errors
    assert np.max(errors[1]) < 1e-3


# Half-width of the contact, mm, for P = 0.2 N/mm: indenter radius, at μ = 0.3 and 0.05 MPa.
HALF_WIDTHS = [
    (0.5, 0.3307, 0.7969),
    (3.9, 0.8097, 1.8411),
    (12.3, 1.1490, 2.5004),
    (25.25, 1.3203, 2.8159),
    (np.inf, 1.5854, 3.2883),
]


@lru_cache(maxsize=1)
def _curve() -> ContactCurve:
    return ContactCurve.for_annulus(CORE, OUTER, POISSON, range_mm=(0.28, 3.6))


@pytest.mark.slow
@pytest.mark.parametrize(("indenter_radius", "stiff", "soft"), HALF_WIDTHS)
def test_contact_half_width(indenter_radius: float, stiff: float, soft: float) -> None:
    radius = 1 / (1 / OUTER + 1 / indenter_radius)
    contact = LayerContact.for_body(CORE, OUTER, POISSON)
    for modulus, printed in ((0.3, stiff), (0.05, soft)):
        fem = _curve().half_width(0.2 / modulus, radius)
        # Edge elements of a/1000 leave 5e-4 mm at most, and falling with them (slow test below).
        assert fem == pytest.approx(printed, abs=1e-3)
        assert float(contact.half_width(0.2 / modulus * radius)) == pytest.approx(fem, abs=1e-3)


@pytest.mark.parametrize("half_width", [0.8, 2.4])
def test_contact_pressure_makes_the_surface_follow_the_indenter(half_width: float) -> None:
    """The package's pressure, put on the finite elements, displaces the surface to a parabola."""
    contact = LayerContact.for_body(CORE, OUTER, POISSON)
    kappa = np.interp(half_width, OUTER * contact.half_angles, contact.kappas)
    beta = float(contact.half_angle(kappa))
    inside = beta - graded(beta, 2e-3 * beta, 1.4, beta / 8)
    outside = beta + graded(np.pi - beta, 2e-3 * beta, 1.4, 0.06)
    lateral = np.union1d(np.maximum(inside, 0), outside)
    normal = OUTER - graded(OUTER - CORE, 0.01 * beta * OUTER, 1.4, 0.2)
    body = Body("annulus", lateral, normal, POISSON)

    def pressure(x: np.ndarray) -> np.ndarray:
        return contact.pressure(kappa, x.ravel(), load_N_per_mm=kappa).reshape(x.shape)

    u = body.solve(body.pressure_load(pressure))
    theta = np.linspace(0, 1.3 * beta, 105)
    gap = body.surface_displacement(u, theta) - (OUTER * theta) ** 2 / 2  # load κ means R = μ = 1
    gap -= gap[0]
    touching = theta <= beta
    # Relative to the sagitta: elements of 0.002 β at the edge resolve the square-root end of the pressure.
    assert np.abs(gap[touching]).max() < 5e-4 * half_width**2 / 2
    assert gap[-1] < -1e-2 * half_width**2 / 2


@pytest.mark.slow
def test_contact_half_width_converges_with_the_edge_elements() -> None:
    radius = OUTER  # a flat
    contact = LayerContact.for_body(CORE, OUTER, POISSON)
    errors = []
    for spacing in (1e-2, 3e-3, 1e-3):
        curve = ContactCurve.for_annulus(CORE, OUTER, POISSON, range_mm=(0.9, 3.6), edge_spacing=spacing, ratio=1.25)
        errors.append(curve.half_width(0.2 / 0.3, radius) - float(contact.half_width(0.2 / 0.3 * radius)))
    # First order in the size of the elements at the singular edge, all from one side.
    ratios = np.divide(errors[:-1], errors[1:])
    assert np.all(np.array(errors) < 0)
    assert np.all(np.log(ratios) / np.log(10 / 3) > 0.6), (errors, ratios)
    # Elements without size, extrapolated from the last two (Richardson): 1e-4 mm from the package.
    assert abs(errors[-1] - (errors[-2] - errors[-1]) / (ratios[-1] - 1)) < 1e-4, errors
