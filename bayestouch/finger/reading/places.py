"""Inference of touches with functions of place: table of readings, and covariance due to the calibration."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.neighbours import Neighbours
from bayestouch.finger.place.chain import FingerWithPlaces
from bayestouch.finger.place.functions import PLACE
from bayestouch.finger.reading.covariance import reading_covariance, without_modulus
from bayestouch.finger.reading.reading_table import ANGLES, ReadingTable


def table_with_places(finger: FingerWithPlaces, low: float, high: float) -> ReadingTable:
    """Table of readings with the mean of own functions, for θ_c from `low` to `high`, rad; as `ReadingTable.of`.

    The radius of the table is the *effective* radius, see `FingerWithPlaces.effective_radius`.
    """
    table, places = ReadingTable.of(finger.elastic, low, high), finger.places
    process = places.functions.own
    if process is None:
        return table
    n_kappa, n_angles = table.shape
    first = round(table.angle_first / table.angle_step)
    columns = np.arange(first, first + n_angles) % ANGLES
    spectra = finger.elastic.spectra
    modes = np.arange(process.n_modes + 1)
    felt = np.ones((n_kappa, len(modes)))
    if places.functions.kind != PLACE:
        felt = spectra.at(np.expm1(spectra.coordinates) * spectra.kappa_scale, process.n_modes)
    weights = places.own * process.weight_sd
    cosine = np.concatenate([weights[:, :1], weights[:, 1::2]], axis=1)
    sine = np.concatenate([np.zeros((len(weights), 1)), weights[:, 2::2]], axis=1)
    rows = table.rows.reshape(n_kappa, n_angles, -1).copy()
    for e, response in enumerate(np.abs(places.response)):
        # Re Σ (a - ib) exp(ik(θ - θ_e)); the inverse transform counts the modes above zero twice.
        turned = (cosine[e] - 1j * sine[e]) * np.exp(-1j * modes * places.angle[e]) * np.where(modes == 0, 1.0, 0.5)
        around = np.fft.irfft(response * turned * felt, n=ANGLES) * ANGLES
        rows[:, :, e] += around[:, columns].astype(np.float32)
    return replace(table, rows=rows.reshape(table.rows.shape))


@dataclass(frozen=True, eq=False)
class CovarianceWithPlaces:
    """Covariance of the readings of touches due to a calibration with functions of place.

    Attributes
    ----------
    finger : FingerWithPlaces
        Calibrated finger.
    """

    finger: FingerWithPlaces

    def __call__(self, radius_mm: FloatArray, angle: FloatArray, load: FloatArray) -> FloatArray:
        """Covariance (t, m, m) for touches of composite radius R (mm), location (rad) and load (N/m), all (t,)."""
        elastic, places = self.finger.elastic, self.finger.places
        touch = (self.finger.effective_radius(radius_mm, angle), angle, load)
        jacobian, variance = places.jacobian(self._neighbours.jacobian(*touch), elastic, touch)
        covariance = reading_covariance(jacobian, places.covariance)
        index = np.arange(variance.shape[1])
        covariance[:, index, index] += variance
        return covariance

    def with_known_modulus(self) -> CovarianceWithPlaces:
        """The covariance for a known shear modulus that is independent of the other parameters."""
        places, m = self.finger.places, self.finger.elastic.n_elements
        known = replace(places, covariance=without_modulus(places.covariance, m))
        return CovarianceWithPlaces(replace(self.finger, places=known))

    def __getstate__(self) -> dict[str, object]:
        """State for a worker process, without the neighbours, see `CalibrationCovariance`."""
        return {"finger": self.finger}

    @cached_property
    def _neighbours(self) -> Neighbours:
        return Neighbours.of(self.finger.elastic)
