"""Direct identification of the E map: section 3.2, equation (6) and Table 2 of the paper.

Only linearity and superposition are assumed: every element has a row of 2 n_c + 1 numbers, fitted by least
squares (`bayestouch.body.emap.empirical_e_matrix`). The paper requires touches all the way around. If they cover only
a part of the finger, the rows of P are almost dependent, and directions of P below 1 % of the largest are omitted,
because the touches do not determine the response elsewhere. The paper does not print the number of coefficients; by
default the series ends where the response of the elastic model has fallen to 0.5 % of its maximum.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.body.emap import condition_number, empirical_e_matrix, traction_coefficients
from bayestouch.body.finger import radial_strain_response
from bayestouch.data.arrays import turned
from bayestouch.data.averages import TouchMeans
from bayestouch.data.sensor import Finger, Sensor, finger_of
from bayestouch.errors import InputError
from bayestouch.paper.simplex.summary import summary

SMALLEST_SINGULAR_VALUE = 0.01
SMALLEST_RESPONSE = 0.005
POISSON_RATIO = 0.46
"""Mean of the elements in Table 1."""
REACH_DEG = 15.0
"""An element is identified if a knife edge is at most this far from it, degree."""


@dataclass(frozen=True, eq=False)
class EmpiricalTable:
    """Directly identified E map of all elements: Table 2.

    Attributes
    ----------
    error_percent_peak : (m,) array
        Root mean square of reading minus fit over all fitted touches, in % of the peak: the fitted reading
        directly under a knife edge with the mean load.
    held_out_percent_peak : (m,) array
        The same for touches held out one at a time (leave-one-out prediction).
    noise_percent_peak : (m,) array
        Standard deviation of one reading; NaN without repeated readings.
    map : (m, 2 n_c + 1) array
        E in readings per MPa of the traction coefficients ``p_0, p_1^s, p_1^c, …`` (tension positive); NaN for
        an element without enough readings, or with zeros only.
    response : (m,) array
        Largest reading per N/m of a knife edge on the part of the finger that was touched.
    rank : int
        Number of directions of the pressures that were used.
    """

    error_percent_peak: FloatArray
    held_out_percent_peak: FloatArray
    noise_percent_peak: FloatArray
    map: FloatArray
    response: FloatArray
    rank: int

    def summary(self, quantity: str) -> tuple[float, float, float]:
        """Return minimum, mean and maximum over the elements of one of the arrays, without NaN."""
        return summary(getattr(self, quantity))

    @property
    def condition_number(self) -> float:
        """Ratio of largest to smallest singular value of the map, with the peak of every element scaled to 1."""
        fitted = np.isfinite(self.response)
        return condition_number(self.map[fitted] / self.response[fitted, None])


def coefficients_needed(finger: Finger) -> int:
    """Return the Fourier mode n_c above which the response of the designed finger is below 0.5 % of its maximum."""
    modes = np.arange(400)
    strain = np.abs(
        radial_strain_response(
            modes,
            finger.sensing_radius_mm,
            core_radius_mm=finger.core_radius_mm,
            outer_radius_mm=finger.outer_radius_mm,
            poisson_ratio=POISSON_RATIO,
        )
    )
    return int(np.flatnonzero(strain > SMALLEST_RESPONSE * strain.max())[-1]) + 1


def table_2(means: TouchMeans, sensor: Sensor, *, n_coefficients: int | None = None) -> EmpiricalTable:
    """Return the E map of a finger identified from knife edges (section 3.2).

    Parameters
    ----------
    means : TouchMeans
        Averaged calibration touches with the no-contact reading subtracted.
    sensor : Sensor
        A finger.
    n_coefficients : int, optional
        Highest Fourier coefficient n_c; `coefficients_needed` by default.

    Raises
    ------
    InputError
        If there are too few knife edges.
    """
    finger = finger_of(sensor, "the empirical map of Table 2")
    if means.angle_deg is None:
        raise InputError("the empirical map needs angle_deg")
    rows = (means.indenter_radius_mm == 0) & np.isfinite(means.load) & np.isfinite(means.angle_deg)
    if not rows.any():
        raise InputError("no touch with a known load and location is a knife edge (indenter_radius_mm = 0)")
    n_c = coefficients_needed(finger) if n_coefficients is None else n_coefficients
    angle, load, data = means.angle_deg[rows], means.load[rows] / 1000, means.readings[rows]
    p = traction_coefficients(np.ones(n_c + 1), angle, load, outer_radius_mm=finger.outer_radius_mm)
    left, values, _ = np.linalg.svd(p, full_matrices=False)
    kept = left[:, values > SMALLEST_SINGULAR_VALUE * values[0]]
    reduced = kept.T @ p
    rank = len(reduced)
    off = turned(angle[:, None] - np.array(finger.element_angles_deg))
    there = np.isfinite(data)
    enough = (there.sum(axis=0) > rank) & (there & (np.abs(off) < REACH_DEG)).any(axis=0)
    enough &= np.nan_to_num(data).any(axis=0)  # no peak to scale by if all readings are zero
    if not enough.any():
        raise InputError(
            f"no element has more than {rank} knife edges (the number of coefficients that they determine), one of "
            f"them within {REACH_DEG:g} degrees, and readings other than zero"
        )
    identified = np.full((finger.n_elements, 2 * n_c + 1), np.nan)
    identified[enough] = empirical_e_matrix(reduced, data[:, enough].T) @ kept.T
    residual = data - (identified @ p).T
    unit = traction_coefficients(
        np.ones(n_c + 1), angle, np.full(len(angle), 1e-3), outer_radius_mm=finger.outer_radius_mm
    )
    response = np.abs(identified @ unit).max(axis=1)
    peak = response * 1000 * load.mean()
    left_out = np.stack([_left_out(reduced, column) for column in residual.T], axis=1)
    return EmpiricalTable(
        error_percent_peak=_rms(residual) / peak * 100,
        held_out_percent_peak=_rms(left_out) / peak * 100,
        noise_percent_peak=np.sqrt(means.pure_error_variance) / peak * 100,
        map=identified,
        response=response,
        rank=rank,
    )


def _left_out(design: FloatArray, residual: FloatArray) -> FloatArray:
    """Residuals of leave-one-out predictions: the residuals divided by one minus their leverage."""
    there = np.isfinite(residual)
    if not there.any():
        return residual
    orthogonal, _ = np.linalg.qr(design[:, there].T)
    out = np.full(len(residual), np.nan)
    out[there] = residual[there] / (1 - (orthogonal**2).sum(axis=1))
    return out


def _rms(residual: FloatArray) -> FloatArray:
    """Root mean square of each column without NaN; NaN if all values are NaN."""
    there = np.isfinite(residual)
    total = np.where(there, residual, 0.0) ** 2
    count = there.sum(axis=0)
    mean = np.divide(total.sum(axis=0), count, out=np.full(len(count), np.nan), where=count > 0)
    return np.asarray(np.sqrt(mean))
