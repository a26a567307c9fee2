"""The bonded annulus against tabulated values, its own equations, Betti's theorem and its limits."""

from __future__ import annotations

import numpy as np
import pytest

from bayestouch.body.annulus import solve_annulus
from bayestouch.body.finger import radial_strain_response, surface_displacement_response
from bayestouch.errors import InputError

FINGER = {"core_radius_mm": 9.4, "outer_radius_mm": 12.7, "poisson_ratio": 0.46}

# Mode k: e_rr at r = 9.5, 9.9, 10.7 mm and u_r(r_b) in mm, unit traction, μ = 1 MPa.
TABLE = {
    0: (0.07583858, 0.07286806, 0.06789520, 0.22005645),
    1: (0.07792086, 0.08539014, 0.09312645, 0.29815262),
    2: (0.08214425, 0.11048738, 0.14163677, 0.44248462),
    5: (0.08978263, 0.16782027, 0.23761632, 0.67523262),
    10: (0.06354410, 0.14725101, 0.22297318, 0.61740961),
    20: (0.00953883, 0.02664195, 0.07039330, 0.34217545),
    30: (0.00091312, 0.00309535, 0.01826490, 0.22828814),
}


def test_checked_figures() -> None:
    modes = list(TABLE)
    strain = radial_strain_response(modes, [9.5, 9.9, 10.7], **FINGER)
    displacement = surface_displacement_response(modes, **FINGER)
    expected = np.array(list(TABLE.values()))
    # Half a unit of the last printed digit.
    np.testing.assert_allclose(strain.T, expected[:, :3], rtol=0, atol=5.1e-9)
    np.testing.assert_allclose(displacement, expected[:, 3], rtol=0, atol=5.1e-9)


def _collocation(
    modes: np.ndarray, radius: np.ndarray, alpha: float, sigma: float, traction: str
) -> tuple[np.ndarray, ...]:
    """Navier's equations of each mode by Chebyshev collocation in r: an independent way to e_rr, u_r and u_θ.

    ``u_r = u(r) cos kθ``, ``u_θ = v(r) sin kθ``, λ/μ = 2σ/(1-2σ), μ = 1, r_b = 1.
    Returns e_rr (n_radius, n_modes) and the surface displacements (n_modes, 2).
    """
    n = 40  # sub-intervals of the Chebyshev grid
    nodes = np.cos(np.pi * np.arange(n + 1) / n)
    weights = np.r_[2, np.ones(n - 1), 2] * (-1.0) ** np.arange(n + 1)
    difference = nodes[:, None] - nodes[None] + np.eye(n + 1)
    derivative = np.outer(weights, 1 / weights) / difference
    derivative -= np.diag(derivative.sum(axis=1))
    r = alpha + (1 - alpha) * (nodes + 1) / 2
    d_r = derivative * 2 / (1 - alpha)
    inv = np.diag(1 / r)
    lame, eye = 2 * sigma / (1 - 2 * sigma), np.eye(n + 1)
    strain, surface = [], []
    for k in modes:
        # Operators on the stacked nodal values of (u, v).
        dilatation = np.hstack([d_r + inv, k * inv])
        e_rr = np.hstack([d_r, 0 * eye])
        e_tt = np.hstack([inv, k * inv])
        shear = np.hstack([-k * inv, d_r - inv])  # 2 e_rθ
        s_rr, s_tt, s_rt = lame * dilatation + 2 * e_rr, lame * dilatation + 2 * e_tt, shear
        radial = d_r @ s_rr + inv @ (k * s_rt + s_rr - s_tt)
        hoop = d_r @ s_rt + inv @ (2 * s_rt - k * s_tt)
        matrix = np.vstack([radial, hoop])
        right = np.zeros(2 * n + 2)
        matrix[[0, n + 1]] = np.vstack([s_rr[0], s_rt[0]])  # node 0 is the surface
        right[[0, n + 1]] = (1, 0) if traction == "normal" else (0, 1)
        matrix[[n, 2 * n + 1]] = np.eye(2 * n + 2)[[n, 2 * n + 1]]  # node n is the core
        u = np.linalg.solve(matrix, right)
        # Barycentric interpolation of du/dr to the radii asked for.
        slope = d_r @ u[: n + 1]
        bary = (-1.0) ** np.arange(n + 1) * np.r_[0.5, np.ones(n - 1), 0.5]
        kernel = bary / (radius[:, None] - r)
        strain.append(kernel @ slope / kernel.sum(axis=1))
        surface.append((u[0], u[n + 1]))
    return np.array(strain).T, np.array(surface)


@pytest.mark.parametrize("traction", ["normal", "tangential"])
@pytest.mark.parametrize(("alpha", "sigma"), [(0.74, 0.46), (0.9, 0.3), (0.5, 0.0), (0.7, 0.49)])
def test_against_collocation_of_navier_equations(traction: str, alpha: float, sigma: float) -> None:
    # Mode 0 of a tangential traction is rotation (sin 0 = 0), which has no radial part to compare.
    modes = np.append(np.arange(0 if traction == "normal" else 1, 31), [1.5, 7.25])  # fractions serve cut-offs
    radius = alpha + (1 - alpha) * np.array([0.013, 0.21, 0.52, 0.87])
    strain, surface = _collocation(modes, radius, alpha, sigma, traction)
    solution = solve_annulus(modes, core_radius_mm=alpha, outer_radius_mm=1.0, poisson_ratio=sigma, traction=traction)
    # Rounding of the collocation: eps times the 1e6 norm of its second derivative. The two differ by 3e-10.
    np.testing.assert_allclose(solution.radial_strain(radius), strain, rtol=0, atol=2e-9)
    np.testing.assert_allclose(solution.surface_displacement_mm, surface[:, 0], rtol=0, atol=2e-9)
    np.testing.assert_allclose(solution.surface_slip_mm, surface[:, 1], rtol=0, atol=2e-9)
    assert np.abs(strain).max() > 0.1


def test_incompressible_uniform_pressure_moves_nothing() -> None:
    rigid = FINGER | {"poisson_ratio": 0.5}
    assert radial_strain_response([0], 10.0, **rigid) == pytest.approx(0, abs=1e-15)
    assert surface_displacement_response([0], **rigid) == pytest.approx(0, abs=1e-15)


def test_large_modes_approach_the_half_plane() -> None:
    modes = np.array([100, 200, 400, 800, 5000])
    half_plane = (1 - 0.46) * 12.7 / modes  # (1-σ) r_b/(μ k) in mm at μ = 1 MPa
    ratio = surface_displacement_response(modes, **FINGER) / half_plane
    # The leading error is curvature: (1-2σ)/(2(1-σ)) / k; the next term is 1/k smaller again.
    leading = -0.08 / (2 * 0.54) / modes
    assert np.all(np.abs(ratio - 1 - leading) < 2 / modes**2)


@pytest.mark.parametrize("radius", [9.9, 10.7, 11.8])
def test_truncated_series_converges_geometrically(radius: float) -> None:
    """Modes beyond ``n`` add ``½ Σ [k (1-ρ²) + (κ-1) ρ²] ρ^(k-2)``, ρ = r/r_b, to the strain below a line load."""
    rho, kappa = radius / 12.7, 3 - 4 * 0.46
    response = 2 * radial_strain_response(np.arange(3000), radius, **FINGER)
    kept = np.array([60, 80, 120])
    left_out = np.array([response[n + 1 :].sum() for n in kept])
    # Sums of ρ^k and k ρ^k over k > n.
    geometric = rho ** (kept + 1) / (1 - rho)
    weighted = geometric * (kept + 1 + rho / (1 - rho))
    expected = ((1 - rho**2) * weighted + (kappa - 1) * rho**2 * geometric) / (2 * rho**2)
    # The core adds a share of order k² (r_a/r)^2k: 1 % at r = 9.9 and k = 60, next to nothing elsewhere.
    np.testing.assert_allclose(left_out, expected, rtol=0.012)
    rates = np.diff(np.log(left_out)) / np.diff(kept)
    np.testing.assert_allclose(rates, np.log(rho), atol=1 / kept[0])  # k ρ^k


def test_no_overflow_and_no_warning_at_large_modes() -> None:
    modes = np.arange(5001)
    with np.errstate(over="raise", invalid="raise", divide="raise"):
        strain = radial_strain_response(modes, np.linspace(9.4, 12.7, 12), **FINGER)
    assert np.all(np.isfinite(strain))
    # At the edge of a half-plane both normal stresses equal the traction, so that e_rr = (1-2σ)/2.
    np.testing.assert_allclose(strain[-1, -1], (1 - 2 * 0.46) / 2, rtol=1e-3)


def test_batches_of_poisson_ratio_broadcast() -> None:
    modes, sigmas, radii = np.arange(12), np.array([0.41, 0.46, 0.5]), np.array([9.8, 10.3, 10.7])
    body = {"core_radius_mm": 9.4, "outer_radius_mm": 12.7}
    paired = radial_strain_response(modes, radii, poisson_ratio=sigmas, **body)
    crossed = radial_strain_response(modes, radii, poisson_ratio=sigmas[:, None], **body)
    assert paired.shape == (3, 12)
    assert crossed.shape == (3, 3, 12)
    for i, sigma in enumerate(sigmas):
        alone = radial_strain_response(modes, radii, poisson_ratio=float(sigma), **body)
        np.testing.assert_allclose(crossed[i], alone, rtol=1e-14)
        np.testing.assert_allclose(paired[i], alone[i], rtol=1e-14)


@pytest.mark.parametrize(
    "change",
    [
        {"core_radius_mm": 13.0},
        {"core_radius_mm": 0.0},
        {"poisson_ratio": 0.51},
        {"poisson_ratio": -1.0},
        {"modes": [-1]},
        {"radius_mm": 12.8},
        {"radius_mm": 9.3},
        {"radius_mm": float("nan")},
    ],
)
def test_impossible_bodies_are_refused(change: dict) -> None:
    with pytest.raises(InputError):
        radial_strain_response(**({"modes": [0, 1], "radius_mm": 9.9} | FINGER | change))


def test_betti_reciprocity_of_tractions_and_displacements() -> None:
    """Work of pressure A on displacement B equals the work of shear B on displacement A, at another place.

    ``u_r`` under a tangential traction and ``u_θ`` under a normal one are different formulas in the solver.
    """
    modes, points = np.arange(60), 256
    pressure = solve_annulus(modes, **FINGER, traction="normal")
    shear = solve_annulus(modes, **FINGER, traction="tangential")
    theta = 2 * np.pi * np.arange(points) / points
    load_a = np.exp(-(((theta - 1.0) / 0.1) ** 2))
    load_b = np.where(np.abs(theta - 2.3) < 0.2, np.sin(9 * theta), 0.0)

    def displacement(load: np.ndarray, response: np.ndarray, phase: complex) -> np.ndarray:
        spectrum = np.zeros(points // 2 + 1, complex)
        spectrum[: modes.size] = phase * response * np.fft.rfft(load)[: modes.size]
        return np.fft.irfft(spectrum, points)

    # cos -> sin is a factor -i of the half-complex spectrum, sin -> cos a factor i.
    work_b_on_a = load_b @ displacement(load_a, pressure.surface_slip_mm, -1j)
    work_a_on_b = load_a @ displacement(load_b, shear.surface_displacement_mm, 1j)
    largest = np.abs(load_b) @ np.abs(displacement(load_a, pressure.surface_slip_mm, -1j))
    assert work_a_on_b == pytest.approx(work_b_on_a, rel=1e-10)
    assert abs(work_b_on_a) > 1e-3 * largest  # the equality is not one of two zeros
