"""Smooth one-dimensional changes of variable that transform a skewed density to a normal one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from bayestouch.array_types import FloatArray

# Range and step of the nodes in the normal variable; linear outside this range.
END, STEP = 4.0, 0.125


@dataclass(frozen=True, eq=False)
class QuantileMaps:
    """Increasing maps, one for each of m coordinates, from a standard normal variable z to a value.

    Attributes
    ----------
    values, slopes : (m, n) arrays
        Value and derivative at nodes equally spaced from -`END` to `END`; cubic between them, linear outside.
    """

    values: FloatArray
    slopes: FloatArray

    @classmethod
    def of(cls, grids: list[FloatArray], weights: list[FloatArray]) -> QuantileMaps:
        """Maps from the masses `weights` of each coordinate on its grid, which has equal steps."""
        from scipy.interpolate import PchipInterpolator

        nodes = np.arange(-END, END + STEP / 2, STEP)
        values = np.empty((len(grids), len(nodes)))
        for row, grid, weight in zip(values, grids, weights, strict=True):
            # Half of the mass of a grid point is on either side of it.
            below = np.cumsum(weight) - 0.5 * weight
            kept = (below > 1e-7) & (below < 1 - 1e-7) & (weight > 1e-9)
            z, points = ndtri(below[kept]), grid[kept]
            smooth = PchipInterpolator(z, points)
            inner = np.clip(nodes, z[0], z[-1])
            ends = smooth.derivative()(inner)
            row[:] = smooth(inner) + np.maximum(ends, 1e-6) * (nodes - inner)
        return cls(values, np.asarray(PchipInterpolator(nodes, values, axis=1).derivative()(nodes)))

    def __call__(self, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Values (..., m) at z (..., m), and the log (...) of the product of the derivatives.

        NaN where z is: draws of a chain that has not found a point of the posterior.
        """
        place = np.clip((z + END) / STEP, 0.0, self.values.shape[1] - 1 - 1e-9)
        left = np.nan_to_num(place).astype(np.int64)
        t = place - left
        rows = np.arange(z.shape[-1])
        a, b = self.values[rows, left], self.values[rows, left + 1]
        p, q = STEP * self.slopes[rows, left], STEP * self.slopes[rows, left + 1]
        s = 1 - t
        value = a * s * s * (1 + 2 * t) + b * t * t * (1 + 2 * s) + p * s * s * t - q * t * t * s
        slope = (6 * s * t * (b - a) + p * s * (s - 2 * t) + q * t * (t - 2 * s)) / STEP
        return value + slope * (z - np.clip(z, -END, END)), np.log(slope).sum(axis=-1)
