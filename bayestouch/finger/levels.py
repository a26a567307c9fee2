"""Interpolation of signals for an effect with a basis: each touch depends on its values through one number."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.effects.effect import Effect
from bayestouch.finger.local_series import REACH
from bayestouch.finger.model import FingerModel


@dataclass(frozen=True, eq=False)
class Levels:
    """Interpolation in the number through which each touch depends on q values of an effect; l levels, t touches.

    Attributes
    ----------
    effect : Effect
        The effect, with a basis.
    places : (q,) int array
        Positions of its values in the vector.
    basis : (t, q) array
        Derivative of the number of each touch over the values, see `Effect.by_place`.
    centre, sd : (q,) arrays
        Middle and standard deviation of the values.
    nodes : (l,) array
        Levels, from -1 to 1, in units of the reach of each touch.
    """

    effect: Effect
    places: IntArray
    basis: FloatArray
    centre: FloatArray
    sd: FloatArray
    nodes: FloatArray

    @classmethod
    def all_of(cls, model: FingerModel, centre: FloatArray, sd: FloatArray, count: int) -> tuple[Levels, ...]:
        """Levels about a vector (d,) with standard deviations (d,), of each effect with a basis; most values first.

        The first has `count` levels. The others have two: signals are linear in their numbers.
        """
        found, place = list[tuple[Effect, IntArray, FloatArray]](), model.n_base
        for effect in model.effects:
            places = place + np.arange(len(effect.parameters))
            place += len(places)
            if (basis := model.basis_of(effect, centre)) is not None:
                found.append((effect, places, basis))
        found.sort(key=lambda each: -len(each[1]))
        return tuple(
            cls(effect, places, basis, centre[places], sd[places], chebyshev_nodes(2 if number else count))
            for number, (effect, places, basis) in enumerate(found)
        )

    @property
    def reach(self) -> FloatArray:
        """Four standard deviations (t,) of the number of each touch."""
        return np.asarray(np.maximum(REACH * np.sqrt(self.basis**2 @ self.sd**2), 1e-300))

    def models(self, model: FingerModel) -> list[FingerModel]:
        """The model at each level, for vectors whose values of the effect are at `centre`."""
        return [model.shifted(self.effect, node * self.reach) for node in self.nodes]

    def place(self, vectors: FloatArray) -> FloatArray:
        """Coordinate (n, t) of the touches between the levels, for vectors (n, d); -1 to 1 within their range."""
        return np.asarray(((vectors[:, self.places] - self.centre) @ self.basis.T) / self.reach)

    def between(self, at_levels: Sequence[FloatArray], place: FloatArray) -> FloatArray:
        """Signals (n, t, m) at `place` (n, t), from those at each level."""
        out = np.zeros_like(at_levels[0])
        for i, signals in enumerate(at_levels):
            others = np.delete(self.nodes, i)
            weight = np.prod((place[..., None] - others) / (self.nodes[i] - others), axis=-1)
            out += weight[..., None] * signals
        return out


def chebyshev_nodes(count: int) -> FloatArray:
    """Points (count,) between -1 and 1 at which an interpolation is good to nearly the best."""
    return np.asarray(np.cos(np.pi * (np.arange(count) + 0.5) / count))
