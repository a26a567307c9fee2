"""`PadLive`: posterior of one touch on a pad by deterministic quadrature, for a control loop."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from scipy.special import chdtrc

from bayestouch.array_types import FloatArray
from bayestouch.chain.pad import COORDINATES
from bayestouch.pad.reading.effects import true_load_prior
from bayestouch.pad.reading.felt_load import acting_given_felt, cut_at_zero
from bayestouch.pad.reading.live_effects import PadStream
from bayestouch.pad.reading.live_grid import NODES, Region
from bayestouch.pad.reading.live_search import ELSEWHERE, Rough, Search
from bayestouch.pad.reading.touch_reader import PadTouchReader
from bayestouch.reading.live import AT_AN_END, CLOSE, LEVELS, HeldTouch, LiveTouch
from bayestouch.reading.mixtures import mixture_quantiles
from bayestouch.reading.options import Options
from bayestouch.results.objects import Calibration

# Number of Gauss-Hermite nodes for the load at a location: with and without a measured load.
MEASURED, UNMEASURED = 3, 7
# Steps to the load of a location where the sensitivity depends on it: each squares a relative error of a tenth or two.
LOAD_STEPS = 3
# A region is replaced if its ends have more than the share AT_END of the probability, if the mean of the posterior is
# more than MOVED sd from its centre, or if an sd differs by more than a factor RESIZED. TRIES: largest number of
# regions.
AT_END, MOVED, RESIZED, TRIES = 1e-4, 0.7, 1.4, 4
# If the largest of the last three Legendre coefficients over the first one is below this, the nodes resolve the
# posterior: the variance of a normal density then has an error of 0.4 %.
UNRESOLVED = 1.2
# Posteriors with an sd above this multiple of the step of the lattice have more nodes from the start.
WIDE = 0.6
# A touch has the flag of a misfit if the probability of a larger misfit is below this.
IMPROBABLE = 1e-4
MISFIT = "the readings fit no touch of this sensor"
SEVERAL = "several separate locations fit"
UNCERTAIN = "the uncertainty of the effects is left out"
CUT = "the grid does not resolve the posterior of the location"


@dataclass(frozen=True, eq=False)
class PadLive:
    """A calibrated pad that reads one touch at a time. A `bayestouch.reading.live.LiveBody`.

    Attributes
    ----------
    reader : PadTouchReader
        The reader of `bayestouch.infer`, whose density and lattice are used.
    """

    reader: PadTouchReader

    @classmethod
    def of(cls, calibration: Calibration, options: Options, arrays: Mapping[str, FloatArray] | None = None) -> PadLive:
        """Live reader from a calibration of a pad; `arrays` are not used.

        Raises
        ------
        InputError
            The calibration is not that of a pad.
        """
        live = cls(PadTouchReader.from_calibration(calibration, options))
        _ = live._search
        return live

    @property
    def n_elements(self) -> int:
        """Number of elements m."""
        return self.reader.sampler.reader.map.n_elements

    def arrays(self) -> dict[str, FloatArray]:
        """Empty: the tables of a pad are those of its calibration."""
        return {}

    def stream(self) -> PadStream:
        """A new stream of samples."""
        return PadStream(self.reader.effects, self.reader.sampler.reader.samples)

    @cached_property
    def _search(self) -> Search:
        return Search(self.reader.sampler.reader, self.reader.sampler.lattice)

    @cached_property
    def _true_loads(self) -> tuple[FloatArray, FloatArray, FloatArray, float, float] | None:
        """Acting loads, true loads and their slope, mean and sd of the prior of true loads; None without effects."""
        effects = self.reader.effects
        if effects is None:
            return None
        acting = effects.load_grid
        true = effects.pressing(acting)
        slope = np.maximum(np.gradient(true, acting), 1e-300)
        return acting, true, slope, *true_load_prior(effects, self.reader.calibrated_load)

    def read(
        self, touch: HeldTouch, near: Rough | None = None, stream: PadStream | None = None
    ) -> tuple[LiveTouch, Rough]:
        """Posterior of a touch, and its rough form for the next sample; `near` is that of the sample before."""
        reader = self.reader.sampler.reader
        counts = np.where(reader.usable, touch.counts, 0.0)
        measured = touch.load == touch.load and reader.load_measured
        load, load_sd = reader.load, reader.load_sd
        if measured:
            load, reads = touch.load, touch.reads_of_load
            load_sd = float(reader.measured_load_sd(np.array([load]), np.array([reads]))[0])
        felt_sd = float(np.hypot(load_sd, reader.noise.load_scatter))
        reading = np.where(counts > 0, touch.readings - reader.map.offset, 0.0)
        # The first samples of a touch may fit at several places; later ones decide.
        rough = near if near and near.elsewhere <= ELSEWHERE else self._search(reading, counts, load, felt_sd)
        flags = [SEVERAL] if rough.elsewhere > ELSEWHERE else []
        if reader.map.n_causes:
            flags.append(UNCERTAIN)
        few, many = NODES[reader.map.dimensions]
        # The region of a wide posterior is seldom an ellipse.
        wide = float(np.sqrt(rough.covariance.diagonal().max())) > WIDE * self.reader.sampler.lattice.step
        region = Region(reader.map.low, reader.map.high, rough.mean, rough.covariance, many if wide else few)
        for tried in range(TRIES):
            nodes = self._nodes(region, reading, counts, load, load_sd, measured, rough.load)
            location, mass, ends, loads, load_var, likelihood = nodes
            mean = mass @ location
            off = location - mean
            covariance = (off * mass[:, None]).T @ off
            at_ends = region.at_ends(mass, ends)
            width = np.sqrt(covariance.diagonal() / region.covariance.diagonal())
            moved = np.abs(mean - region.mean) / np.sqrt(region.covariance.diagonal())
            poor = at_ends > AT_END or moved.max() > MOVED or width.max() > RESIZED or width.min() < 1 / RESIZED
            unresolved = region.unresolved(mass) > UNRESOLVED
            if tried == TRIES - 1 or not (poor or (unresolved and region.n < many)):
                break
            grown = covariance * (2.25 if at_ends > AT_END else 1.0)
            least = 0.04 * region.covariance.diagonal()
            grown[range(len(mean)), range(len(mean))] = np.maximum(grown.diagonal(), least)
            n = many if unresolved and not poor else region.n
            region = Region(region.low, region.high, mean, grown, n)
        if at_ends > 10 * AT_END or unresolved:
            flags.append(CUT)
        pressed = float(mass @ loads)
        sd = np.sqrt(covariance.diagonal())
        load_spread = float(np.sqrt(mass @ ((loads - pressed) ** 2 + load_var)))
        if (np.minimum(mean - region.low, region.high - mean) < CLOSE * sd).any() or pressed < CLOSE * load_spread:
            flags.append(AT_AN_END)
        degrees = int(np.count_nonzero(counts)) + measured - len(mean) - 1
        misfit = float(chdtrc(degrees, likelihood)) if degrees > 0 else np.nan
        if misfit < IMPROBABLE:
            flags.append(MISFIT)
        both = np.concatenate([mean, [pressed]])
        whole = np.empty((len(both), len(both)))
        whole[:-1, :-1] = covariance
        whole[-1, :-1] = whole[:-1, -1] = (off * (mass * (loads - pressed))[:, None]).sum(axis=0)
        whole[-1, -1] = load_spread**2
        quantiles = np.concatenate(
            [
                region.quantiles(location, mass, ends, LEVELS),
                np.maximum(mixture_quantiles(mass, loads[None], np.sqrt(load_var)[None], LEVELS), 0.0),
            ]
        )
        result = LiveTouch(
            (*COORDINATES[: len(mean)], "P"),
            (*("mm",) * len(mean), self.reader.load_unit),
            both,
            np.sqrt(whole.diagonal()),
            quantiles,
            whole,
            misfit,
            touch.samples,
            {},
            tuple(flags),
        )
        return result, Rough(mean, covariance, rough.load, rough.elsewhere)

    def _nodes(
        self,
        region: Region,
        reading: FloatArray,
        counts: FloatArray,
        load: float,
        load_sd: float,
        measured: bool,
        about: float,
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, float]:
        """Locations, their probabilities, ends, mean and variance of the load at each, and the least sum of squares."""
        reader = self.reader.sampler.reader
        kept, acting_sd = acting_given_felt(load_sd, reader.noise.load_scatter)
        felt_sd = float(np.hypot(load_sd, reader.noise.load_scatter))
        location, weights, ends = region.nodes()
        sensitivity, open_, shared = reader.map.at(location)
        here = (counts > 0).astype(float)
        safe = np.maximum(counts, 1.0)

        def variance(loads: FloatArray) -> tuple[FloatArray, FloatArray]:
            there, left = sensitivity, open_
            if reader.map.loads is not None:
                places = np.broadcast_to(location, (*loads.shape, location.shape[-1]))
                there, left, _ = reader.map.at(places, loads)
            signal = loads[..., None] * there
            noise = reader.noise
            own = noise.tactile_sd**2 / safe + noise.discrepancy_sd**2 + (noise.signal_share * signal) ** 2
            return signal, own + reader.map.reading_variance(left, shared, loads)

        # The load at a location is nearly normal: readings are linear in it, and their variance changes slowly.
        _, spread = variance(np.full(len(location), max(about, 1e-3 * reader.load)))
        # Sums over the few elements are products of matrices: numpy's sums of short rows take five times as long.
        by_load = sensitivity * (here / spread)
        precision = np.einsum("nm,nm->n", by_load, sensitivity) + 1 / felt_sd**2
        centre = np.maximum((by_load @ reading + load / felt_sd**2) / precision, 1e-3 * reader.load)
        for _ in range(0 if reader.map.loads is None else LOAD_STEPS):
            # The sensitivity depends on the load: Gauss-Newton steps from where it is that of the typical load.
            signal, spread = variance(centre)
            slope = reader.map.slopes(location, centre)[0]
            by_load = slope * (here / spread)
            precision = np.einsum("nm,nm->n", by_load, slope) + 1 / felt_sd**2
            pull = np.einsum("nm,nm->n", by_load, reading - signal) + (load - centre) / felt_sd**2
            centre = np.maximum(centre + pull / precision, 1e-3 * reader.load)
        sd = 1 / np.sqrt(precision)
        z, log_weight = _hermite(MEASURED if measured else UNMEASURED)
        # Felt loads.
        loads = centre + sd * z
        signal, spread = variance(loads)
        residual = reading - signal
        squares = (residual * residual / spread) @ here
        off = (loads - load) / felt_sd
        log = -0.5 * (squares + np.log(spread) @ here + off * off)
        log = np.where(loads > 0, log + log_weight + np.log(sd) + np.log(weights), -np.inf)
        loads, acting_var = cut_at_zero(load + kept * (loads - load), acting_sd)
        if self._true_loads is not None:
            acting, true, slopes, mean, width = self._true_loads
            slope = np.interp(loads, acting, slopes)
            loads, acting_var = np.interp(loads, acting, true), acting_var * slope**2
            if reader.load_measured and not measured:
                # The prior is normal in the true load, as in `with_true_loads`.
                log += np.log(slope) - 0.5 * ((loads - mean) / width) ** 2 + 0.5 * off * off
        mass = np.exp(log - log.max())
        total = mass.sum(axis=0)
        within = mass / np.maximum(total, 1e-300)
        mean_load = (within * loads).sum(axis=0)
        load_var = (within * ((loads - mean_load) ** 2 + acting_var)).sum(axis=0)
        least = squares + (off * off if measured else 0.0)
        return location, total / total.sum(), ends, mean_load, load_var, float(least[mass > 0].min())


@cache
def _hermite(n: int) -> tuple[FloatArray, FloatArray]:
    """Standard normal nodes (n, 1), and the logarithm of their weights over exp(-z²/2)."""
    z, weight = np.polynomial.hermite_e.hermegauss(n)
    return z[:, None], (np.log(weight) + 0.5 * z**2)[:, None]
