"""E map: strain at every element from the surface pressure coefficients, modelled or identified.

The coefficients are those of the paper (equation 1), of the surface traction ``τ_rr`` (tension positive; a
pressure is a negative traction), in the order

    p_0, p_1^s, p_1^c, p_2^s, p_2^c, …, p_nc^s, p_nc^c        (2 n_c + 1 of them)

and ``ε = E p`` (equation 2). Source: Nicolson and Fearing (1995), sections 2.2 and 3.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray
from bayestouch.body.finger import radial_strain_response
from bayestouch.errors import InputError

# Coefficients of a larger condition number count as not determined: relative noise of 1e-8 would fix the result.
LARGEST_CONDITION = 1e8


def fourier_basis(angles_deg: ArrayLike, n_coefficients: int) -> FloatArray:
    """Values of ``1, sin θ, cos θ, …, sin n_c θ, cos n_c θ`` at the given angles.

    Parameters
    ----------
    angles_deg : (n,) array_like
        Angles in degrees.
    n_coefficients : int
        Highest Fourier coefficient ``n_c``.

    Returns
    -------
    (n, 2 n_c + 1) array
    """
    if n_coefficients < 0:
        raise InputError(f"the highest Fourier coefficient must be zero or more, got {n_coefficients}")
    phase = np.radians(np.asarray(angles_deg, dtype=float))[:, np.newaxis] * np.arange(1, n_coefficients + 1)
    basis = np.ones((phase.shape[0], 2 * n_coefficients + 1))
    basis[:, 1::2] = np.sin(phase)
    basis[:, 2::2] = np.cos(phase)
    return basis


def per_coefficient(per_mode: ArrayLike) -> FloatArray:
    """Values of modes ``0 … n_c`` (last axis) in the order of the coefficients: mode 0 once, the others twice."""
    values = np.asarray(per_mode, dtype=float)
    return np.concatenate([values[..., :1], np.repeat(values[..., 1:], 2, axis=-1)], axis=-1)


def traction_coefficients(
    spectrum: ArrayLike, angles_deg: ArrayLike, loads_N_per_mm: ArrayLike, *, outer_radius_mm: float
) -> FloatArray:
    """Matrix **P** of the paper: the traction coefficients of each touch as a column.

    Parameters
    ----------
    spectrum : (n_touches, n_c + 1) or (n_c + 1,) array_like
        Normalised pressure spectrum ``q_k`` of each touch, ``q_0 = 1`` (all ones for a knife edge).
    angles_deg : (n_touches,) array_like
        Contact locations θ_c, degrees.
    loads_N_per_mm : (n_touches,) array_like
        Line loads, positive for a press.
    outer_radius_mm : float
        ``r_b``, mm.

    Returns
    -------
    (2 n_c + 1, n_touches) array
        In MPa; negative for a press, because traction is tension positive.
    """
    q = np.asarray(spectrum, dtype=float)
    doubled = np.where(np.arange(q.shape[-1]) == 0, 1.0, 2.0) * q
    basis = fourier_basis(angles_deg, q.shape[-1] - 1)
    load = np.asarray(loads_N_per_mm, dtype=float)[:, np.newaxis] / (2 * np.pi * outer_radius_mm)
    return np.asarray((-load * per_coefficient(doubled) * basis).T)


def model_e_matrix(
    element_angles_deg: ArrayLike,
    n_coefficients: int,
    *,
    sensing_radius_mm: ArrayLike,
    core_radius_mm: float,
    outer_radius_mm: float,
    poisson_ratio: ArrayLike,
    shear_modulus_MPa: float = 1.0,
) -> FloatArray:
    """Model E map of a finger, equations (1) and (2).

    Parameters
    ----------
    element_angles_deg : (n_elements,) array_like
        Element locations θ_s, degrees.
    n_coefficients : int
        Highest Fourier coefficient ``n_c``.
    sensing_radius_mm, poisson_ratio : float or (n_elements,) array_like
        ``r_s`` in mm and σ, one for all or one per element.
    core_radius_mm, outer_radius_mm : float
        ``r_a`` and ``r_b``, mm.
    shear_modulus_MPa : float
        μ, MPa.

    Returns
    -------
    (n_elements, 2 n_c + 1) array
        Strain (extension positive) per MPa of each traction coefficient.

    Raises
    ------
    InputError
        If the body is impossible (see `bayestouch.body.annulus`) or μ is not above zero.
    """
    if not shear_modulus_MPa > 0:
        raise InputError(f"shear modulus must be above zero, got {shear_modulus_MPa:g} MPa")
    response = radial_strain_response(
        np.arange(n_coefficients + 1),
        sensing_radius_mm,
        core_radius_mm=core_radius_mm,
        outer_radius_mm=outer_radius_mm,
        poisson_ratio=poisson_ratio,
    )
    basis = fourier_basis(element_angles_deg, n_coefficients)
    return np.asarray(per_coefficient(response) * basis / shear_modulus_MPa)


def empirical_e_matrix(coefficients: ArrayLike, scaled_readings: ArrayLike) -> FloatArray:
    """E map identified directly from touches, equation (6), by least squares on an orthogonal factorisation.

    The function minimises ``‖E P - G D‖`` for each element separately. It assumes that the readings scaled by the
    gain are linear in the pressure; that the pressure of every touch is known (from a contact model and the measured
    load); that no mode above ``n_c`` reaches the elements (otherwise it is aliased to lower coefficients, as in any
    sampled spectrum); and that all errors are in the readings, equal and independent. It does not assume
    elasticity, symmetry or equal elements. It works for any body whose pressure is a sum of known shapes: P then
    contains their coefficients.

    Parameters
    ----------
    coefficients : (n_coefficients, n_touches) array_like
        **P**: one column of pressure coefficients per touch, for example from `traction_coefficients`.
    scaled_readings : (n_elements, n_touches) array_like
        **G D**: readings times gain. NaN where a reading is missing; that touch is not used for that element.

    Returns
    -------
    (n_elements, n_coefficients) array
        In units of the readings per unit of the coefficients.

    Raises
    ------
    InputError
        If the shapes do not match, P is not finite, or the touches do not determine all coefficients.
    """
    p, d = np.asarray(coefficients, dtype=float), np.asarray(scaled_readings, dtype=float)
    if p.ndim != 2 or d.ndim != 2 or p.shape[1] != d.shape[1]:
        raise InputError(f"expected coefficients and readings of the same touches, got shapes {p.shape} and {d.shape}")
    if not np.all(np.isfinite(p)):
        raise InputError("pressure coefficients must be finite")
    present = np.isfinite(d)
    matrix = np.empty((d.shape[0], p.shape[0]))
    # Elements with the same missing readings use the same factorisation.
    patterns, which = np.unique(present, axis=0, return_inverse=True)
    for i, pattern in enumerate(patterns):
        rows = np.ravel(which) == i
        matrix[rows] = _solve(p[:, pattern].T, d[np.ix_(rows, pattern)].T).T
    return matrix


def _solve(design: FloatArray, readings: FloatArray) -> FloatArray:
    needed, touches = design.shape[1], design.shape[0]
    # Columns are scaled to equal length: a small high coefficient does not mean that touches are missing.
    length = np.linalg.norm(design, axis=0)
    length = np.where(length > 0, length, 1.0)
    solution, _, rank, _ = np.linalg.lstsq(design / length, readings, rcond=1 / LARGEST_CONDITION)
    if rank < needed:
        raise InputError(
            f"{touches} touches determine only {rank} of {needed} pressure coefficients; an empirical E map "
            f"needs at least {needed} touches, equally spaced all the way around the finger, or fewer coefficients"
        )
    return np.asarray(solution / length[:, np.newaxis])


def singular_values(matrix: ArrayLike) -> FloatArray:
    """Singular values of an E map, largest first: the gains of its independent pressure patterns."""
    return np.asarray(np.linalg.svd(np.asarray(matrix, dtype=float), compute_uv=False))


def condition_number(matrix: ArrayLike) -> float:
    """Largest over smallest of the ``min(n_elements, n_coefficients)`` singular values of an E map.

    With more coefficients than elements it is the conditioning of the readings (of ``E Eᵀ``): how unequally strain
    patterns are excited. The coefficients are then not all determined, whatever this number is. ``inf`` if E is
    singular.
    """
    values = singular_values(matrix)
    return float(values[0] / values[-1]) if values[-1] > 0 else float("inf")
