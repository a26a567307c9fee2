"""A correction of a finger's readings by element and location, as a table that a calibration file holds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

PREFIX = "placed_"


@dataclass(frozen=True, eq=False)
class PlacedTable:
    """Correction over the contact location; a locations, m elements. In proportion to the load.

    Attributes
    ----------
    angle_deg : (a,) array
        Locations, equally spaced.
    even, wide : (a, m) arrays
        Readings added under 1 N/m, and those that come to them times ``P R`` in N.
    sd : (a, m) array
        Standard deviation of the addition under 1 N/m.
    """

    angle_deg: FloatArray
    even: FloatArray
    wide: FloatArray
    sd: FloatArray

    def sd_at(self, angle_deg: FloatArray) -> FloatArray:
        """Standard deviation (n, m) of what is added under 1 N/m at locations (n,); zero outside the table."""
        (sd,) = self._at(angle_deg, self.sd)
        return sd

    def _at(self, angle_deg: FloatArray, *tables: FloatArray) -> list[FloatArray]:
        """Tables (a, m) at locations (n,), each (n, m); zero outside."""
        step = self.angle_deg[1] - self.angle_deg[0]
        place = (np.asarray(angle_deg) - self.angle_deg[0]) / step
        inside = (place >= 0) & (place <= len(self.angle_deg) - 1)
        row = np.clip(np.floor(place), 0, len(self.angle_deg) - 2).astype(np.int64)
        share = np.where(inside, np.clip(place - row, 0, 1), 0.0)[:, None]
        kept = inside[:, None]
        return [np.where(kept, table[row] + share * (table[row + 1] - table[row]), 0.0) for table in tables]

    def readings(self, radius_mm: FloatArray, angle: FloatArray, load: FloatArray) -> FloatArray:
        """Readings added (n, m) to touches of composite radius R (mm), location (rad) and load (N/m), all (n,)."""
        even, wide = self._at(np.degrees(angle), self.even, self.wide)
        return np.asarray(load[:, None] * (even + (load * radius_mm / 1000)[:, None] * wide))

    def arrays(self) -> dict[str, FloatArray]:
        """By name, for a file."""
        return {PREFIX + name: getattr(self, name) for name in ("angle_deg", "even", "wide", "sd")}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, FloatArray]) -> PlacedTable | None:
        """From a file's arrays; None where they hold no correction."""
        if PREFIX + "even" not in arrays:
            return None
        return cls(**{name: np.asarray(arrays[PREFIX + name]) for name in ("angle_deg", "even", "wide", "sd")})
