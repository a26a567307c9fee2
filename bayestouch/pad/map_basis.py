"""The empirical map of a pad as weights of smooth functions of location, for each element.

The map of an element is a random function of location with the correlation length and the standard deviation
``amplitude_e sqrt(A² + B² K_e(x)²)`` of the map of the calibration (see `bayestouch.pad.residual_map`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.pad import PadChain
from bayestouch.chain.smooth import PlaceBasis
from bayestouch.pad.candidates import PadCandidate as CalibratedPad
from bayestouch.pad.candidates import kernel_shape

# Knots are kept where the sd of the map of an element is at least this share of its largest sd.
KEPT = 0.15
# Largest number of knots of one element.
MOST_KNOTS = 60


@dataclass(frozen=True, eq=False)
class MapBasis:
    """Smooth functions of location for each of m elements.

    Attributes
    ----------
    bases : tuple of PlaceBasis
        Functions of each element.
    amplitude : (m,) array
        Absolute signal of each element per unit load.
    everywhere, of_kernel : float
        A and B.
    shape : PadChain
        Pad with the kernels K_e.
    """

    bases: tuple[PlaceBasis, ...]
    amplitude: FloatArray
    everywhere: float
    of_kernel: float
    shape: PadChain

    @classmethod
    def of(cls, model: CalibratedPad) -> MapBasis:
        """Basis for the map of a calibrated pad, over the locations of its touches."""
        fit = model.fit
        misfit, place = fit.misfit, fit.known.location
        length = misfit.length_mm
        grid = PlaceBasis.grid(place.min(axis=0), place.max(axis=0), length, most=400)
        size = np.sqrt(misfit.misfit**2 + (misfit.relative * kernel_shape(model.shape, grid)) ** 2)
        bases = []
        for column in size.T:
            order = np.argsort(-column, kind="stable")[:MOST_KNOTS]
            bases.append(PlaceBasis.at(grid[order[column[order] >= KEPT * column.max()]], length))
        return cls(tuple(bases), misfit.amplitude, misfit.misfit, misfit.relative, model.shape)

    @property
    def n_weights(self) -> int:
        """Number of weights of all elements."""
        return sum(len(basis.knots) for basis in self.bases)

    def columns(self, place: FloatArray) -> FloatArray:
        """Sensitivity per unit of each standard normal weight at locations (t, D) in mm, (k, t, m)."""
        out = np.zeros((self.n_weights, len(place), len(self.bases)))
        first = 0
        for e, functions in enumerate(self.functions(place)):
            out[first : first + functions.shape[1], :, e] = functions.T
            first += functions.shape[1]
        return out

    def sensitivity(self, place: FloatArray, weights: FloatArray) -> FloatArray:
        """Sensitivity (t, m) that the map adds at locations (t, D) in mm."""
        return self.summed(self.functions(place), weights)

    def summed(self, functions: Sequence[FloatArray], weights: FloatArray) -> FloatArray:
        """`sensitivity`, from the `functions` at the locations."""
        first, out = 0, []
        for each in functions:
            out.append(each @ weights[first : first + each.shape[1]])
            first += each.shape[1]
        return np.stack(out, axis=1)

    def functions(self, place: FloatArray) -> list[FloatArray]:
        """Functions of each element at locations (t, D) in mm, (t, k) each."""
        shape = kernel_shape(self.shape, place)
        size = self.amplitude * np.sqrt(self.everywhere**2 + (self.of_kernel * shape) ** 2)
        return [basis(place) * size[:, e, None] for e, basis in enumerate(self.bases)]


@dataclass(frozen=True, eq=False)
class HeldMap:
    """A map with fixed weights, so that no weight is a parameter of the model.

    Attributes
    ----------
    basis : MapBasis
        Functions of the map.
    weights : (k,) array
        The fixed weights.
    place : (t, D) array
        Locations at which the sensitivity is already computed, mm.
    known : (t, m) array
        Sensitivity that the map adds at these locations.
    """

    basis: MapBasis
    weights: FloatArray
    place: FloatArray
    known: FloatArray
    n_weights: ClassVar[int] = 0

    @classmethod
    def of(cls, basis: MapBasis, weights: FloatArray, place: FloatArray) -> HeldMap:
        """The map with fixed weights (k,), and with its sensitivity at locations (t, D) in mm."""
        return cls(basis, weights, place, basis.sensitivity(place, weights))

    def columns(self, place: FloatArray) -> FloatArray:
        """No column, (0, t, m)."""
        return np.zeros((0, len(place), len(self.basis.bases)))

    def sensitivity(self, place: FloatArray, weights: FloatArray) -> FloatArray:
        """Sensitivity (t, m) that the map adds at locations (t, D) in mm; `weights` is empty."""
        return self.known if np.array_equal(place, self.place) else self.basis.sensitivity(place, self.weights)
