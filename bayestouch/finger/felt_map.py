"""Errors of the E map of each element, smoothed by the pressure under the indenter.

Under an edge the error changes the readings without smoothing. A blunt indenter on soft rubber removes nearly all of
its short waves. The share of each wave that remains depends only on P R. It is interpolated by a polynomial in P R, so
that a table of the readings over the location, at a few values of P R, represents these functions exactly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.finger import FingerChain
from bayestouch.finger.interpolation import lagrange
from bayestouch.finger.place.functions import Process, fourier, per_weight

# Number of values of P R. On the softest finger known (0.054 MPa, P R/μ up to 47 mm²) the interpolation error of waves
# shorter than 18° is less than 3 % of their size under an edge, that of longer waves less than 0.4 %.
NODES = 5


@dataclass(frozen=True, eq=False)
class FeltMap:
    """Functions of the angle from element to touch, smoothed by the pressure of the touch; k weights, q nodes.

    Attributes
    ----------
    process : Process
        Prior of the functions.
    nodes : (q,) array
        Values of P R, N.
    felt : (q, n + 1) array
        Share of each Fourier mode that remains for touches with these P R.
    """

    process: Process
    nodes: FloatArray
    felt: FloatArray

    @classmethod
    def of(cls, chain: FingerChain, length_deg: float, largest_load: float) -> FeltMap:
        """Functions with a correlation length (degree), for touches up to a flat under the largest load (N/m)."""
        process = Process(length_deg, 1.0)
        nodes = chebyshev(chain.outer_radius_mm * largest_load / 1000)
        return cls(process, nodes, chain.spectra.at(nodes / chain.shear_modulus_MPa, process.n_modes))

    def __call__(self, radius_mm: FloatArray, load: FloatArray, away_deg: FloatArray) -> FloatArray:
        """Functions (t, m, k) for touches of radius R (mm) and load (N/m), (t,), at angles (t, m) from the elements."""
        shares = per_weight(shares_of_nodes(self.nodes, load * radius_mm / 1000) @ self.felt)
        return fourier(np.radians(away_deg), self.process.n_modes) * (shares * self.process.weight_sd)[:, None]


def chebyshev(highest: float) -> FloatArray:
    """Chebyshev nodes from zero to `highest`, both included; (`NODES`,)."""
    return np.asarray(0.5 * highest * (1 - np.cos(np.pi * np.arange(NODES) / (NODES - 1))))


def shares_of_nodes(nodes: FloatArray, at: FloatArray) -> FloatArray:
    """Weights (t, q) of polynomial interpolation between the nodes (q,), at P R (t,); constant beyond the nodes."""
    within = np.clip(at, nodes[0], nodes[-1])
    return lagrange(nodes, within)
