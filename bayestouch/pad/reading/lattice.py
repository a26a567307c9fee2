"""Lattice of locations over a pad, with a step that depends on the map of the pad."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.pad.reading.reader import PadReader

# Width of the prior of a node, in steps: with 0.6 the sum over nodes is constant to 2 exp(-2 π² 0.36) = 0.2 %.
_WIDTH = 0.6

# Largest deviation of the signal from a straight line over half a step, in standard deviations of a reading.
_CURVATURE = 0.3
_MOST_NODES = 20000


@dataclass(frozen=True, eq=False)
class Lattice:
    """Nodes over the calibrated region and one step beyond it; G nodes, D coordinates.

    Attributes
    ----------
    place : (G, D) int array
        Integer coordinates of the nodes.
    location : (G, D) array
        Locations of the nodes, mm.
    step : float
        Distance between nodes, mm.
    """

    place: IntArray
    location: FloatArray
    step: float

    @property
    def width(self) -> float:
        """Standard deviation τ of the prior of a node, mm."""
        return _WIDTH * self.step


def lattice_for(reader: PadReader) -> Lattice:
    """Lattice with a step over which the signal deviates from a straight line by less than its noise."""
    map_ = reader.map
    counts = np.ones(map_.n_elements)
    signal, variance = reader.predict(
        _grid(map_.low, map_.high, float(map_.step.min()))[1], np.array(reader.load), counts
    )
    bend = [
        np.abs(np.diff(map_.sensitivity, 2, axis=axis)).reshape(-1, map_.n_elements).max(axis=0) / map_.step[axis] ** 2
        for axis in range(map_.dimensions)
    ]
    # The curvature is largest where the signal is about half of its peak: the noise is computed at such locations. All
    # locations count for an element without a signal.
    largest = np.abs(signal).max(axis=0)
    sd = np.sqrt(
        np.array([np.median(v[np.abs(s) >= 0.3 * b]) for v, s, b in zip(variance.T, signal.T, largest, strict=True)])
    )
    curvature = np.max(bend, axis=0) * reader.load
    with np.errstate(divide="ignore", invalid="ignore"):
        steps = np.sqrt(8 * _CURVATURE * sd / curvature)
    usable = reader.usable & np.isfinite(steps)
    step = float(steps[usable].min()) if usable.any() else float((map_.high - map_.low).max())
    step = min(step, float((map_.high - map_.low).max()) / 20)
    while np.prod((map_.high - map_.low) / step + 3) > _MOST_NODES:
        step *= 1.05
    place, location = _grid(map_.low - step, map_.high + step, step)
    return Lattice(place, location, step)


def _grid(low: FloatArray, high: FloatArray, step: float) -> tuple[IntArray, FloatArray]:
    axes = [np.arange(int(np.ceil((b - a) / step)) + 1) for a, b in zip(low, high, strict=True)]
    place = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))
    return place, low + step * place
