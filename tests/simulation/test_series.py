"""The sum of a finger's Fourier series: it is summed far enough, and its mode by mode is that of the chain."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayestouch.body.annulus import solve_annulus
from bayestouch.chain.element_weight import ElementWeight
from bayestouch.chain.finger import FingerChain
from bayestouch.contact import composite_radius, contact_model
from bayestouch.simulation.series import summed_strain

CHAIN = FingerChain(
    core_radius_mm=9.4,
    outer_radius_mm=12.7,
    response=np.ones(2),
    sensing_radius_mm=np.array([9.7, 10.7]),
    angle=np.radians([-3.0, 4.0]),
    offset=np.zeros(2),
    poisson_ratio=0.46,
    shear_modulus_MPa=0.15,
    largest_load=300.0,
)


def test_series_is_summed_far_enough() -> None:
    radius, angle, load = np.array([0.0, 0.5, np.inf]), np.radians([-3.0, 4.1, 60.0]), np.full(3, 200.0)
    modes = np.arange(600)
    strain = solve_annulus(modes, core_radius_mm=9.4, outer_radius_mm=12.7, poisson_ratio=0.46).radial_strain(
        CHAIN.sensing_radius_mm
    )
    kappa = 0.2 * composite_radius(radius, 12.7) / 0.15
    spectrum = contact_model("layer", (9.4, 12.7), 0.46).spectrum(kappa, modes)
    cosine = np.cos(modes * (CHAIN.angle - angle[:, None])[..., None])
    series = np.einsum("k,mk,tk,tmk->tm", np.where(modes == 0, 1, 2), strain, spectrum, cosine)
    expected = 0.2 / 0.15 / (2 * np.pi * 12.7) * series
    # (r_s/r_b)^k at one and a half times the modes that suffice for 1e-7
    np.testing.assert_allclose(summed_strain(CHAIN, radius, angle, load), expected, rtol=0, atol=1e-8 * expected.max())


def test_aperture_is_the_mean_over_the_element() -> None:
    touch = np.array([0.0, 3.9]), np.radians([-1.0, 5.0]), np.array([200.0, 180.0])
    nodes, weights = np.polynomial.legendre.leggauss(12)
    width = 1.5
    mean = np.zeros((2, 2))
    for node, weight in zip(nodes, weights, strict=True):
        aside = replace(CHAIN, angle=CHAIN.angle + node * width / 2 / CHAIN.sensing_radius_mm)
        mean += weight / 2 * summed_strain(aside, *touch)
    # 12 Gauss nodes over a width in which the strain's highest mode turns by 3 rad: exact to 1e-9
    np.testing.assert_allclose(
        summed_strain(replace(CHAIN, element_weight=ElementWeight(width)), *touch), mean, rtol=0, atol=1e-9
    )
    assert np.abs(summed_strain(CHAIN, *touch) - mean).max() > 1e-3
