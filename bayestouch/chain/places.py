"""Locations of touches on a pad, each of which is computed once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Places:
    """Locations of t touches with D coordinates; several touches may be at one location, with different loads.

    Attributes
    ----------
    location : (t, D) array
        Locations, mm.
    distinct : (u, D) array
        The same, each location once.
    which : (t,) int array
        Index in `distinct` of each touch.
    """

    location: FloatArray
    distinct: FloatArray
    which: IntArray

    @classmethod
    def of(cls, location: FloatArray) -> Places:
        """Locations (t, D) of touches."""
        distinct, which = np.unique(location, axis=0, return_inverse=True)
        # Where few are repeated, it takes longer to copy the values of a location to its touches than is saved.
        if len(distinct) > len(location) / 2:
            return cls(location, location, np.arange(len(location)))
        return cls(location, distinct, which.ravel())

    def values(self, of: Callable[[FloatArray], FloatArray]) -> FloatArray:
        """Values (t, ...) of a function of locations (u, D) that gives (u, ...)."""
        return self.copied(of(self.distinct))

    def copied(self, values: FloatArray) -> FloatArray:
        """Values (t, ...) at the touches from those at the distinct locations (u, ...)."""
        return values if self.distinct is self.location else values[self.which]
