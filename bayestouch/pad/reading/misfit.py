"""Residuals of touches on a pad for the check of the sensor, see `bayestouch.reading.fault_tests`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray, IndexArray, IntArray
from bayestouch.data.averages import TouchMeans
from bayestouch.pad.reading.components import components_of
from bayestouch.pad.reading.lattice import Lattice
from bayestouch.pad.reading.reader import PadReader, PadTouches
from bayestouch.reading.fault_tests import SensorMisfit, with_rest_errors
from bayestouch.sampling.laplace import damped_newton_steps
from bayestouch.sampling.rank_one import shared_directions

# A reading is tested if the fit of its touch leaves more than this share of the information of the reading (as on a
# finger).
LEAST_DETERMINED = 0.01
_ITERATIONS = 12


@dataclass(frozen=True, eq=False)
class PadMisfit:
    """Fits touches without some of the columns; the last column is the force sensor.

    Attributes
    ----------
    reader : PadReader
        The calibrated pad.
    lattice : Lattice
        Locations from which the search for a touch starts.
    readings : TouchMeans
        The touches.
    order : (m,) array
        Column of the table with the readings of each element.
    in_order : callable
        The same touches with another `order`. Effects differ between elements: readings are exchanged before they are
        corrected.
    rest_variance : (m,) array or None
        Variance of the error that all touches share by the rest reading that was subtracted; None if there is none.
    """

    reader: PadReader
    lattice: Lattice
    readings: TouchMeans
    order: IndexArray
    in_order: Callable[[IndexArray], TouchMeans]
    rest_variance: FloatArray | None = None

    @property
    def touch(self) -> IntArray:
        """Number of each touch, (t,)."""
        return self.readings.touch

    @property
    def columns(self) -> FloatArray:
        """Readings of each column, (t, m + 1): the elements minus their offsets, then the force sensor (N)."""
        readings = self.readings
        return np.concatenate([readings.readings - self.reader.map.offset, readings.load[:, None]], axis=1)

    @property
    def few(self) -> bool:
        """True: only two or three elements determine the location of a touch."""
        return True

    @property
    def scale(self) -> FloatArray:
        """Largest reading of each element on the pad under the mean load, then this load, (m + 1,)."""
        sensitivity = self.reader.map.sensitivity
        peak = self.reader.load * np.abs(sensitivity).reshape(-1, sensitivity.shape[-1]).max(axis=0)
        usable = self.reader.usable & (peak > 0)
        fellows = float(np.median(peak[usable])) if usable.any() else 1.0
        return np.append(np.where(usable, peak, fellows), self.reader.load)

    @property
    def _discrepancy(self) -> FloatArray:
        """`SensorMisfit.discrepancy`, (m + 1,); that of the load is the median over elements."""
        noise = self.reader.noise
        share = np.hypot(noise.discrepancy_sd / self.scale[:-1], noise.signal_share)
        return np.append(share, np.median(share))

    def with_order(self, order: IndexArray) -> PadMisfit:
        """The touches with the readings of the elements in another order."""
        columns = self.order[order]
        rest = None if self.rest_variance is None else self.rest_variance[order]
        return replace(self, readings=self.in_order(columns), order=columns, rest_variance=rest)

    def __call__(self, out: BoolArray) -> SensorMisfit:
        """Residuals of the touches, fitted without the columns `out`, a mask (m + 1,)."""
        reader, m = self.reader, self.reader.map.n_elements
        touches = replace(
            self.readings,
            counts=np.where(out[:m], 0, self.readings.counts),
            load=np.full(self.readings.n_touches, np.nan) if out[m] else self.readings.load,
        )
        with_effects = reader.touches(touches)
        # The uncertainty of the values of effects counts as an error that readings share, like that of the map.
        known = replace(with_effects, changes=None)
        read = np.isfinite(touches.load) & reader.load_measured
        x = np.empty((known.n_touches, reader.map.dimensions + 1))
        for some in known.of_each_kind:
            x[some] = _modes(reader, known.select(some), self.lattice)
        signal, slope, of_readings = _expand(reader, known, x)
        hessian = _precision(reader, known, slope, of_readings)
        weight = np.zeros((len(x), m + 1, m + 1))
        weight[:, :m, :m] = of_readings
        weight[:, m, m] = np.where(read, 1 / known.felt_sd**2, 0.0)
        values = np.where(known.present, known.readings - reader.map.offset, 0.0)
        values = np.concatenate([values, known.load[:, None]], axis=1)
        rows = np.concatenate([signal, x[:, -1:]], axis=1)
        by_load = np.zeros((*slope.shape[:2], 1))
        by_load[:, -1] = 1.0
        slope = np.concatenate([slope, by_load], axis=2)
        pull = slope @ weight
        left = weight - pull.swapaxes(1, 2) @ np.linalg.solve(hessian, pull)
        information, own = (np.einsum("tii->ti", each) for each in (left, weight))
        # A touch at the limit of the calibrated region may be outside it, where the prediction is not known.
        inner = np.all((x[:, :-1] > reader.map.low) & (x[:, :-1] < reader.map.high), axis=1, keepdims=True)
        determined = (information > LEAST_DETERMINED * own) & (own > 0) & inner
        left = np.where(determined[:, :, None], left, 0.0)[:, :, :m]
        spread = np.einsum("tak,tak->tk", slope, np.linalg.solve(hessian, slope))
        _, open_, covariance = reader.map.at(x[:, :-1], x[:, -1])
        uncertain = reader.map.reading_variance(open_, covariance, x[:, -1])
        if with_effects.changes is not None:
            lasting = replace(with_effects, by_noise=None)
            changes = reader.changes(lasting, x[:, None], np.arange(len(x)), signal[:, None])[:, 0, :, :-1]
            uncertain = uncertain + (changes**2).sum(axis=1)
        # Correlations of errors of the map between locations are not known here: full correlation is assumed.
        sd = np.sqrt(np.einsum("tai,ti->ta", left**2, uncertain))

        def shared(direction: FloatArray) -> FloatArray:
            return np.asarray((np.abs(direction) * sd).sum(axis=0) ** 2)

        return SensorMisfit(
            score=np.where(determined, np.einsum("tij,tj->ti", weight, values - rows), 0.0),
            information=np.where(determined, information, 0.0),
            signal=rows,
            signal_sd=np.sqrt(np.maximum(spread, 0.0)),
            shared=with_rest_errors(shared, left, self.rest_variance),
            discrepancy=self._discrepancy,
            scale=self.scale,
            rest_variance=self.rest_variance,
        )


def _modes(reader: PadReader, known: PadTouches, lattice: Lattice) -> FloatArray:
    """Most probable location and load of each touch, (t, D + 1), by Gauss-Newton from the best node of the lattice."""
    parts = components_of(reader, known, lattice)
    order = np.lexsort((parts.log_weight, parts.touch))
    last = np.flatnonzero(np.diff(np.append(parts.touch[order], known.n_touches)))
    x = parts.mean[order[last]]
    blocks = np.arange(known.n_touches)
    low = np.append(reader.map.low, 1e-6 * reader.load)
    high = np.append(reader.map.high, np.inf)
    x = np.clip(x, low, high)
    value = reader.log_density(known, x[:, None], blocks)[:, 0]
    damping = np.full(len(x), 1e-3)
    for _ in range(_ITERATIONS):
        signal, slope, weight = _expand(reader, known, x)
        residual = np.where(known.present, known.readings - reader.map.offset, 0.0) - signal
        gradient = np.einsum("tkm,tmn,tn->tk", slope, weight, residual, optimize=True)
        gradient[:, -1] += (known.load - x[:, -1]) / known.felt_sd**2
        hessian = _precision(reader, known, slope, weight)
        tried = np.clip(x + damped_newton_steps(gradient, hessian, damping), low, high)
        found = reader.log_density(known, tried[:, None], blocks)[:, 0]
        better = found > value
        x[better], value[better] = tried[better], found[better]
        damping = np.clip(damping * np.where(better, 0.2, 8.0), 1e-9, 1e6)
    return x


def _expand(reader: PadReader, known: PadTouches, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Signals (t, m), their derivatives over location and load (t, D + 1, m), inverse covariance of readings (t, m, m).

    The covariance has the errors that elements share in a touch, of the noise and of touches that may be missing: they
    show no fault of an element.
    """
    sensitivity, slope = reader.map.slopes(x[:, :-1], x[:, -1])
    signal, variance = reader.predict(x[:, :-1], x[:, -1], known.counts)
    own = np.where(known.present, 1 / variance, 0.0)
    directions, _ = shared_directions(own, known.shared_by_noise)
    weight = own[:, :, None] * np.eye(own.shape[1]) - directions.swapaxes(1, 2) @ directions
    return signal, np.concatenate([x[:, -1, None, None] * slope, sensitivity[:, None]], axis=1), weight


def _precision(reader: PadReader, known: PadTouches, slope: FloatArray, weight: FloatArray) -> FloatArray:
    """Inverse covariance (t, D + 1, D + 1) of location and load, with their priors; `weight` is that of readings."""
    hessian = np.asarray(slope @ weight @ slope.swapaxes(1, 2))
    axes = np.arange(slope.shape[1] - 1)
    hessian[:, axes, axes] += 1 / (reader.map.high - reader.map.low) ** 2
    hessian[:, -1, -1] += 1 / known.felt_sd**2
    return hessian
