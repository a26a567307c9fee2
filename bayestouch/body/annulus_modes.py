"""Closed-form constants of the bonded annulus for each mode; symbols as in `bayestouch.body.annulus`.

Each function returns six arrays, all times 2μ (displacements also over r_b): the strain coefficients of
``ρ^k``, ``ρ^(k-2)``, ``(α/ρ)^k`` and ``(α/ρ)^k ρ^-2``, then ``u_r`` (cos kθ) and ``u_θ`` (sin kθ) at the
surface. ``normal`` and ``shear`` are the amplitudes of ``τ_rr`` (cos kθ) and ``τ_rθ`` (sin kθ) there.
"""

from __future__ import annotations

import numpy as np

from bayestouch.array_types import FloatArray

Terms = tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]


def higher_modes(k: FloatArray, alpha: float, kappa: FloatArray, normal: float, shear: float) -> Terms:
    """Constants of the modes k >= 2."""
    core_power = alpha**k  # decaying solutions at the surface, growing ones at the core
    square = core_power**2
    # Bonding: b = α^k [(k+1) a + c/α²]/κ, d = κ α² α^k a + (k-1) α² b; then τ_rr + τ_rθ and τ_rθ at ρ = 1.
    sum_a = 1 + kappa * alpha**2 * square - (k**2 - 1) * (1 - alpha**2) * square / kappa
    sum_c = -(k - 1) * (1 - alpha**2) * square / (kappa * alpha**2)
    lever = ((k + 1) * alpha**2 - k) * square / kappa
    shear_a = (k + 1) * (k + kappa * alpha**2 * square + (k - 1) * lever)
    shear_c = (k - 1) * (1 + lever / alpha**2)
    total = (normal + shear) / (2 * (k + 1))
    determinant = sum_a * shear_c - sum_c * shear_a
    a = (total * shear_c - sum_c * shear) / determinant
    c = (sum_a * shear - shear_a * total) / determinant
    b = core_power * ((k + 1) * a + c / alpha**2) / kappa
    d = alpha**2 * (kappa * core_power * a + (k - 1) * b)
    return (
        (kappa - k - 1) * (k + 1) * a,
        -(k - 1) * c,
        (kappa + k - 1) * (1 - k) * b,
        (k + 1) * d,
        (kappa - k - 1) * a - c + ((kappa + k - 1) * b - d) * core_power,
        (kappa + k + 1) * a + c + ((k - 1 - kappa) * b - d) * core_power,
    )


def mode_zero(alpha: float, kappa: FloatArray, normal: float, shear: float) -> Terms:
    """Constants of mode 0, uniform traction: 2μ u_r/r_b = (κ-1) a (ρ - α²/ρ). Shear is zero (sin 0 = 0)."""
    a = normal / (2 + (kappa - 1) * alpha**2)
    strain = (kappa - 1) * a
    zero = np.zeros_like(strain)
    return strain, zero, zero, strain * alpha**2, strain * (1 - alpha**2), zero


def mode_one(alpha: float, kappa: FloatArray, normal: float, shear: float) -> Terms:
    """Constants of mode 1: 2μ u_r/r_b = (κ-2) a ρ² + β (2κ ln ρ - 1) - c - d/ρ²; β is the net force."""
    beta = (normal - shear) / (2 * (1 + kappa))
    a = (((kappa - 1) * beta + shear) / 2 + beta * alpha**2) / (1 + kappa * alpha**4)
    d = kappa * a * alpha**4 - beta * alpha**2
    c = 2 * kappa * beta * np.log(alpha) - 2 * a * alpha**2
    # Here (α/ρ)^k is α/ρ; therefore the divisions by α.
    return (
        2 * (kappa - 2) * a,
        np.zeros_like(a),
        2 * kappa * beta / alpha,
        2 * d / alpha,
        (kappa - 2) * a - beta - c - d,
        (kappa + 2) * a - beta + c - d,
    )
