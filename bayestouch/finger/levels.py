"""Interpolation of signals for an effect with a basis: each touch depends on its values through one number."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.finger.local_series import REACH
from bayestouch.finger.model import FingerModel
from bayestouch.model.base import evenly


@dataclass(frozen=True, eq=False)
class Levels:
    """Interpolation in the number through which each touch depends on q values of an effect; l levels, t touches.

    Attributes
    ----------
    places : (q,) int array
        Positions of the values in the vector.
    basis : (t, q) array
        Derivative of the number of each touch over the values, see `Effect.by_place`.
    centre, sd : (q,) arrays
        Middle and standard deviation of the values.
    half_width : (q,) array
        Change of the values by which the number of each touch changes by about four standard deviations.
    nodes : (l,) array
        Levels, from -1 to 1: all values at `centre` plus this times `half_width`.
    """

    places: IntArray
    basis: FloatArray
    centre: FloatArray
    sd: FloatArray
    half_width: FloatArray
    nodes: FloatArray

    @classmethod
    def of(cls, model: FingerModel, centre: FloatArray, sd: FloatArray, count: int) -> Levels | None:
        """Levels about a vector (d,) with standard deviations (d,), of the first effect with a basis; None without."""
        found = _with_basis(model, centre)
        if found is None:
            return None
        places, basis = found
        spread = np.sqrt(basis**2 @ sd[places] ** 2)
        half = evenly(basis, REACH * spread)
        if not np.all(basis @ half > 0.5 * REACH * spread):
            half = evenly(basis, np.full(len(basis), REACH * spread.max()))
        nodes = np.cos(np.pi * (np.arange(count) + 0.5) / count)
        return cls(places, basis, centre[places], sd[places], half, nodes)

    def vectors(self, vectors: FloatArray) -> list[FloatArray]:
        """The vectors (n, d) with the values at each level."""
        out = []
        for node in self.nodes:
            moved = vectors.copy()
            moved[:, self.places] = self.centre + node * self.half_width
            out.append(moved)
        return out

    def place(self, vectors: FloatArray) -> FloatArray:
        """Coordinate (n, t) of the touches between the levels, for vectors (n, d); -1 to 1 within their range."""
        half = self.basis @ self.half_width
        return np.asarray(((vectors[:, self.places] - self.centre) @ self.basis.T) / np.where(half == 0, 1.0, half))

    def between(self, at_levels: Sequence[FloatArray], place: FloatArray) -> FloatArray:
        """Signals (n, t, m) at `place` (n, t), from those at each level."""
        out = np.zeros_like(at_levels[0])
        for i, signals in enumerate(at_levels):
            others = np.delete(self.nodes, i)
            weight = np.prod((place[..., None] - others) / (self.nodes[i] - others), axis=-1)
            out += weight[..., None] * signals
        return out


def _with_basis(model: FingerModel, vector: FloatArray) -> tuple[IntArray, FloatArray] | None:
    """Positions of the values of the first effect on finger or pose that acts through a basis, and the basis."""
    place = model.n_base
    for effect in model.effects:
        places = place + np.arange(len(effect.parameters))
        if effect.changes_pose or effect.changes_finger:
            basis = effect.by_place(model.poses(vector))
            if basis is not None:
                return places, basis
        place += len(effect.parameters)
    return None
