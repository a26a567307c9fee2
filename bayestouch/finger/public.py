"""Calibration parameters of a finger by public name and in public units, from flat vectors."""

from __future__ import annotations

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.body.finger import solve_body
from bayestouch.chain.finger import FingerChain
from bayestouch.chain.response import modes_needed
from bayestouch.finger.fit import FingerFit
from bayestouch.finger.known_touches import KnownTouches
from bayestouch.finger.layout import FlatLayout
from bayestouch.finger.noise import public_noise


def public_mode(fit: FingerFit) -> dict[str, FloatArray]:
    """Most probable value of every parameter, () or (m,)."""
    chain = fit.chain
    return {
        "sigma": np.asarray(chain.poisson_ratio),
        "mu": np.asarray(chain.shear_modulus_MPa),
        "r_s": chain.sensing_radius_mm,
        "theta_s": np.degrees(chain.angle),
        "response": chain.response,
        "gain": chain.gain,
        "noise_sd": fit.noise.tactile_sd,
        "discrepancy_sd": fit.noise.discrepancy_sd,
        "force_noise_sd": np.asarray(fit.noise.force_sd),
    }


def linear_vectors(at: FlatLayout, sign: FloatArray, vectors: FloatArray) -> FloatArray:
    """Flat vectors (n, d) of the chain and the values of its effects, with responses instead of their logarithms."""
    linear = vectors.reshape(-1, vectors.shape[-1])[:, : at.n_chain].copy()
    linear[:, at.response] = sign * np.exp(linear[:, at.response])
    return linear


def public_draws(fit: FingerFit, vectors: FloatArray) -> dict[str, FloatArray]:
    """Draws of every parameter and of the gains, by name, (chain, draw[, m]), from flat vectors (chain, draw, d)."""
    return draws_by_name(fit.chain, fit.likelihood.known, fit.likelihood.layout, vectors)


def draws_by_name(
    chain: FingerChain, known: KnownTouches, at: FlatLayout, vectors: FloatArray
) -> dict[str, FloatArray]:
    """As `public_draws`, for the touches `known`; the signs of the responses are those of `chain`."""
    flat = vectors.reshape(-1, vectors.shape[-1])
    response = np.where(chain.response < 0, -1.0, 1.0) * np.exp(flat[:, at.response])
    depth, sigma, mu = flat[:, at.depth], flat[:, at.sigma], np.exp(flat[:, at.log_mu])
    peak = _peak_strain(chain, sigma, depth)
    noise, missed, force = public_noise(known, at, flat)
    values = {
        "sigma": sigma,
        "mu": mu,
        "r_s": depth,
        "theta_s": np.degrees(flat[:, at.angle]),
        "response": response,
        "gain": response * 1000 * mu[:, None] / peak,
        "noise_sd": noise,
        **({"discrepancy_sd": missed} if at.discrepancy else {}),
        "force_noise_sd": force,
    }
    return {name: value.reshape(*vectors.shape[:2], *value.shape[1:]) for name, value in values.items()}


def _peak_strain(chain: FingerChain, poisson_ratio: FloatArray | float, depth: FloatArray) -> FloatArray:
    """Compressive strain (..., m) directly under a knife edge of 1 N/mm at μ = 1 MPa, positive in compression.

    Arguments are Poisson's ratios (...) and sensing radii (..., m), mm.
    """
    modes = np.arange(modes_needed(float(depth.max()), chain.outer_radius_mm) + 1)
    strain = solve_body(
        modes,
        core_radius_mm=chain.core_radius_mm,
        outer_radius_mm=chain.outer_radius_mm,
        poisson_ratio=np.asarray(poisson_ratio)[..., None],
    ).radial_strain(depth)
    return np.asarray((strain[..., 0] + 2 * strain[..., 1:].sum(axis=-1)) / (2 * np.pi * chain.outer_radius_mm))
