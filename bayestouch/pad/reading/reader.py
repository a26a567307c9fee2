"""Posterior density of touches on a calibrated pad, for many touches at once."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray, IndexArray, IntArray
from bayestouch.chain.noise import Noise
from bayestouch.chain.pad_map import PadMap
from bayestouch.data.arrays import read_once
from bayestouch.data.averages import TouchMeans
from bayestouch.errors import InputError
from bayestouch.pad.corrected import PadEffects
from bayestouch.pad.effect_changes import CorrectedMeans, changes_of_load
from bayestouch.results.keys import USABLE
from bayestouch.results.objects import Calibration
from bayestouch.sampling.rank_one import shared_directions

# The change of a load by effects is tabulated for LOADS loads up to MOST_LOAD reference loads.
MOST_LOAD, LOADS = 10.0, 1001


@dataclass(frozen=True, eq=False)
class PadTouches:
    """Unknown touches and the prior of their loads; t touches, m elements.

    The *felt load* of a touch is its acting load plus the error that its elements share (`Noise.load_scatter`). The
    readings show the felt load; a force sensor shows the acting load.

    Attributes
    ----------
    readings : (t, m) array
        Mean readings minus the rest reading; arbitrary where missing.
    counts : (t, m) array
        Number of raw reads with the noise of each mean, 0 where missing.
    load, load_sd : (t,) arrays
        Prior mean and standard deviation of each acting load: from its measurement, else from the calibration.
    load_scatter : float
        Standard deviation of the felt load about the acting load.
    changes : (t, q, m + 1) array, optional
        Change of readings and load by one standard deviation of each of q independent causes, as in
        `bayestouch.pad.effect_changes.CorrectedMeans`; q is 0 where only the map has errors that elements share. None
        if errors of the calibration that elements share are left out.
    by_noise : (t, k, m) array, optional
        Change of the readings by one standard deviation of each of k errors that elements share: of the noise, and due
        to touches that may be missing in the table. None without such errors, or if they are left out.
    """

    readings: FloatArray
    counts: FloatArray
    load: FloatArray
    load_sd: FloatArray
    load_scatter: float = 0.0
    changes: FloatArray | None = None
    by_noise: FloatArray | None = None

    @cached_property
    def felt_sd(self) -> FloatArray:
        """Prior standard deviation of each felt load, (t,); its mean is that of the acting load."""
        return np.hypot(self.load_sd, self.load_scatter)

    @property
    def n_touches(self) -> int:
        """Number of touches."""
        return len(self.load)

    @property
    def present(self) -> NDArray[np.bool_]:
        """Whether each reading is present, (t, m)."""
        return self.counts > 0

    def select(self, index: IntArray) -> PadTouches:
        """Some of the touches, without the errors of the noise that none of them has."""
        by_noise = self.shared_by_noise[index]
        by_noise = by_noise[:, by_noise.any(axis=(0, 2))]
        return replace(
            self,
            readings=self.readings[index],
            counts=self.counts[index],
            load=self.load[index],
            load_sd=self.load_sd[index],
            changes=None if self.changes is None else self.changes[index],
            by_noise=by_noise if by_noise.shape[1] else None,
        )

    @property
    def of_each_kind(self) -> list[IndexArray]:
        """Indices, ascending, of the touches without the last error of `by_noise`, then of those with it.

        It is due to touches that may be missing. Few touches have it, and the others are read without it.
        """
        last = self.shared_by_noise[:, -1:].any(axis=(1, 2))
        return [np.flatnonzero(part) for part in (~last, last) if part.any()]

    @property
    def shared_by_noise(self) -> FloatArray:
        """`by_noise`, with k = 0 where it is None."""
        return np.zeros((self.n_touches, 0, self.readings.shape[1])) if self.by_noise is None else self.by_noise

    @property
    def share_errors(self) -> bool:
        """Whether elements have errors in common."""
        return self.changes is not None or self.by_noise is not None

    def apart(self) -> PadTouches:
        """The touches without the errors that elements share."""
        return replace(self, changes=None, by_noise=None)


@dataclass(frozen=True, eq=False)
class PadReader:
    """A calibrated pad that computes posterior densities of touches.

    Attributes
    ----------
    map : PadMap
        Sensitivity over location, with its uncertainty.
    noise : Noise
        Noise of the readings, with what effects of the noise add to it.
    load, load_sd : float
        Prior mean and standard deviation of a load that is not measured.
    load_measured : bool
        Whether the calibration had measured loads; otherwise measured loads of touches cannot be used.
    samples : str
        Samples of a touch that are used: ``"mean"``, ``"first"`` or ``"last"``.
    usable : (m,) bool array
        Elements that responded in the calibration.
    changes_of_load : (1 + q, n) array, optional
        Acting loads, and their change by one standard deviation of each cause at the same true load.
    effects : PadEffects, optional
        Effects that readings and loads are corrected for.
    load_reads : float, optional
        Number of readings of the force sensor in a touch to plan; by default one with each sample.
    """

    map: PadMap
    noise: Noise
    load: float
    load_sd: float
    load_measured: bool
    samples: str
    usable: NDArray[np.bool_]
    changes_of_load: FloatArray | None = None
    effects: PadEffects | None = None
    load_reads: float | None = None

    @classmethod
    def from_calibration(cls, calibration: Calibration, *, plug_in: bool = False) -> PadReader:
        """Reader from a calibration.

        Parameters
        ----------
        calibration : Calibration
            Calibration of a pad.
        plug_in : bool
            Whether the calibration counts as exact. Errors of the place that all elements share in a touch remain.

        Raises
        ------
        InputError
            The calibration is not that of a pad.
        """
        settings = calibration.settings
        if settings.get("body") != "pad":
            raise InputError("expected the calibration of a pad, got that of a finger")
        effects = PadEffects.of(calibration)
        map_ = PadMap.from_arrays(calibration.extra)
        map_ = map_.exact(calibration.statistics.get("place_error", 0.0)) if plug_in else map_
        return cls(
            map=map_,
            noise=calibration.noise if effects is None else effects.noise(calibration.noise),
            load=float(settings["load_mean"]),
            load_sd=float(settings["load_sd"]),
            load_measured=bool(settings["load_measured"]),
            samples=str(settings["samples"]),
            usable=np.asarray(calibration.extra[USABLE]) > 0,
            changes_of_load=_changes_of_load(effects) if map_.n_causes else None,
            effects=effects,
            load_reads=calibration.rows.usual_load_reads,
        )

    @cached_property
    def apart(self) -> PadReader:
        """The same pad, for readings one by one: errors of the noise that elements share are errors of each alone."""
        return replace(self, noise=self.noise.apart())

    def measured_load_sd(self, load: FloatArray, reads: FloatArray) -> FloatArray:
        """Standard deviation of loads (t,), means of `reads` (t,) of the force sensor, corrected for effects."""
        sd = self.noise.mean_load_sd(reads)
        return sd if self.effects is None else sd * self.effects.relative_slope(load)

    def touches(self, readings: TouchMeans) -> PadTouches:
        """Touches with the priors of their loads: from the force sensor, else from the calibration."""
        here = np.isfinite(readings.load) & self.load_measured
        changes = None
        if self.map.n_causes and isinstance(readings, CorrectedMeans) and readings.changes is not None:
            changes = readings.changes.copy()
            changes[~here, :, -1] = 0.0
        elif self.map.n_shared:
            changes = np.zeros((len(here), 0, self.map.n_elements + 1))
        counts = np.where(self.usable, readings.counts, 0)
        by_noise = np.moveaxis(self.noise.shared_errors(counts), 0, 1)
        if isinstance(readings, CorrectedMeans):
            by_noise = np.concatenate([by_noise, readings.by_missing], axis=1)
        return PadTouches(
            readings=np.where(readings.counts > 0, readings.readings, 0.0),
            counts=counts,
            load=np.where(here, readings.load, self.load),
            load_sd=np.where(here, self.measured_load_sd(readings.load, readings.reads_of_load), self.load_sd),
            load_scatter=self.noise.load_scatter,
            changes=changes,
            by_noise=by_noise if by_noise.shape[1] else None,
        )

    def log_density(self, touches: PadTouches, x: FloatArray, blocks: IntArray) -> FloatArray:
        """Log posterior density, up to a constant for each touch; ``-inf`` outside the priors.

        The prior of the location is uniform over the calibrated region, that of the load is normal and above zero.
        Readings are normal with a variance that depends on location and load.

        Parameters
        ----------
        touches : PadTouches
            The touches.
        x : (B, n, D + 1) array
            Location in mm, then felt load.
        blocks : (B,) int array
            Index of the touch of each row.

        Returns
        -------
        (B, n) array
        """
        location, load = x[..., :-1], x[..., -1]
        allowed = self.map.inside(location) & (load > 0)
        signal, variance = self.predict(location, load, touches.counts[blocks][:, None])
        here = touches.present[blocks][:, None]
        residual = touches.readings[blocks][:, None] - self.map.offset - signal
        cost = np.where(here, residual**2 / variance + np.log(variance), 0.0).sum(axis=-1)
        off = (load - touches.load[blocks][:, None]) / touches.felt_sd[blocks][:, None]
        cost += off * off
        if touches.share_errors:
            directions, log_determinant = self.shared(touches, x, blocks, signal, variance)
            residual = np.concatenate(
                [np.where(here, residual, 0.0), (touches.load[blocks][:, None] - load)[..., None]], -1
            )
            along = np.einsum("...qm,...m->...q", directions, residual)
            cost += log_determinant - np.einsum("...q,...q->...", along, along)
        return np.where(allowed, -0.5 * cost, -np.inf)

    def shared(
        self, touches: PadTouches, x: FloatArray, blocks: IntArray, signal: FloatArray, variance: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Change of the inverse covariance of readings and load by the errors that they have in common.

        Parameters
        ----------
        touches, x, blocks
            As in `log_density`; elements of the touches share errors.
        signal, variance : (B, n, m) arrays
            Expected signal and variance of each reading alone, from `predict`.

        Returns
        -------
        (B, n, c + q + k, m + 1) array, (B, n) array
            Result of `bayestouch.sampling.rank_one.shared_directions`.
        """
        here = np.broadcast_to(touches.present[blocks][:, None], signal.shape)
        load_weight = np.broadcast_to(1 / touches.felt_sd[blocks][:, None] ** 2, x.shape[:-1])
        weight = np.concatenate([np.where(here, 1 / variance, 0.0), load_weight[..., None]], axis=-1)
        return shared_directions(weight, self.changes(touches, x, blocks, signal))

    def changes(self, touches: PadTouches, x: FloatArray, blocks: IntArray, signal: FloatArray) -> FloatArray:
        """Change of the residuals of readings and load by one sd of each cause, (B, n, c + q + k, m + 1); see `shared`.

        First the c errors of `PadMap.shared`, then the q causes of effects, last the k errors of the noise.
        """
        load, first, effects = x[..., -1], 0, 0
        if touches.changes is not None:
            first, effects = self.map.n_shared, touches.changes.shape[1]
        causes, noise = first + effects, 0 if touches.by_noise is None else touches.by_noise.shape[1]
        out = np.zeros((*signal.shape[:-1], causes + noise, signal.shape[-1] + 1))
        if causes:
            expected = self.map.changes(x[..., :-1])[..., :causes, :]
            np.multiply(expected, -load[..., None, None], out=out[..., :causes, :-1])
        if touches.by_noise is not None:
            out[..., causes:, :-1] = touches.by_noise[blocks][:, None]
        if effects:
            assert touches.changes is not None
            assert self.changes_of_load is not None and self.map.offset_by_effect is not None
            acting, *changes = self.changes_of_load
            of_load = np.stack([np.interp(load, acting, change) for change in changes], axis=-1)
            out[..., first:causes, :-1] -= self.map.offset_by_effect
            out[..., first:causes, :-1] -= of_load[..., None] * (signal / load[..., None])[..., None, :]
            out[..., first:causes, :] += touches.changes[blocks][:, None]
        return out

    def predict(self, location: FloatArray, load: FloatArray, counts: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Expected signal (reading minus offset) and variance of a mean reading, (..., m) each.

        Errors that elements share are no part of the variance, see `shared`.

        Parameters
        ----------
        location : (..., D) array
            Location, mm.
        load : (...) array
            Load, N, or relative to that of the calibration.
        counts : (..., m) array
            Number of raw reads with the noise of the mean; where it is 0, the variance is set to 1.
        """
        sensitivity, variance, covariance = self.map.at(location, load)
        signal = load[..., None] * sensitivity
        noise = self.noise.own_sd(read_once(counts), signal) ** 2
        total = noise + self.map.reading_variance(variance, covariance, load)
        return signal, np.where(counts > 0, total, 1.0)


def _changes_of_load(effects: PadEffects | None) -> FloatArray:
    """`PadReader.changes_of_load` of a calibration with effects."""
    assert effects is not None
    acting = effects.acting_of_pressed(effects.reference_load * np.linspace(0.0, MOST_LOAD, LOADS))
    acting = np.maximum.accumulate(acting)
    return np.concatenate([acting[None], changes_of_load(effects, acting)])
