"""Basis of the empirical correction of a pad: smooth functions of the location, proportional to the load.

It has three parts: functions of the distance to the element, shared by all elements; functions of the location for each
element; and, if loads vary, these functions of the location times the square of the load.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.pad import PadChain
from bayestouch.chain.recording import Recording
from bayestouch.chain.smooth import PlaceBasis, SmoothBasis
from bayestouch.data.loads import loads_vary
from bayestouch.model.fitting import spread_over_elements
from bayestouch.pad.table import kernel_width

# Correlation lengths of the functions over the width of the kernel.
SHARED_LENGTH, OWN_LENGTH = 0.5, 1.0
# Largest number of knots of one element.
MOST_KNOTS = 64


@dataclass(frozen=True, eq=False)
class PadCorrectionBasis:
    """Basis of the correction for one pad; m elements, D coordinates.

    Attributes
    ----------
    position : (m, D) array
        Positions of the elements, mm.
    peak : (m,) array
        Absolute reading of each element under the reference load.
    reference_load : float
        Reference load, N.
    loads_vary : bool
        Whether loads differ, so that the square of the load can be distinguished from the load.
    shared : SmoothBasis
        Functions of the distance between element and touch, mm.
    own : tuple of PlaceBasis
        Functions of the location, for each element.
    """

    position: FloatArray
    peak: FloatArray
    reference_load: float
    loads_vary: bool
    shared: SmoothBasis
    own: tuple[PlaceBasis, ...]

    @classmethod
    def of(cls, chain: PadChain, peak: FloatArray, reference_load: float, recording: Recording) -> PadCorrectionBasis:
        """Basis over the region that the touches of a recording cover."""
        place = np.stack(recording.place, axis=1)
        extent = float(np.ptp(place, axis=0).max())
        width = min(kernel_width(chain, extent), 0.5 * extent)
        farthest = float(np.sqrt(((place[:, None] - chain.position) ** 2).sum(axis=-1)).max())
        grid = PlaceBasis.grid(place.min(axis=0), place.max(axis=0), OWN_LENGTH * width, most=600)
        own = []
        for position in chain.position:
            near = np.argsort(((grid - position) ** 2).sum(axis=1), kind="stable")[:MOST_KNOTS]
            own.append(PlaceBasis.at(grid[near], OWN_LENGTH * width))
        return cls(
            position=chain.position,
            peak=peak,
            reference_load=reference_load,
            loads_vary=loads_vary(recording.load),
            shared=SmoothBasis.of(0.0, farthest, SHARED_LENGTH * width),
            own=tuple(own),
        )

    def columns(self, *where: FloatArray) -> dict[str, FloatArray]:
        """Readings per unit weight for touches at locations (t, D) in mm under loads (t,) in N.

        The arrays of the parts are (k, t, m), for size 1.
        """
        place, load = where
        share = load / self.reference_load
        distance = np.sqrt(((place[:, None] - self.position) ** 2).sum(axis=-1))
        scale = share[:, None] * self.peak
        shared = spread_over_elements(np.moveaxis(self.shared(distance), -1, 0), scale, own=False)
        parts = []
        for e, basis in enumerate(self.own):
            functions = basis(place)
            column = np.zeros((functions.shape[1], *scale.shape))
            column[:, :, e] = functions.T * scale[:, e]
            parts.append(column)
        own = np.concatenate(parts)
        if not self.loads_vary:
            return {"shared": shared, "own": own}
        return {"shared": shared, "own": own, "loaded": own * share[None, :, None]}
