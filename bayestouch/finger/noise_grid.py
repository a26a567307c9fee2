"""Grids that follow the width of a density."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bayestouch.array_types import FloatArray

# Largest mass of a point: the step is then below 1.5 standard deviations, and the sum of a normal density differs from
# its integral by 2e-4. Largest number of grids that are tried.
MOST_ON_A_POINT, FINER = 0.6, 12


def masses_on_grid(
    axes: list[FloatArray], log_density: Callable[[list[FloatArray]], FloatArray]
) -> tuple[list[FloatArray], FloatArray]:
    """Grid and masses of a density on it; an axis with most of its mass on one point is made finer there.

    A stated prior may be narrower than the steps of the first grid.
    """
    for left in reversed(range(FINER)):
        log = log_density(axes)
        mass = np.exp(log - log.max())
        mass /= mass.sum()
        by_axis = [mass.sum(axis=tuple(j for j in range(len(axes)) if j != i)) for i in range(len(axes))]
        coarse = [own.max() > MOST_ON_A_POINT for own in by_axis]
        if not any(coarse) or not left:
            break
        axes = [_around(axis, own) if here else axis for axis, own, here in zip(axes, by_axis, coarse, strict=True)]
    return axes, mass


def _around(axis: FloatArray, mass: FloatArray) -> FloatArray:
    """Axis with the same number of points, over the points with mass and one step on either side."""
    some, step = np.flatnonzero(mass > 1e-9), axis[1] - axis[0]
    return np.linspace(axis[some[0]] - step, axis[some[-1]] + step, len(axis))
