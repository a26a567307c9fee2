"""Interpolation by polynomials."""

from __future__ import annotations

import numpy as np

from bayestouch.array_types import FloatArray


def lagrange(nodes: FloatArray, places: FloatArray) -> FloatArray:
    """Weights (n, s) of polynomial interpolation through `nodes` (s,) at `places` (n,).

    `scipy.interpolate.BarycentricInterpolator` is not used: it sorts the nodes at random, and two runs would differ in
    the last digits.
    """
    difference = places[:, None] - nodes
    weights = [
        np.prod(np.delete(difference, i, axis=1) / np.delete(nodes[i] - nodes, i), axis=1) for i in range(len(nodes))
    ]
    return np.stack(weights, axis=1)
