"""Residuals of touches on a finger for the check of the sensor, see `bayestouch.reading.fault_tests`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import BoolArray, FloatArray, IntArray
from bayestouch.chain.noise import Noise
from bayestouch.finger.reading.covariance import CalibrationCovariance, reading_covariance
from bayestouch.finger.reading.modes import POOR, difference_steps, find_modes, hessian_at
from bayestouch.finger.reading.reader import (
    CalibratedFinger,
    FingerPosterior,
    IndenterPriors,
    TouchReadings,
    full_whitener,
    noise_whitener,
)
from bayestouch.finger.reading.reading_table import ReadingTable
from bayestouch.priors.parameters import Uniform
from bayestouch.reading.fault_tests import SensorMisfit, with_rest_errors

# Smallest share of the information of a reading that must remain after the fit of the touch. With less, the other
# columns do not predict the reading.
LEAST_DETERMINED = 0.01
# A fit within this share of the width of a prior from its end ends there.
AT_THE_END = 1e-3
# Largest load at which a touch beyond the prior is fitted, over the end of the prior.
STILL_FITTED = 4.0
# A touch that the force sensor says is beyond the prior is so if the elements say at least this share of its end: they
# may saturate. A force sensor that reads a few times too much moves ordinary touches there.
HARD = 0.5


@dataclass(frozen=True, eq=False)
class FingerMisfit:
    """Fits of touches without some of the columns; the last column is the force sensor.

    Attributes
    ----------
    chain, table, priors, noise
        The calibrated finger, reading table, priors of touches, noise.
    reading_covariance : callable
        Covariance (t, m, m) of the readings due to the calibration, from R (mm), θ_c (rad) and P (N/m).
    readings : TouchReadings
        The touches.
    typical_load : float
        Typical load, N/m.
    touch : (t,) array
        Number of each touch.
    rest_variance : (m,) array or None
        Variance of the error that all touches share by the rest reading that was subtracted; None if there is none.
    """

    chain: CalibratedFinger
    table: ReadingTable
    priors: IndenterPriors
    noise: Noise
    reading_covariance: Callable[[FloatArray, FloatArray, FloatArray], FloatArray]
    readings: TouchReadings
    typical_load: float
    touch: IntArray
    rest_variance: FloatArray | None = None

    @property
    def columns(self) -> FloatArray:
        """Readings of each column, (t, m + 1): the elements, then the force sensor (N/m)."""
        return np.concatenate([self.readings.readings, self.readings.load[:, None]], axis=1)

    @property
    def few(self) -> bool:
        """False: the neighbours of a faulty element determine the touch."""
        return False

    @property
    def scale(self) -> FloatArray:
        """Peak reading of each element at the typical load, then this load, (m + 1,)."""
        angle = np.asarray(self.chain.angle)
        # An element that was dead in the calibration has no peak: the median of the others is used.
        edges = self.chain.predict(np.zeros(len(angle)), angle, np.full(len(angle), self.typical_load))
        peak = np.abs(np.diagonal(edges))
        dead = peak < 1e-6 * max(float(peak.max()), 1e-300)
        return np.append(np.where(dead, float(np.median(peak)) or 1.0, peak), self.typical_load)

    @property
    def _discrepancy(self) -> FloatArray:
        """`SensorMisfit.discrepancy`, (m + 1,); that of the load is the median over elements."""
        share = self.noise.discrepancy_sd / self.scale[:-1]
        return np.append(share, np.median(share))

    @property
    def _with_any_load(self) -> IndenterPriors:
        """The priors, with loads far beyond those of the calibration."""
        return replace(self.priors, load=Uniform(0.0, STILL_FITTED * self.priors.load.support[1]))

    def with_order(self, order: NDArray[np.intp]) -> FingerMisfit:
        """The touches with the readings of the elements in another order."""
        touches = self.readings
        moved = replace(touches, readings=touches.readings[:, order], counts=touches.counts[:, order])
        rest = None if self.rest_variance is None else self.rest_variance[order]
        return replace(self, readings=moved, rest_variance=rest)

    def __call__(self, out: BoolArray) -> SensorMisfit:
        """Residuals of the touches, fitted without the columns `out`, a mask (m + 1,)."""
        m = self.noise.tactile_sd.shape[0]
        touches = self.readings
        touches = replace(
            touches,
            readings=np.where(out[:m], np.nan, touches.readings),
            counts=np.where(out[:m], 0, touches.counts),
            load=np.full(touches.n_touches, np.nan) if out[m] else touches.load,
        )
        harder = bool((touches.load > self.priors.load.support[1]).any())
        # Held at the end of its prior, the load would agree with neither force sensor nor elements.
        priors = self._with_any_load if harder else self.priors
        posterior = FingerPosterior(self.chain, touches, priors, noise_whitener(self.noise, touches), self.table)
        mode = find_modes(posterior)
        touch = (posterior.radius(mode[:, 0]), mode[:, 1], mode[:, 2])
        jacobian = self._calibration_jacobian(touch)
        if jacobian is None:
            covariance = self.reading_covariance(*touch)
        else:
            assert isinstance(self.reading_covariance, CalibrationCovariance)
            covariance = reading_covariance(jacobian, self.reading_covariance.covariance)
        whitener = full_whitener(self.noise, touches, covariance)
        posterior = replace(posterior, whitener=whitener)
        mode = find_modes(posterior)
        hessian = hessian_at(posterior, mode)
        signal, slope = self._expand(posterior, mode)
        weight = _weight(touches, whitener)
        # With a normal prior, the inverse covariance of all readings times their deviation from the prior prediction
        # equals the inverse covariance of the noise times their deviation from the prediction at the mode.
        values = np.nan_to_num(np.concatenate([touches.readings, touches.load[:, None]], axis=1))
        score = np.einsum("tij,tj->ti", weight, values - signal)
        pull = slope @ weight
        left = weight - pull.swapaxes(1, 2) @ np.linalg.solve(hessian, pull)
        information = np.einsum("tii->ti", left)
        within = ~self._beyond_priors(posterior, mode)[:, None]
        determined = (information > LEAST_DETERMINED * np.einsum("tii->ti", weight)) & within
        left = np.where(determined[:, :, None], left, 0.0)[:, :, :-1]
        spread = np.einsum("tak,tak->tk", slope, np.linalg.solve(hessian, slope))
        return SensorMisfit(
            score=np.where(determined, score, 0.0),
            information=np.where(determined, information, 0.0),
            signal=signal,
            signal_sd=np.sqrt(np.maximum(spread, 0.0)),
            shared=with_rest_errors(self._shared(left, jacobian, covariance), left, self.rest_variance),
            discrepancy=self._discrepancy,
            scale=self.scale,
            rest_variance=self.rest_variance,
        )

    def _beyond_priors(self, posterior: FingerPosterior, mode: FloatArray) -> BoolArray:
        """Whether a touch is beyond the priors of location and load, (t,): its fit says nothing about the sensor.

        The elements alone must say so, too, because a faulty force sensor can move a fit to the end of a prior. So can
        a faulty element, but then no harder touch explains the readings.
        """
        touches, hardest = posterior.touches, self.priors.load.support[1]
        measured = np.isfinite(touches.load)
        harder = np.where(measured, touches.load, mode[:, 2] + AT_THE_END * hardest) > hardest
        beyond = np.zeros(touches.n_touches, dtype=bool)
        rows = np.flatnonzero(harder | self._at_the_end(mode[:, 1]))
        if not len(rows):
            return beyond
        alone = touches.select(rows)
        alone = replace(alone, load=np.full(len(rows), np.nan))
        whitener = noise_whitener(self.noise, alone)
        free = replace(posterior, touches=alone, priors=self._with_any_load, whitener=whitener)
        found = find_modes(free)
        free = replace(free, whitener=posterior.whitener[rows])
        squares = (free.residual(found[:, None], np.arange(len(rows)))[:, 0].astype(np.float64) ** 2).sum(axis=1)
        explained = (found[:, 2] > hardest) & (squares < POOR * (alone.counts > 0).sum(axis=1))
        hard = harder[rows] & np.where(measured[rows], found[:, 2] > HARD * hardest, explained)
        beyond[rows] = hard | self._at_the_end(found[:, 1])
        return beyond

    def _at_the_end(self, angle: FloatArray) -> BoolArray:
        """Whether locations (t,), rad, are at an end of their prior; on a full ring there is none."""
        if self.priors.whole_turn:
            return np.zeros(len(angle), dtype=bool)
        first, last = self.priors.location.support
        return np.asarray(np.minimum(angle - first, last - angle) < AT_THE_END * (last - first))

    def _calibration_jacobian(self, touch: tuple[FloatArray, FloatArray, FloatArray]) -> FloatArray | None:
        known = self.reading_covariance
        return known.jacobian(*touch) if isinstance(known, CalibrationCovariance) else None

    def _expand(self, posterior: FingerPosterior, mode: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Readings and load (t, m + 1) at the modes, and their derivatives over the coordinates (t, 3, m + 1)."""
        steps = difference_steps(mode)
        moves = np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)])
        places = mode[:, None] + moves * steps[:, None]
        radius, load = posterior.radius(places[..., 0]), np.maximum(places[..., 2], 0.0)
        rows = self.chain.predict(radius, places[..., 1], load)
        rows = np.asarray(
            posterior.effects_chain(rows, radius, places[..., 1], load, np.arange(len(mode))), dtype=np.float64
        )
        rows = np.concatenate([rows, load[..., None]], axis=-1)
        return rows[:, 0], (rows[:, 1:4] - rows[:, 4:7]) / (2 * steps[..., None])

    def _shared(
        self, left: FloatArray, jacobian: FloatArray | None, covariance: FloatArray
    ) -> Callable[[FloatArray], FloatArray]:
        """`SensorMisfit.shared`; `left` (t, m + 1, m) is the derivative of each column's score over each reading."""
        known = self.reading_covariance
        if jacobian is None or not isinstance(known, CalibrationCovariance):
            # Only the covariance of readings of one touch is known: full correlation between touches is assumed.
            sd = np.sqrt(np.maximum(np.einsum("tai,tij,taj->ta", left, covariance, left, optimize=True), 0.0))
            return lambda direction: np.asarray((np.abs(direction) * sd).sum(axis=0) ** 2)

        def variance(direction: FloatArray) -> FloatArray:
            turned = direction[:, :, None] * left
            own = np.einsum("tai,pti->api", turned, jacobian[:3], optimize=True)
            common = np.einsum("tai,pti->ap", turned, jacobian[3:], optimize=True)
            rows = np.concatenate([own.reshape(len(own), -1), common], axis=1)
            return np.asarray(np.einsum("ai,ij,aj->a", rows, known.covariance, rows, optimize=True))

        return variance


def _weight(touches: TouchReadings, whitener: FloatArray) -> FloatArray:
    """Inverse covariance of the readings of a touch, (t, m + 1, m + 1): elements, then load."""
    t, m, _ = whitener.shape
    weight = np.zeros((t, m + 1, m + 1))
    weight[:, :-1, :-1] = whitener.swapaxes(1, 2) @ whitener
    read = np.isfinite(touches.load)
    weight[:, -1, -1] = np.where(read, 1 / np.where(read, touches.load_sd, 1.0) ** 2, 0.0)
    return weight
