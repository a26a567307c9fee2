"""Empirical correction of the readings of a finger by element and location, as a table for a calibration file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.errors import InputError
from bayestouch.finger.model import finger_model
from bayestouch.model.correction import Correction, weights_of
from bayestouch.model.fitting import Fitted

PREFIX = "placed_"
NAMES = ("angle_deg", "even", "wide", "loaded", "sd")
# Distance between the locations of a table, degree: features of the strain are about 10° wide.
STEP_DEG = 0.5


@dataclass(frozen=True, eq=False)
class CorrectionTable:
    """Correction over the contact location; a locations, m elements.

    Attributes
    ----------
    angle_deg : (a,) array
        Contact locations, equally spaced, degree.
    even, wide, loaded : (a, m) arrays
        The correction is ``P (even + wide P R + loaded P)``, with P in N/m and ``P R`` in N.
    sd : (a, m) array
        Standard deviation of the correction per N/m.
    """

    angle_deg: FloatArray
    even: FloatArray
    wide: FloatArray
    loaded: FloatArray
    sd: FloatArray

    def sd_at(self, angle_deg: FloatArray) -> FloatArray:
        """Standard deviation (n, m) of the correction per N/m at locations (n,), degree; zero outside the table."""
        (sd,) = self._at(angle_deg, self.sd)
        return sd

    def _at(self, angle_deg: FloatArray, *tables: FloatArray) -> list[FloatArray]:
        """Tables (a, m) interpolated at locations (n,), each (n, m); zero outside the table."""
        step = self.angle_deg[1] - self.angle_deg[0]
        place = (np.asarray(angle_deg) - self.angle_deg[0]) / step
        inside = (place >= 0) & (place <= len(self.angle_deg) - 1)
        row = np.clip(np.floor(place), 0, len(self.angle_deg) - 2).astype(np.int64)
        share = np.where(inside, np.clip(place - row, 0, 1), 0.0)[:, None]
        kept = inside[:, None]
        return [np.where(kept, table[row] + share * (table[row + 1] - table[row]), 0.0) for table in tables]

    def readings(self, radius_mm: FloatArray, angle: FloatArray, load: FloatArray) -> FloatArray:
        """Correction (n, m) of touches of composite radius R (mm), location (rad) and load (N/m), all (n,)."""
        even, wide, loaded = self._at(np.degrees(angle), self.even, self.wide, self.loaded)
        share = even + (load * radius_mm / 1000)[:, None] * wide + load[:, None] * loaded
        return np.asarray(load[:, None] * share)

    def arrays(self) -> dict[str, FloatArray]:
        """Arrays by name, for a file."""
        return {PREFIX + name: getattr(self, name) for name in NAMES}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, FloatArray]) -> CorrectionTable | None:
        """Table from the arrays of a file; None if they have no correction.

        Raises
        ------
        InputError
            The correction is incomplete.
        """
        missing = [PREFIX + name for name in NAMES if PREFIX + name not in arrays]
        if len(missing) == len(NAMES):
            return None
        if missing:
            raise InputError("missing in the correction: made by another version, calibrate again", column=missing[0])
        return cls(**{name: np.asarray(arrays[PREFIX + name]) for name in NAMES})


def table_of(fitted: Fitted, chosen: Correction) -> CorrectionTable:
    """The correction of a corrected fit, over the range of its touches."""
    model = finger_model(fitted.model)
    angle = model.correction_inputs(fitted.vector)[1]
    grid = np.arange(np.floor(angle.min()) - 5, np.ceil(angle.max()) + 5 + 1e-9, STEP_DEG)
    weights, covariance = weights_of(fitted)
    one, outer, load = np.ones(len(grid)), model.finger.outer_radius_mm, model.reference_load

    def under(radius: float, load: float) -> FloatArray:
        """Correction over the load, (a, m)."""
        columns = chosen.columns(radius * one, grid, load * one)
        return np.asarray(np.tensordot(weights, columns, axes=1) / load)

    edge = chosen.columns(0 * one, grid, load * one) / load
    even = under(0.0, load)
    # Columns are a sum of terms in P and P²: two loads give both.
    loaded = (under(0.0, 2 * load) - even) / load
    wide = (under(outer, load) - even) / (load * outer / 1000)
    variance = np.einsum("kam,kl,lam->am", edge, covariance, edge, optimize=True)
    return CorrectionTable(grid, even - load * loaded, wide, loaded, np.sqrt(np.maximum(variance, 0.0)))
