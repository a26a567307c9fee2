"""Errors of each element's E map as touches feel them: smoothed by the pressure under the indenter.

An edge feels the error as it is, a blunt indenter on soft rubber hardly any of its short waves. How much of each wave
is felt depends on P R alone. It is interpolated by a polynomial in P R, so that a table of the readings over the
location at a few values of P R holds these functions exactly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.finger import FingerChain
from bayestouch.finger.interpolation import lagrange
from bayestouch.finger.place.functions import Process, fourier, per_weight

# Number of values of P R. On the softest finger known (0.054 MPa, P R/μ up to 47 mm²) waves shorter than 18° err by
# less than 3 % of their size under an edge, longer ones by less than 0.4 %.
NODES = 5


@dataclass(frozen=True, eq=False)
class FeltMap:
    """A smooth function of the angle from element to touch for each element, as touches feel it; k weights, q nodes.

    Attributes
    ----------
    process : Process
        Prior of the functions.
    nodes : (q,) array
        Values of P R, N.
    felt : (q, n + 1) array
        Share of each Fourier mode that touches with these P R feel.
    """

    process: Process
    nodes: FloatArray
    felt: FloatArray

    @classmethod
    def of(cls, chain: FingerChain, length_deg: float, largest_load: float) -> FeltMap:
        """Functions of a correlation length, felt by touches up to a flat under the largest load (N/m)."""
        process = Process(length_deg, 1.0)
        nodes = chebyshev(chain.outer_radius_mm * largest_load / 1000)
        return cls(process, nodes, chain.spectra.at(nodes / chain.shear_modulus_MPa, process.n_modes))

    def __call__(self, radius_mm: FloatArray, load: FloatArray, away_deg: FloatArray) -> FloatArray:
        """Functions (t, m, k) for touches of radius R (mm) and load (N/m), (t,), at angles (t, m) from the elements."""
        shares = per_weight(shares_of_nodes(self.nodes, load * radius_mm / 1000) @ self.felt)
        return fourier(np.radians(away_deg), self.process.n_modes) * (shares * self.process.weight_sd)[:, None]


def chebyshev(highest: float) -> FloatArray:
    """Nodes from zero to `highest`, between which a polynomial is well determined."""
    return np.asarray(0.5 * highest * (1 - np.cos(np.pi * np.arange(NODES) / (NODES - 1))))


def shares_of_nodes(nodes: FloatArray, at: FloatArray) -> FloatArray:
    """Shares (t, q) of the nodes' values in the polynomial through them, at P R (t,); constant beyond the last node."""
    within = np.clip(at, nodes[0], nodes[-1])
    return lagrange(nodes, within)
