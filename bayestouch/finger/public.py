"""Calibration parameters of a finger by public name and in public units, from flat vectors."""

from __future__ import annotations

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.finger.fit import FingerFit
from bayestouch.finger.noise import public_noise
from bayestouch.finger.peak_strain import peak_strain


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


def linear_vectors(fit: FingerFit, vectors: FloatArray) -> FloatArray:
    """Flat vectors (n, 3 m + 2) of the parameters of the chain, with responses instead of their logarithms."""
    at = fit.likelihood.layout
    linear = vectors.reshape(-1, vectors.shape[-1])[:, : at.n_chain].copy()
    linear[:, at.response] = fit.likelihood.sign * np.exp(linear[:, at.response])
    return linear


def public_draws(fit: FingerFit, vectors: FloatArray) -> dict[str, FloatArray]:
    """Draws of every parameter and of the gains, by name, (chain, draw[, m]), from flat vectors (chain, draw, d)."""
    at = fit.likelihood.layout
    flat = vectors.reshape(-1, vectors.shape[-1])
    response = fit.likelihood.sign * np.exp(flat[:, at.response])
    depth, sigma, mu = flat[:, at.depth], flat[:, at.sigma], np.exp(flat[:, at.log_mu])
    peak = peak_strain(fit.chain, sigma, depth)
    noise, missed, force = public_noise(fit.likelihood.known, at, flat)
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
