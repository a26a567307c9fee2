"""`PadLive`: posterior of one touch on a pad by deterministic quadrature, for a control loop."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.special import chdtrc

from bayestouch.array_types import FloatArray
from bayestouch.chain.pad import COORDINATES
from bayestouch.pad.reading.live_effects import PadStream
from bayestouch.pad.reading.live_grid import NODES, Region
from bayestouch.pad.reading.live_nodes import OnePadTouch, PadNodes, TrueLoadTable, pad_nodes
from bayestouch.pad.reading.live_search import ELSEWHERE, Rough, Search
from bayestouch.pad.reading.touch_reader import PadTouchReader
from bayestouch.reading.live import AT_AN_END, CLOSE, IMPROBABLE, LEVELS, MISFIT, HeldTouch, LiveTouch
from bayestouch.reading.mixtures import mixture_quantiles
from bayestouch.reading.options import Options
from bayestouch.results.objects import Calibration

# A region is replaced if the mean of the posterior is more than MOVED sd from its centre, if an sd differs by more than
# a factor RESIZED, or if more than the share BEYOND of a variance is beyond an end. TRIES: largest number of regions.
MOVED, RESIZED, BEYOND, TRIES = 0.7, 1.4, 0.02, 6
# Distance of each end of a region from its centre in sd, and the growth of this distance if too much is beyond the end.
REACH, LONGER = 5.0, 1.6
# Share of a variance beyond the ends that makes a standard deviation 5 % too small.
TOO_MUCH = 0.1
# If the largest of the last three Legendre coefficients over the first one is below this, the nodes resolve the
# posterior: the variance of a normal density then has an error of 0.4 %.
UNRESOLVED = 1.2
# Posteriors with an sd above this multiple of the step of the lattice have more nodes from the start.
WIDE = 0.6
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
    def _true_loads(self) -> TrueLoadTable | None:
        """True loads of the calibration; None without effects."""
        effects = self.reader.effects
        return None if effects is None else TrueLoadTable.of(effects, self.reader.calibrated_load)

    def read(
        self, touch: HeldTouch, near: Rough | None = None, stream: PadStream | None = None
    ) -> tuple[LiveTouch, Rough]:
        """Posterior of a touch, and its rough form for the next sample; `near` is that of the sample before."""
        reader = self.reader.sampler.reader
        one = OnePadTouch.of(reader, touch)
        by_missing = () if stream is None else stream.by_missing(touch.readings)
        if len(by_missing):
            one = replace(one, by_noise=np.concatenate([one.by_noise, by_missing]))
        # The first samples of a touch may fit at several places; later ones decide.
        rough = near
        if not rough or rough.elsewhere > ELSEWHERE:
            rough = self._search(one.reading, one.counts, one.load, one.felt_sd)
        region, nodes, cut = self._integrated(one, rough)
        misfit = _misfit(one, nodes)
        reasons = {
            SEVERAL: rough.elsewhere > ELSEWHERE,
            UNCERTAIN: reader.map.n_causes > 0,
            CUT: cut,
            AT_AN_END: _at_an_end(region, nodes),
            MISFIT: misfit < IMPROBABLE,
        }
        mean, covariance = nodes.with_load()
        result = LiveTouch(
            (*COORDINATES[: len(nodes.mean)], "P"),
            (*("mm",) * len(nodes.mean), self.reader.load_unit),
            mean,
            np.sqrt(covariance.diagonal()),
            _quantiles(region, nodes),
            covariance,
            misfit,
            touch.samples,
            {},
            tuple(flag for flag, raised in reasons.items() if raised),
        )
        return result, Rough(nodes.mean, nodes.covariance, rough.load, rough.elsewhere)

    def _integrated(self, one: OnePadTouch, rough: Rough) -> tuple[Region, PadNodes, bool]:
        """Region of the posterior, the integrals over it, and whether a part of the posterior is not in them."""
        reader = self.reader.sampler.reader
        few, many = NODES[reader.map.dimensions]
        # The region of a wide posterior is seldom an ellipse.
        wide = float(np.sqrt(rough.covariance.diagonal().max())) > WIDE * self.reader.sampler.lattice.step
        reach = np.full((reader.map.dimensions, 2), REACH)
        region = Region(reader.map.low, reader.map.high, rough.mean, rough.covariance, many if wide else few, reach)
        for left in reversed(range(TRIES)):
            nodes = pad_nodes(reader, region, one, rough.load, self._true_loads)
            beyond = region.beyond(nodes.mass, nodes.ends, nodes.load, nodes.load_sd)
            unresolved = region.unresolved(nodes.mass) > UNRESOLVED
            displaced = _displaced(region, nodes)
            poor = displaced or bool((beyond > BEYOND).any())
            if not left or not (poor or (unresolved and region.n < many)):
                break
            # A region about the right place shows how far the tails reach.
            reach = region.reach if displaced else np.where(beyond > BEYOND, LONGER * region.reach, region.reach)
            region = _moved(region, nodes, reach, region.n if displaced else many)
        return region, nodes, bool(beyond.sum() > TOO_MUCH) or unresolved


def _displaced(region: Region, nodes: PadNodes) -> bool:
    """Whether mean or widths of a posterior differ much from those that its region was made for."""
    width = np.sqrt(nodes.covariance.diagonal() / region.covariance.diagonal())
    moved = np.abs(nodes.mean - region.mean) / np.sqrt(region.covariance.diagonal())
    return bool(moved.max() > MOVED or width.max() > RESIZED or width.min() < 1 / RESIZED)


def _moved(region: Region, nodes: PadNodes, reach: FloatArray, n: int) -> Region:
    """A region about the posterior that another one has shown, with n nodes of each coordinate."""
    covariance = nodes.covariance.copy()
    least = 0.04 * region.covariance.diagonal()
    axes = range(len(nodes.mean))
    covariance[axes, axes] = np.maximum(covariance.diagonal(), least)
    return Region(region.low, region.high, nodes.mean, covariance, n, reach)


def _misfit(one: OnePadTouch, nodes: PadNodes) -> float:
    """Probability of a larger misfit of readings and measured load; NaN if they are not more than the unknowns."""
    degrees = int(np.count_nonzero(one.counts)) + one.measured - len(nodes.mean) - 1
    return float(chdtrc(degrees, nodes.least)) if degrees > 0 else np.nan


def _at_an_end(region: Region, nodes: PadNodes) -> bool:
    """Whether location or load is close to an end of its prior."""
    sd = np.sqrt(nodes.covariance.diagonal())
    near_end = (np.minimum(nodes.mean - region.low, region.high - nodes.mean) < CLOSE * sd).any()
    return bool(near_end or nodes.mean_load < CLOSE * nodes.load_sd)


def _quantiles(region: Region, nodes: PadNodes) -> FloatArray:
    """Quantiles of location and load, (D + 1, q), mm and N."""
    of_load = mixture_quantiles(nodes.mass, nodes.load[None], np.sqrt(nodes.load_variance)[None], LEVELS)
    return np.concatenate([region.quantiles(nodes.location, nodes.mass, nodes.ends, LEVELS), np.maximum(of_load, 0.0)])
