"""Strain directly under a knife edge. The gain of an element is its response over this strain."""

from __future__ import annotations

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.body.finger import solve_body
from bayestouch.chain.finger import FingerChain
from bayestouch.chain.response import modes_needed


def peak_strain(chain: FingerChain, poisson_ratio: FloatArray | float, depth: FloatArray) -> FloatArray:
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
