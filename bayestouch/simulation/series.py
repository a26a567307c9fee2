"""Strain of a finger's elements, computed as the sum of the Fourier series.

The package calibrates and infers with an interpolated table instead. The sum has 1.5 times as many modes as the table,
and its error is below 1e-8 of the peak; the approximation of the contact (8 terms) has an error of 1e-5 of the peak.
"""

from __future__ import annotations

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.body.finger import solve_body
from bayestouch.chain.finger import FingerChain
from bayestouch.chain.response import mode_strain, modes_needed
from bayestouch.contact import composite_radius, contact_model


def summed_strain(
    chain: FingerChain, indenter_radius_mm: FloatArray, angle: FloatArray, load: FloatArray
) -> FloatArray:
    """Compressive strain at the elements of a linear finger.

    Parameters
    ----------
    chain : FingerChain
        The finger.
    indenter_radius_mm, angle, load : (t,) arrays
        r_c (mm), θ_c (rad), P (N/m).

    Returns
    -------
    (t, m) array
        Compressive strain.
    """
    radii = (chain.core_radius_mm, chain.outer_radius_mm)
    modes = np.arange(1.5 * modes_needed(float(chain.sensing_radius_mm.max()), radii[1]))
    body = solve_body(modes, core_radius_mm=radii[0], outer_radius_mm=radii[1], poisson_ratio=chain.poisson_ratio)
    radius = chain.effective_radius(composite_radius(indenter_radius_mm, radii[1]), angle)
    kappa = load / 1000 * radius / chain.shear_modulus_MPa
    spectrum = _spectrum(chain, kappa, modes)
    of_mode = mode_strain(body, chain.sensing_radius_mm, element_weight=chain.element_weight, friction=chain.friction)
    weights = np.where(modes == 0, 1.0, 2.0) * of_mode
    # Re w exp(ik(θ_s - θ_c)) as two products, so that no array (touch, element, mode) is needed.
    touch, element = np.outer(angle, modes), np.outer(chain.angle, modes)
    even, odd = weights.real, weights.imag
    series = (spectrum * np.cos(touch)) @ (even * np.cos(element) - odd * np.sin(element)).T
    series += (spectrum * np.sin(touch)) @ (even * np.sin(element) + odd * np.cos(element)).T
    scale = load / 1000 / chain.shear_modulus_MPa / (2 * np.pi * radii[1])
    return np.asarray(scale[:, None] * series)


def _spectrum(chain: FingerChain, kappa: FloatArray, modes: FloatArray) -> FloatArray:
    """Pressure spectra (t, k)."""
    if not kappa.any():  # the contact of a knife edge needs no solution
        return np.ones((len(kappa), len(modes)))

    def of(contact: str) -> FloatArray:
        radii = (chain.core_radius_mm, chain.outer_radius_mm)
        return contact_model(contact, radii, chain.poisson_ratio).spectrum(kappa, modes)

    solved = of(chain.contact)
    return solved + chain.layer_share * (of("layer") - solved) if chain.layer_share else solved
