"""The empirical map of a pad as weights of smooth functions of location, for each element.

The map is the random function of `bayestouch.pad.residual_map` that the calibration has. Its functions are those of
inducing touches, and so many that the rest of the map is small beside the noise of the readings: what a map leaves out
would look like a missing effect.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.pad import PadChain
from bayestouch.pad.candidates import PadCandidate as CalibratedPad
from bayestouch.pad.candidates import kernel_shape
from bayestouch.pad.inducing import InducedCovariance
from bayestouch.pad.residual_map import MapDiscrepancy

# Largest number of functions of all elements together: time increases with its square, and a fit of a thousand touches
# to eight elements takes twice as long as with a hundred functions. Each element may have the second number of
# functions in any case.
MOST_FUNCTIONS, LEAST_FUNCTIONS = 240, 20
# Largest variance of the rest of the map over that of the noise. Without repeats, effects that are still to be found
# count as noise: the rest is still small beside the noise that they leave, if its sd is a fifth.
REST = 0.001


@dataclass(frozen=True, eq=False)
class MapBasis:
    """Smooth functions of location for each of m elements.

    Attributes
    ----------
    misfit : MapDiscrepancy
        Size and correlation length of the map, and the touches among which the inducing ones are.
    covariances : tuple of InducedCovariance
        Inducing touches of each element.
    shape : PadChain
        Pad with the kernels on which the size of the map depends.
    """

    misfit: MapDiscrepancy
    covariances: tuple[InducedCovariance, ...]
    shape: PadChain

    @classmethod
    def of(cls, model: CalibratedPad, sd: FloatArray) -> MapBasis:
        """Basis for the map of a calibrated pad, whose rest is small beside a noise (m,) of one reading.

        The noise of the calibration counts if it is less: without repeats, only a scan shows how much of it is noise.
        """
        fit, counts = model.fit, model.fit.known.counts
        own = np.where(counts > 0, sd**2 / np.maximum(counts, 1), np.inf)
        variance = np.minimum(model.noise.mean_variance(counts, fit.predicted() - fit.chain.offset), own)
        most = max(MOST_FUNCTIONS // fit.known.n_elements, LEAST_FUNCTIONS)
        return cls(fit.misfit, fit.misfit.few_functions(variance, most, REST), model.shape)

    @property
    def n_weights(self) -> int:
        """Number of weights of all elements."""
        return sum(len(each.inducing) for each in self.covariances)

    def columns(self, place: FloatArray) -> FloatArray:
        """Sensitivity per unit of each standard normal weight at locations (t, D) in mm, (k, t, m)."""
        out = np.zeros((self.n_weights, len(place), len(self.covariances)))
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
        shape, pairs = kernel_shape(self.shape, place), enumerate(self.covariances)
        return [self.misfit.functions_at(e, place, shape[:, e], covariance) for e, covariance in pairs]


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
        return np.zeros((0, len(place), len(self.basis.covariances)))

    def sensitivity(self, place: FloatArray, weights: FloatArray) -> FloatArray:
        """Sensitivity (t, m) that the map adds at locations (t, D) in mm; `weights` is empty."""
        return self.known if np.array_equal(place, self.place) else self.basis.sensitivity(place, self.weights)
