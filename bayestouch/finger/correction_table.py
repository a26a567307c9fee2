"""Empirical correction of the readings of a finger by element and location, as a table for a calibration file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.errors import InputError
from bayestouch.finger.model import finger_model
from bayestouch.model.correction import Correction, weights_of
from bayestouch.model.fitting import Fitted

PREFIX = "placed_"
MEAN = ("even", "wide", "loaded")
SPREAD = ("terms", "slope", "covariance")
#: Name of the array that files up to version 0.1 have instead of `SPREAD`: a standard deviation for each element.
SD = "sd"
# Distance between the locations of a table, degree: features of the strain are about 10° wide. The uncertainty is
# stored for every second location: the sd of a correction with a length of 5° then has an error of 0.5 % between two.
STEP_DEG, SPREAD_EVERY = 0.5, 2


@dataclass(frozen=True, eq=False)
class CorrectionTable:
    """Correction over the contact location; a locations, m elements.

    The correction is ``P (even + P R wide + P loaded)``, with P R in N and P in N/m. For given parameters of the chain,
    the coefficients at a location are normal with a mean that is linear in these parameters.

    Attributes
    ----------
    angle_deg : (a,) array
        Contact locations, equally spaced, degree.
    even, wide, loaded : (a, m) arrays
        Coefficients at the most probable parameters.
    terms : (p,) int array
        Indices of the coefficients that are uncertain; the others are zero.
    slope : (b, d, p, m) array
        Derivative of these coefficients over the d parameters of the chain, at b of the locations.
    covariance : (b, p m, p m) array
        Covariance of these coefficients, for given parameters.
    """

    angle_deg: FloatArray
    even: FloatArray
    wide: FloatArray
    loaded: FloatArray
    terms: IntArray
    slope: FloatArray
    covariance: FloatArray

    def readings(self, radius_mm: FloatArray, angle: FloatArray, load: FloatArray) -> FloatArray:
        """Correction (n, m) of touches of composite radius R (mm), location (rad) and load (N/m), all (n,)."""
        even, wide, loaded = self._at(np.degrees(angle), self.even, self.wide, self.loaded)
        share = even + (load * radius_mm / 1000)[:, None] * wide + load[:, None] * loaded
        return np.asarray(load[:, None] * share)

    def by_parameter(self, radius_mm: FloatArray, angle: FloatArray, load: FloatArray) -> FloatArray:
        """Derivative (d, n, m) of `readings` over the parameters of the chain; zero outside the table."""
        (slope,) = self._at(np.degrees(angle), self.slope)
        return np.asarray(np.einsum("pn,ndpm->dnm", self._of_term(radius_mm, load), slope, optimize=True))

    def covariance_at(self, radius_mm: FloatArray, angle: FloatArray, load: FloatArray) -> FloatArray:
        """Covariance (n, m, m) of `readings`, given the parameters of the chain; zero outside the table."""
        (covariance,) = self._at(np.degrees(angle), self.covariance)
        of_term = self._of_term(radius_mm, load)
        p, m = len(of_term), self.even.shape[1]
        blocks = covariance.reshape(-1, p, m, p, m)
        return np.asarray(np.einsum("pn,npiqj,qn->nij", of_term, blocks, of_term, optimize=True))

    def _of_term(self, radius_mm: FloatArray, load: FloatArray) -> FloatArray:
        """Factors of the uncertain coefficients, (p, n)."""
        return np.stack([load, load * load * radius_mm / 1000, load * load])[self.terms]

    def _at(self, angle_deg: FloatArray, *tables: FloatArray) -> list[FloatArray]:
        """Tables (a, ...) or (b, ...) interpolated at locations (n,), each (n, ...); zero outside the table."""
        low, high = self.angle_deg[0], self.angle_deg[-1]
        inside = (angle_deg >= low) & (angle_deg <= high)
        out = []
        for table in tables:
            last = len(table) - 1
            place = (np.asarray(angle_deg) - low) / (high - low) * last
            row = np.clip(np.floor(place), 0, last - 1).astype(np.int64)
            share, kept = (
                each.reshape(-1, *[1] * (table.ndim - 1)) for each in (np.where(inside, place - row, 0.0), inside)
            )
            out.append(np.where(kept, table[row] + share * (table[row + 1] - table[row]), 0.0))
        return out

    def arrays(self) -> dict[str, FloatArray]:
        """Arrays by name, for a file."""
        return {PREFIX + name: getattr(self, name) for name in ("angle_deg", *MEAN, *SPREAD)}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, FloatArray]) -> CorrectionTable | None:
        """Table from the arrays of a file; None if they have no correction.

        Raises
        ------
        InputError
            The correction is incomplete.
        """
        spread = (SD,) if PREFIX + SD in arrays else SPREAD
        names = ("angle_deg", *MEAN, *spread)
        missing = [PREFIX + name for name in names if PREFIX + name not in arrays]
        if not any(PREFIX + name in arrays for name in ("angle_deg", *MEAN, SD, *SPREAD)):
            return None
        if missing:
            raise InputError("missing in the correction: made by another version, calibrate again", column=missing[0])
        angle_deg, even, wide, loaded, *found = (np.asarray(arrays[PREFIX + name]) for name in names)
        terms, slope, covariance = _of_each_element(*found) if len(found) == 1 else found
        return cls(angle_deg, even, wide, loaded, terms.astype(np.int64), slope, covariance)


def _of_each_element(sd: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Arrays `SPREAD` from a standard deviation (a, m) of each element, independent of the parameters."""
    a, m = sd.shape
    return np.zeros(1), np.zeros((a, 1, 1, m)), sd[:, :, None] ** 2 * np.eye(m)


def table_of(fitted: Fitted, chosen: Correction) -> CorrectionTable:
    """The correction of a corrected fit, over the range of its touches."""
    model = finger_model(fitted.model)
    angle = model.correction_inputs(fitted.vector)[1]
    low, high = np.floor(angle.min()) - 5, np.ceil(angle.max()) + 5
    grid = np.arange(low, high + 1e-9, STEP_DEG)
    weights = weights_of(fitted)
    coefficients = correction_coefficients(chosen, grid, model.finger.outer_radius_mm, model.reference_load)
    even, wide, loaded = np.tensordot(coefficients, weights.mean, axes=(1, 0))
    terms = np.flatnonzero(coefficients.any(axis=(1, 2, 3)))
    # (b, k, p m): derivative of the uncertain coefficients over each weight
    some = coefficients[terms][:, :, ::SPREAD_EVERY].transpose(2, 1, 0, 3)
    b, k, p, m = some.shape
    flat = np.ascontiguousarray(some).reshape(b, k, p * m)
    slope = weights.slope.T @ flat
    covariance = flat.swapaxes(1, 2) @ (weights.covariance @ flat)
    # Single precision (six digits) is enough.
    return CorrectionTable(
        grid, even, wide, loaded, terms, slope.reshape(b, -1, p, m).astype(np.float32), covariance.astype(np.float32)
    )


def correction_coefficients(chosen: Correction, grid: FloatArray, outer_radius_mm: float, load: float) -> FloatArray:
    """Derivative of the three coefficients at locations (a,) over each weight, (3, k, a, m)."""
    one = np.ones(len(grid))

    def under(radius: float, load: float) -> FloatArray:
        """Correction per unit of each weight, over the load, (k, a, m)."""
        return chosen.columns(radius * one, grid, load * one) / load

    # Columns are a sum of terms in P and P²: two loads give both; an edge and a flat give the term with P R.
    edge = under(0.0, load)
    loaded = (under(0.0, 2 * load) - edge) / load
    wide = (under(outer_radius_mm, load) - edge) / (load * outer_radius_mm / 1000)
    coefficients = np.stack([edge - load * loaded, wide, loaded])
    # Differences of equal numbers leave rounding errors, which are set to zero.
    size = np.abs(coefficients).max(axis=(1, 2, 3)) * np.array([1.0, load * outer_radius_mm / 1000, load])
    coefficients[size < 1e-9 * size.max()] = 0.0
    return coefficients
