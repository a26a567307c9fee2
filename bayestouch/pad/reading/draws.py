"""Touches on a calibrated pad for the sampler: posterior density, proposal, and results of the draws."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray, IndexArray
from bayestouch.chain.pad import COORDINATES
from bayestouch.data.averages import TouchMeans
from bayestouch.pad.reading.components import Components, components_of
from bayestouch.pad.reading.lattice import Lattice, lattice_for
from bayestouch.pad.reading.proposal import WithLogLoad, count_places, many_parts
from bayestouch.pad.reading.reader import PadReader, PadTouches
from bayestouch.reading.touch_reader import Drawn

# Touches whose components are in memory at the same time: at most 1,000 components of 150 B each.
_WINDOW = 256

# Touches drawn together; they have about the same number of parts.
_TOGETHER = 128

# Number of draws of each touch that are used for the level of its reference and for the prediction of its readings.
_THINNED = 200

# If the variance of the readings by errors that they share over the variance of their noise, summed over the elements
# and the load, is below this, shared errors increase no standard deviation by more than a thousandth.
NEGLIGIBLE = 2e-3

#: Names of the results about the location, (t,); those of predicted readings and their sd, (m, t), are in `PREDICTED`.
PLACES = ("modes", "reference_level")
PREDICTED = ("predicted", "predicted_sd")


@dataclass(frozen=True, eq=False)
class PadGroup:
    """Touches on a pad that are drawn together. A `bayestouch.reading.touch_reader.TouchGroup`.

    Attributes
    ----------
    rows : (t,) int array
        Indices of the touches in the block.
    reader : PadReader
        The calibrated pad.
    known : PadTouches
        Readings and prior loads of the touches.
    location : (t, D) array
        Reference locations, mm; NaN unknown. Only ``reference_level`` depends on them.
    proposal : WithLogLoad
        Proposal of the sampler.
    modes : (t,) int array
        Number of separate locations in each posterior.
    """

    rows: IndexArray
    reader: PadReader
    known: PadTouches
    location: FloatArray
    proposal: WithLogLoad
    modes: IndexArray

    def log_density(self, x: FloatArray, touch: IndexArray) -> FloatArray:
        """Log posterior density (B, n) of points (B, n, D + 1), load last, for the touches with indices `touch`."""
        return self.reader.log_density(self.known, x, touch)

    def results(self, draws: FloatArray) -> Drawn:
        """Location (mm) and felt load of draws (chain, draw, t, D + 1), `PLACES` and `PREDICTED`, by name."""
        names = coordinates(self.reader)
        thinned = _thinned(draws)
        predicted, sd = _predicted(self.reader, self.known, thinned)
        return {
            **{name: draws[..., axis] for axis, name in enumerate(names)},
            "modes": self.modes.astype(float),
            "reference_level": _levels(self.proposal, thinned, self.location),
            "predicted": predicted.T,
            "predicted_sd": sd.T,
        }


@dataclass(frozen=True, eq=False)
class PadSampler:
    """A calibrated pad that draws touches. A `bayestouch.reading.touch_reader.TouchSampler`.

    Attributes
    ----------
    reader : PadReader
        The calibrated pad.
    lattice : Lattice
        Locations at which the search for every touch starts.
    """

    reader: PadReader
    lattice: Lattice

    # A new proposal is expensive: a touch with poor draws is drawn again with the same proposal.
    redraws_together = False

    @classmethod
    def of(cls, reader: PadReader) -> PadSampler:
        """Sampler with the lattice for the map of the pad."""
        return cls(reader, lattice_for(reader))

    def pieces(self, rows: IndexArray, again: bool) -> list[IndexArray]:
        """Rows in pieces of `_WINDOW` touches."""
        return [rows[start : start + _WINDOW] for start in range(0, len(rows), _WINDOW)]

    def shapes(self, chains: int, draws: int) -> dict[str, tuple[int, ...]]:
        """Shapes of the results without the axis of touches: coordinates, load, `PLACES` and `PREDICTED`."""
        m = self.reader.map.n_elements
        drawn = dict.fromkeys(coordinates(self.reader), (chains, draws))
        return {**drawn, **dict.fromkeys(PLACES, ()), **dict.fromkeys(PREDICTED, (m,))}

    def groups(self, touches: TouchMeans, rows: IndexArray) -> Iterator[PadGroup]:
        """The touches in `rows`, in groups whose proposals have about the same number of parts."""
        window = touches.select(rows)
        known = self.reader.touches(window)
        for some in known.of_each_kind:
            yield from self._groups(known.select(some), rows[some], window.location[some])

    def _groups(self, known: PadTouches, rows: IndexArray, location: FloatArray) -> Iterator[PadGroup]:
        """`groups` of touches with the same kinds of errors."""
        components = components_of(self.reader, known, self.lattice)
        modes = count_places(components, len(rows))
        parts = many_parts(components, len(rows))
        uncertain = _uncertain(self.reader, known, components)
        order = np.argsort((parts.weight > 0).sum(axis=1), kind="stable")
        for start in range(0, len(order), _TOGETHER):
            some = np.sort(order[start : start + _TOGETHER])
            group = known.select(some) if uncertain[some].any() else known.apart().select(some)
            low, high = self.reader.map.low, self.reader.map.high
            first = WithLogLoad.of(parts.select(some)).reaching(low, high)
            proposal = first.weighed_by(partial(_density, self.reader, group), low, high)
            yield PadGroup(rows[some], self.reader, group, location[some], proposal, modes[some])


def _density(reader: PadReader, known: PadTouches, x: FloatArray) -> FloatArray:
    """Log posterior density (t, n) of points (t, n, D + 1) of all touches."""
    return reader.log_density(known, x, np.arange(len(x)))


def _uncertain(reader: PadReader, known: PadTouches, components: Components) -> BoolArray:
    """Whether shared errors change the posterior of a touch by more than a negligible amount, (t,)."""
    out = np.zeros(known.n_touches, dtype=bool)
    if known.share_errors:
        x, touch = components.mean, components.touch
        signal, variance = reader.predict(x[:, :-1], x[:, -1], known.counts[touch])
        changes = reader.changes(known, x[:, None], touch, signal[:, None])[:, 0] ** 2
        share = np.where(known.present[touch], changes[:, :, :-1].sum(axis=1) / variance, 0.0).sum(axis=1)
        share += changes[:, :, -1].sum(axis=1) / known.felt_sd[touch] ** 2
        out[touch[share > NEGLIGIBLE]] = True
    return out


def coordinates(reader: PadReader) -> tuple[str, ...]:
    """Names of the unknowns of a touch: coordinates of the location, and the load."""
    return (*COORDINATES[: reader.map.dimensions], "P")


def _thinned(draws: FloatArray) -> FloatArray:
    """Some of the draws (chain, draw, t, d), all chains together, (t, n, d)."""
    joined = np.moveaxis(draws, 2, 0).reshape(draws.shape[2], -1, draws.shape[3])
    return joined[:, :: max(1, joined.shape[1] // _THINNED)]


def _levels(parts: WithLogLoad, draws: FloatArray, reference: FloatArray) -> FloatArray:
    """Share of draws where the density of the location is higher than at the reference (t, D), (t,); NaN unknown."""
    location = parts.without_last()
    with np.errstate(invalid="ignore"):
        known = location.log_density(reference[:, None])
        level = (location.log_density(draws[..., :-1]) > known).mean(axis=1)
    return np.where(np.isfinite(reference).all(axis=1), level, np.nan)


def _predicted(reader: PadReader, known: PadTouches, draws: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Posterior mean of the readings, (t, m), and the standard deviation of a reading about it, (t, m)."""
    signal, variance = reader.apart.predict(draws[..., :-1], draws[..., -1], known.counts[:, None])
    spread = np.sqrt(variance.mean(axis=1) + signal.var(axis=1))
    return reader.map.offset + signal.mean(axis=1), np.where(known.counts > 0, spread, np.inf)
