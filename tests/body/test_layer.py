"""The bonded pad against closed forms, quadrature, load balance, the annulus, and finite elements."""

from __future__ import annotations

import numpy as np
import pytest
from fem_oracle import Body, graded, through_gauss_points
from scipy.integrate import quad
from scipy.special import j0

from bayestouch.body.finger import radial_strain_response, surface_displacement_response
from bayestouch.body.layer import (
    EXTENT,
    half_space_kernel_1d,
    half_space_kernel_2d,
    layer_kernel_1d,
    layer_kernel_2d,
    layer_surface_compliance,
    layer_transfer,
)
from bayestouch.body.layer_transfer import Quantity, hertz_spectrum
from bayestouch.errors import InputError

QUANTITIES: list[Quantity] = ["normal_stress", "mean_stress", "normal_strain"]
KERNELS = {1: layer_kernel_1d, 2: layer_kernel_2d}


def test_boussinesq_and_flamant() -> None:
    distance, depth = np.array([0.0, 0.3, 1.0, 4.0, 50.0]), 1.3
    far = np.hypot(distance, depth)
    point = 3 * depth**3 / (2 * np.pi * far**5)
    line = 2 * depth**3 / (np.pi * far**4)
    for tiny in (0.0, 1e-6):  # the closed forms lose no digits as the loaded disc shrinks
        np.testing.assert_allclose(half_space_kernel_2d(distance, depth, tiny), point, rtol=1e-11)
        np.testing.assert_allclose(half_space_kernel_1d(distance, depth, tiny), line, rtol=1e-11)


@pytest.mark.parametrize("quantity", QUANTITIES)
@pytest.mark.parametrize("load_radius", [0.0, 0.02, 0.5, 3.0])
@pytest.mark.parametrize(("thickness", "depth"), [(np.inf, 1.0), (1.0, 1.0), (1.0, 0.3), (1.7, 1.1)])
def test_kernels_against_adaptive_quadrature(
    quantity: Quantity, load_radius: float, thickness: float, depth: float
) -> None:
    """Closed form plus table against the transform of the transfer function, integrated to 1e-11."""
    sigma, distance = 0.44, np.array([0.0, 0.4, 1.1, 2.3])

    def spectrum(xi: float, dimensions: int) -> float:
        transfer = layer_transfer(xi, thickness_mm=thickness, poisson_ratio=sigma, depth_mm=depth, quantity=quantity)
        return float(transfer * hertz_spectrum(xi * load_radius, dimensions))

    def transform(where: float, dimensions: int) -> float:
        def wave(xi: float) -> float:
            return np.cos(xi * where) / np.pi if dimensions == 1 else j0(xi * where) * xi / (2 * np.pi)

        # exp(-45) ends the integrand; 1e-11 is what the rounding of quad leaves.
        value, _ = quad(
            lambda xi: spectrum(xi, dimensions) * wave(xi), 0, 45 / depth, limit=500, epsabs=1e-11, epsrel=0
        )
        return value

    for dimensions, kernel in KERNELS.items():
        values = kernel(distance, thickness, sigma, load_radius, depth, quantity)
        expected = [transform(x, dimensions) for x in distance]
        # Cubic interpolation over steps of 0.012 thicknesses leaves 1e-9 of a peak of order one.
        np.testing.assert_allclose(values, expected, rtol=0, atol=3e-9)


@pytest.mark.parametrize("sigma", [0.0, 0.3, 0.46, 0.5])
@pytest.mark.parametrize("depth", [None, 0.4])
def test_stress_balances_the_load(sigma: float, depth: float | None) -> None:
    nodes, weights = np.polynomial.legendre.leggauss(2000)
    rho = EXTENT / 2 * 1.5 * (nodes + 1)
    line = layer_kernel_1d(rho, 1.5, sigma, 0.7, depth)
    disc = layer_kernel_2d(rho, 1.5, sigma, 0.7, depth)
    # 1e-8 of interpolation and quadrature; the tail beyond the table is 1e-10 of the load.
    assert 2 * EXTENT / 2 * 1.5 * weights @ line == pytest.approx(1, abs=1e-7)
    assert 2 * np.pi * EXTENT / 2 * 1.5 * weights @ (rho * disc) == pytest.approx(1, abs=1e-7)


def test_thick_layer_is_the_half_space() -> None:
    rho, errors = np.linspace(0, 3, 31), []
    for thickness in (10.0, 20.0, 40.0):
        difference = layer_kernel_2d(rho, thickness, 0.46, 0.5, 1.0) - half_space_kernel_2d(rho, 1.0, 0.5)
        errors.append(np.abs(difference).max())
    # The base leaves the surface free, so that its stress at depth z is of order (z/h)² times a load over h².
    rates = np.log2(np.divide(errors[:-1], errors[1:]))
    assert errors[-1] < 1e-5
    np.testing.assert_allclose(rates, 4, atol=0.3)
    compliance = layer_surface_compliance([0.3, 3.0], thickness_mm=40.0, poisson_ratio=0.46)
    np.testing.assert_allclose(compliance, 0.54 / np.array([0.3, 3.0]), rtol=1e-7)


def test_thin_layer_is_compressed_in_one_dimension() -> None:
    xi = np.array([0.0, 1e-9, 1e-3])
    strain = layer_transfer(xi, thickness_mm=2.0, poisson_ratio=0.3, quantity="normal_strain")
    np.testing.assert_allclose(strain, 0.4 / 1.4, rtol=1e-4)
    compliance = layer_surface_compliance(xi, thickness_mm=2.0, poisson_ratio=0.3)
    np.testing.assert_allclose(compliance, 2 * 0.4 / 1.4, rtol=1e-4)


@pytest.mark.parametrize("sigma", [0.3, 0.46, 0.5])
def test_the_three_quantities_are_proportional_at_the_base(sigma: float) -> None:
    xi = np.geomspace(1e-3, 30, 40)
    stress, mean, strain = (
        layer_transfer(xi, thickness_mm=1.2, poisson_ratio=sigma, quantity=quantity) for quantity in QUANTITIES
    )
    scale = np.abs(stress)
    np.testing.assert_allclose(mean / scale, stress / scale * (1 + sigma) / (3 * (1 - sigma)), rtol=1e-9)
    np.testing.assert_allclose(
        strain / scale, stress / scale * (1 - 2 * sigma) / (2 * (1 - sigma)), rtol=1e-9, atol=1e-9
    )


@pytest.mark.parametrize("sigma", [0.3, 0.46])
def test_annulus_flattens_to_the_pad(sigma: float) -> None:
    """r_b → ∞ at fixed thickness and fixed spatial frequency ξ = k/r_b: first order in h/r_b."""
    thickness, depth, xi = 2.0, 1.3, np.array([0.25, 1.0, 3.0])
    strain_errors, surface_errors = [], []
    for outer in (100.0, 200.0, 400.0, 800.0):
        body = {"core_radius_mm": outer - thickness, "outer_radius_mm": outer, "poisson_ratio": sigma}
        strain = radial_strain_response(xi * outer, outer - depth, **body)
        surface = surface_displacement_response(xi * outer, **body)
        flat = layer_transfer(xi, thickness_mm=thickness, poisson_ratio=sigma, depth_mm=depth, quantity="normal_strain")
        compliance = layer_surface_compliance(xi, thickness_mm=thickness, poisson_ratio=sigma)
        strain_errors.append(np.abs(strain / flat - 1))
        surface_errors.append(np.abs(surface / compliance - 1))
    for errors in (np.array(strain_errors), np.array(surface_errors)):
        assert errors[-1].max() < 5e-3
        # First order; where its coefficient is small the second order still shows.
        np.testing.assert_allclose(np.log2(errors[-2] / errors[-1]), 1, atol=0.1)


@pytest.mark.parametrize("kind", ["plane", "axisymmetric"])
@pytest.mark.parametrize("sigma", [0.3, 0.46])
def test_pad_against_finite_elements(kind: str, sigma: float) -> None:
    thickness, load, heights = 2.0, 1.0, [0.5, 1.2]

    def pressure(x: np.ndarray) -> np.ndarray:
        peak = 2 / (np.pi * load**2) if kind == "plane" else 1.5 / (np.pi * load**3)
        return peak * np.sqrt(np.maximum(load**2 - x**2, 0))

    kernel = KERNELS[1 if kind == "plane" else 2]
    errors = []
    for n in (1, 2, 4):
        spacing = 0.2 / n
        inside = load - graded(load, 0.01 * spacing, 1.5, spacing)
        # Free side 8 thicknesses away, where everything has decayed by exp(-6): 2e-3 of a tail of 1e-3.
        outside = load + graded(8 * thickness - load, 0.01 * spacing, 1.5, 2 * spacing)
        lateral = np.union1d(np.maximum(inside, 0), outside)
        body = Body(kind, lateral, through_gauss_points(0, thickness, spacing, heights), sigma)
        u = body.solve(body.pressure_load(pressure))
        x = lateral[:-1] + (0.5 - 1 / np.sqrt(12)) * np.diff(lateral)  # lateral Gauss points
        x = x[x < 4 * thickness]
        row = []
        for height in heights:
            for quantity, found in (
                ("normal_strain", body.normal_strain(u, x, height)),
                ("normal_stress", body.normal_stress(u, x, height)),
            ):
                expected = kernel(x, thickness, sigma, load, thickness - height, quantity)
                row.append(np.abs(-found - expected).max() / expected.max())
        base = kernel(x, thickness, sigma, load)
        row.append(np.abs(-body.normal_stress(u, x, 0.0) - base).max() / base.max())
        errors.append(row)
    # Over both refinements (the meshes are not nested, so that single steps scatter): second order or better.
    rates = np.log2(np.divide(errors[0], errors[2])) / 2
    assert np.all(rates > 1.7), rates
    assert np.max(errors[2][:4]) < 1e-3, errors
    assert errors[2][4] < 5e-3, errors  # the base is no Gauss point


def test_where_a_negative_ring_appears() -> None:
    """Normal stress at the base has none to speak of; strain above it has one of several per cent."""
    rho = np.linspace(0, 6, 1201)

    def ring(sigma: float, depth: float | None, quantity: Quantity) -> float:
        kernel = layer_kernel_2d(rho, 1.0, sigma, 0.0, depth, quantity)
        return float(kernel.min() / kernel[0])

    assert ring(0.46, None, "normal_stress") > 0
    assert -5e-4 < ring(0.5, None, "normal_stress") < -3e-4
    assert -0.07 < ring(0.5, 0.9, "normal_strain") < -0.06
    assert -0.04 < ring(0.46, 0.7, "normal_strain") < -0.03
    assert half_space_kernel_2d(rho, 1.0).min() > 0


def test_distance_scales_with_thickness() -> None:
    rho = np.array([0.0, 0.7, 2.0, 9.0])
    for dimensions, kernel in KERNELS.items():
        one = kernel(rho, 1.0, 0.45, 0.2, 0.8)
        three = kernel(3 * rho, 3.0, 0.45, 0.6, 2.4)
        np.testing.assert_allclose(three * 3**dimensions, one, rtol=1e-10)


@pytest.mark.parametrize(
    "change",
    [
        {"thickness_mm": 0.0},
        {"thickness_mm": float("nan")},
        {"poisson_ratio": 0.6},
        {"depth_mm": 0.0},
        {"depth_mm": 2.1},
        {"indenter_radius_mm": -1.0},
        {"thickness_mm": float("inf")},  # a half-space has no base to measure at
        {"thickness_mm": np.array([2.0, 0.0])},
        {"poisson_ratio": np.array([0.45, 0.6])},
    ],
)
def test_impossible_pads_are_refused(change: dict) -> None:
    with pytest.raises(InputError):
        layer_kernel_2d(**({"rho_mm": [0.0, 1.0], "thickness_mm": 2.0, "poisson_ratio": 0.45} | change))


@pytest.mark.parametrize("dimensions", [1, 2])
def test_many_layers_are_those_of_each(dimensions: int) -> None:
    """With loads wider than four thicknesses among them, for which all spectra have more nodes."""
    rng, n = np.random.default_rng(5), 9
    rho, thickness, sigma = rng.uniform(0, 30, (n, 4, 3)), rng.uniform(1, 9, n), rng.uniform(0.3, 0.5, n)
    radius, depth = thickness * np.linspace(0, 5, n), thickness * rng.uniform(0.5, 1.0, n)
    of = KERNELS[dimensions]
    for quantity in ("normal_stress", "mean_stress", "normal_strain"):
        each = [of(rho[i], thickness[i], sigma[i], radius[i], depth[i], quantity) for i in range(n)]
        # 1e-11 of the peak is what the smaller number of nodes costs
        together = of(rho, thickness, sigma, radius, depth, quantity)
        np.testing.assert_allclose(together, each, rtol=0, atol=2e-11 * np.abs(each).max())


def test_the_first_wrong_layer_is_named() -> None:
    with pytest.raises(InputError, match="layer thickness must be above zero, got -3 mm"):
        layer_kernel_2d(np.zeros((3, 1)), np.array([2.0, -3.0, -4.0]), 0.45)
