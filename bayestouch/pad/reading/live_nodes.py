"""Integrals over the load of one touch on a pad, at the locations of a region: probability and load of each location.

At a given location the load is nearly normal: readings are linear in it, and their variance changes slowly. A few
Gauss-Hermite points about its mode, weighted with the exact density, give its mean, its variance and the probability of
the location.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.pad.corrected import PadEffects
from bayestouch.pad.reading.draws import NEGLIGIBLE
from bayestouch.pad.reading.effects import true_load_prior
from bayestouch.pad.reading.felt_load import acting_given_felt, cut_at_zero
from bayestouch.pad.reading.live_grid import Region
from bayestouch.pad.reading.reader import PadReader
from bayestouch.reading.live import HeldTouch
from bayestouch.sampling.rank_one import shared_directions

# Number of Gauss-Hermite nodes for the load at a location: with and without a measured load.
MEASURED, UNMEASURED = 3, 7
# Steps to the load of a location where the sensitivity depends on it: each squares a relative error of a tenth or two.
LOAD_STEPS = 3
# Least load of the search, over the typical one: the load is above zero.
LEAST_SHARE = 1e-3


@dataclass(frozen=True, eq=False)
class OnePadTouch:
    """Readings of one touch, and what is known of its load before them; m elements.

    Attributes
    ----------
    reading : (m,) array
        Mean reading minus offset; 0 where missing.
    counts : (m,) array
        Number of raw reads with the noise of each mean; 0 for a missing reading, or an element that is not used.
    load, load_sd : float
        Mean and standard deviation of the acting load: from its measurement, else from the calibration, N.
    felt_sd : float
        Standard deviation of the load that the elements feel, N: with the error that they share.
    measured : bool
        Whether the load was measured.
    by_noise : (k, m) array
        Change of the readings by one standard deviation of each error of the noise that elements share.
    """

    reading: FloatArray
    counts: FloatArray
    load: float
    load_sd: float
    felt_sd: float
    measured: bool
    by_noise: FloatArray

    @classmethod
    def of(cls, reader: PadReader, touch: HeldTouch) -> OnePadTouch:
        """From the sums over the samples of a touch."""
        counts = np.where(reader.usable, touch.counts, 0.0)
        measured = touch.load == touch.load and reader.load_measured
        load, load_sd = reader.load, reader.load_sd
        if measured:
            load, reads = touch.load, touch.reads_of_load
            load_sd = float(reader.measured_load_sd(np.array([load]), np.array([reads]))[0])
        felt_sd = float(np.hypot(load_sd, reader.noise.load_scatter))
        reading = np.where(counts > 0, touch.readings - reader.map.offset, 0.0)
        by_noise = reader.noise.shared_errors(counts[None])[:, 0]
        return cls(reading, counts, load, load_sd, felt_sd, measured, by_noise)


@dataclass(frozen=True, eq=False)
class TrueLoadTable:
    """True loads that effects of the contact turn into acting loads, as a table.

    Attributes
    ----------
    acting, true, slope : (g,) arrays
        Acting loads, the true load of each, and its derivative over the acting load (above zero); N.
    mean, sd : float
        Prior mean and standard deviation of a true load that is not measured, N.
    """

    acting: FloatArray
    true: FloatArray
    slope: FloatArray
    mean: float
    sd: float

    @classmethod
    def of(cls, effects: PadEffects, calibrated_load: FloatArray) -> TrueLoadTable:
        """From the effects of a calibration and the acting loads of its touches (n,)."""
        acting = effects.load_grid
        true = effects.pressing(acting)
        slope = np.maximum(np.gradient(true, acting), 1e-300)
        return cls(acting, true, slope, *true_load_prior(effects, calibrated_load))


@dataclass(frozen=True, eq=False)
class PadNodes:
    """Locations of a region with their probabilities, and the load given each; n locations, D coordinates.

    Attributes
    ----------
    location : (n, D) array
        Locations, mm.
    mass : (n,) array
        Their probabilities, which sum to one.
    ends : (k, 2) array
        Ends of the region, as `Region.nodes` gives them.
    load, load_variance : (n,) arrays
        Mean and variance of the load at each location, N and N².
    least : float
        Least sum of squared residuals of readings and measured load over their standard deviations.
    """

    location: FloatArray
    mass: FloatArray
    ends: FloatArray
    load: FloatArray
    load_variance: FloatArray
    least: float

    @cached_property
    def mean(self) -> FloatArray:
        """Mean location, (D,), mm."""
        return np.asarray(self.mass @ self.location)

    @cached_property
    def off(self) -> FloatArray:
        """Locations minus their mean, (n, D), mm."""
        return self.location - self.mean

    @cached_property
    def covariance(self) -> FloatArray:
        """Covariance of the location, (D, D), mm²."""
        return np.asarray((self.off * self.mass[:, None]).T @ self.off)

    @cached_property
    def mean_load(self) -> float:
        """Mean load, N."""
        return float(self.mass @ self.load)

    @cached_property
    def load_sd(self) -> float:
        """Standard deviation of the load, N."""
        return float(np.sqrt(self.mass @ ((self.load - self.mean_load) ** 2 + self.load_variance)))

    def with_load(self) -> tuple[FloatArray, FloatArray]:
        """Mean (D + 1,) and covariance (D + 1, D + 1) of location and load."""
        mean = np.concatenate([self.mean, [self.mean_load]])
        covariance = np.empty((len(mean), len(mean)))
        covariance[:-1, :-1] = self.covariance
        both = (self.off * (self.mass * (self.load - self.mean_load))[:, None]).sum(axis=0)
        covariance[-1, :-1] = covariance[:-1, -1] = both
        covariance[-1, -1] = self.load_sd**2
        return mean, covariance


@dataclass(frozen=True, eq=False)
class _Places:
    """What the readings of one touch are at n locations: sensitivities, and what is uncertain of them.

    `open` and `shared` are those of `PadMap.at`; `common` (n, c, m) those of `PadMap.shared_at`, which elements share.
    Elements share those of the noise, too.
    """

    reader: PadReader
    touch: OnePadTouch
    location: FloatArray
    sensitivity: FloatArray
    open: FloatArray
    shared: FloatArray
    common: FloatArray

    @classmethod
    def of(cls, reader: PadReader, touch: OnePadTouch, location: FloatArray, about: float) -> _Places:
        """At these locations, without the errors that elements share if they are negligible at a load of `about`."""
        places = cls(reader, touch, location, *reader.map.at(location), reader.map.shared_at(location))
        if not places.common.size:
            return places
        _, spread = places.signals(np.full(len(location), about))
        share = np.einsum("ncm,nm->n", (about * places.common) ** 2, places.here / spread)
        return places if share.max() >= NEGLIGIBLE else replace(places, common=places.common[:, :0])

    @cached_property
    def here(self) -> FloatArray:
        """1 where an element was read, else 0, (m,)."""
        return (self.touch.counts > 0).astype(float)

    @cached_property
    def _counts(self) -> FloatArray:
        return np.maximum(self.touch.counts, 1.0)

    @cached_property
    def _own_variance(self) -> FloatArray:
        """Variance of the mean readings that does not depend on the load, (m,)."""
        noise = self.reader.noise
        return np.asarray(noise.tactile_sd**2 / self._counts + noise.discrepancy_sd**2)

    def signals(self, loads: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Readings without noise and the variance of readings, (..., n, m), for loads (..., n)."""
        there, left = self.sensitivity, self.open
        if self.reader.map.loads is not None:
            places = np.broadcast_to(self.location, (*loads.shape, self.location.shape[-1]))
            there, left, _ = self.reader.map.at(places, loads)
        signal = loads[..., None] * there
        own = self._own_variance + self.reader.noise.own_signal_variance(self._counts, signal)
        return signal, own + self.reader.map.reading_variance(left, self.shared, loads)

    @property
    def share_errors(self) -> bool:
        """Whether elements have errors in common."""
        return bool(self.common.size or self.touch.by_noise.size)

    def errors(self, loads: FloatArray) -> FloatArray:
        """Change of readings by each error that elements share, (..., n, c + k, m), for loads (..., n)."""
        of_map = loads[..., None, None] * self.common
        if not self.touch.by_noise.size:
            return of_map
        of_noise = np.broadcast_to(self.touch.by_noise, (*loads.shape, *self.touch.by_noise.shape))
        return np.concatenate([of_map, of_noise], axis=-2)

    def felt_loads(self, about: float) -> tuple[FloatArray, FloatArray]:
        """Mode and standard deviation of the felt load at each location, (n,) each; the search starts at `about`."""
        touch, least = self.touch, LEAST_SHARE * self.reader.load
        _, spread = self.signals(np.full(len(self.location), about))
        # Sums over the few elements are products of matrices: numpy's sums of short rows take five times as long.
        by_load = self.sensitivity * (self.here / spread)
        precision = np.einsum("nm,nm->n", by_load, self.sensitivity) + 1 / touch.felt_sd**2
        pull = by_load @ touch.reading + touch.load / touch.felt_sd**2
        if self.share_errors:
            at = np.full(len(self.location), about)
            known, lacking = self._lacking(spread, self.errors(at), self.sensitivity, touch.reading)
            precision, pull = precision - known, pull - lacking
        centre = np.maximum(pull / precision, least)
        for _ in range(0 if self.reader.map.loads is None else LOAD_STEPS):
            # The sensitivity depends on the load: Gauss-Newton steps from where it is that of the typical load.
            signal, spread = self.signals(centre)
            slope = self.reader.map.slopes(self.location, centre)[0]
            by_load = slope * (self.here / spread)
            precision = np.einsum("nm,nm->n", by_load, slope) + 1 / touch.felt_sd**2
            pull = np.einsum("nm,nm->n", by_load, touch.reading - signal) + (touch.load - centre) / touch.felt_sd**2
            if self.share_errors:
                known, lacking = self._lacking(spread, self.errors(centre), slope, touch.reading - signal)
                precision, pull = precision - known, pull - lacking
            centre = np.maximum(centre + pull / precision, least)
        return centre, 1 / np.sqrt(precision)

    def log_density(self, loads: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Log posterior density of felt loads (..., n), and the sum of squared residuals of the readings."""
        touch = self.touch
        signal, spread = self.signals(loads)
        residual = touch.reading - signal
        squares, volume = (residual * residual / spread) @ self.here, np.log(spread) @ self.here
        if self.share_errors:
            directions, grown = shared_directions(self.here / spread, self.errors(loads))
            squares = squares - ((directions @ residual[..., None])[..., 0] ** 2).sum(axis=-1)
            volume = volume + grown
        off = (loads - touch.load) / touch.felt_sd
        return -0.5 * (squares + volume + off * off), squares

    def _lacking(
        self, spread: FloatArray, shared: FloatArray, slope: FloatArray, rows: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Information (n,) and pull (n,) on the load that readings lack because of errors that they share.

        From variances (n, m), shared errors (n, c, m), derivatives over the load (n, m), and residuals (n, m) or (m,).
        """
        directions, _ = shared_directions(self.here / spread, shared)
        along = (directions @ slope[..., None])[..., 0]
        return (along * along).sum(axis=1), (along * (directions @ rows[..., None])[..., 0]).sum(axis=1)


def pad_nodes(
    reader: PadReader, region: Region, touch: OnePadTouch, about: float, true_loads: TrueLoadTable | None
) -> PadNodes:
    """Integrals over the load at the locations of a region.

    Parameters
    ----------
    reader : PadReader
        The calibrated pad.
    region : Region
        Region of the locations.
    touch : OnePadTouch
        The touch.
    about : float
        Load from which the search for the mode starts, N.
    true_loads : TrueLoadTable or None
        The loads that are stated, where effects make them differ from those that act; None without effects.
    """
    location, weights, ends = region.nodes()
    about = max(about, LEAST_SHARE * reader.load)
    places = _Places.of(reader, touch, location, about)
    centre, sd = places.felt_loads(about)
    z, log_weight = _hermite(MEASURED if touch.measured else UNMEASURED)
    felt = centre + sd * z
    log, squares = places.log_density(felt)
    off = (felt - touch.load) / touch.felt_sd
    log = np.where(felt > 0, log + log_weight + np.log(sd) + np.log(weights), -np.inf)
    loads, variance, log = _stated(reader, touch, true_loads, felt, log)
    mass = np.exp(log - log.max())
    total = mass.sum(axis=0)
    within = mass / np.maximum(total, 1e-300)
    mean_load = (within * loads).sum(axis=0)
    load_variance = (within * ((loads - mean_load) ** 2 + variance)).sum(axis=0)
    least = squares + (off * off if touch.measured else 0.0)
    return PadNodes(location, total / total.sum(), ends, mean_load, load_variance, float(least[mass > 0].min()))


def _stated(
    reader: PadReader, touch: OnePadTouch, true_loads: TrueLoadTable | None, felt: FloatArray, log: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Mean and variance of the load that is stated for felt loads (..., n), and their log densities with its prior.

    It is the acting load; with effects of the contact, the true load.
    """
    kept, acting_sd = acting_given_felt(touch.load_sd, reader.noise.load_scatter)
    loads, variance = cut_at_zero(touch.load + kept * (felt - touch.load), acting_sd)
    if true_loads is None:
        return loads, variance, log
    slope = np.interp(loads, true_loads.acting, true_loads.slope)
    loads, variance = np.interp(loads, true_loads.acting, true_loads.true), variance * slope**2
    if reader.load_measured and not touch.measured:
        # The prior is normal in the true load, as in `with_true_loads`.
        off = (felt - touch.load) / touch.felt_sd
        log = log + (np.log(slope) - 0.5 * ((loads - true_loads.mean) / true_loads.sd) ** 2 + 0.5 * off * off)
    return loads, variance, log


@cache
def _hermite(n: int) -> tuple[FloatArray, FloatArray]:
    """Standard normal nodes (n, 1), and the logarithm of their weights over exp(-z²/2)."""
    z, weight = np.polynomial.hermite_e.hermegauss(n)
    return z[:, None], (np.log(weight) + 0.5 * z**2)[:, None]
