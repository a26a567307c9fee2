"""Touches on a calibrated pad as the sampler wants them: their density, a proposal, and what is kept of draws."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray, IndexArray
from bayestouch.chain.pad import COORDINATES
from bayestouch.data.averages import TouchMeans
from bayestouch.pad.reading.components import Components, components_of
from bayestouch.pad.reading.lattice import Lattice, lattice_for
from bayestouch.pad.reading.proposal import ManyParts, count_places, many_parts
from bayestouch.pad.reading.reader import PadReader, PadTouches
from bayestouch.reading.touch_reader import Drawn

# Touches of which one process holds the parts of the posteriors in memory: at most 1,000 parts of 150 B each.
_WINDOW = 256

# Touches drawn together, of about the same number of parts.
_TOGETHER = 128

# Draws of each touch that the level of its reference is found from, and that its readings are predicted with.
_THINNED = 200

# Variance of readings by uncertain effects, over that of their noise, summed over the elements: less of it makes no
# standard deviation larger by a thousandth.
_NEGLIGIBLE = 2e-3

#: What a posterior says of places, (t,); readings as they are predicted, and their standard deviations, (m, t).
PLACES = ("modes", "reference_level")
PREDICTED = ("predicted", "predicted_sd")


@dataclass(frozen=True, eq=False)
class PadGroup:
    """Touches on a pad that are drawn together. A `bayestouch.reading.touch_reader.TouchGroup`.

    Attributes
    ----------
    rows : (t,) int array
        Their places in the block.
    reader : PadReader
        What the calibration says of readings.
    known : PadTouches
        The touches.
    location : (t, D) array
        Reference locations, mm; NaN unknown. They decide ``reference_level`` alone.
    proposal : ManyParts
        Of the sampler.
    modes : (t,) int array
        Separate places that each posterior names.
    """

    rows: IndexArray
    reader: PadReader
    known: PadTouches
    location: FloatArray
    proposal: ManyParts
    modes: IndexArray

    def log_density(self, x: FloatArray, touch: IndexArray) -> FloatArray:
        """Log posterior density (B, n) of points (B, n, D + 1), load last, of the touches at the places `touch`."""
        return self.reader.log_density(self.known, x, touch)

    def results(self, draws: FloatArray) -> Drawn:
        """Location (mm) and load as it acts of draws (chain, draw, t, D + 1), `PLACES` and `PREDICTED`."""
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
    """A calibrated pad that touches are drawn with. A `bayestouch.reading.touch_reader.TouchSampler`.

    Attributes
    ----------
    reader : PadReader
        What the calibration says of readings.
    lattice : Lattice
        Places that are tried for every touch.
    """

    reader: PadReader
    lattice: Lattice

    # A proposal of many parts takes long to make, so that a poor touch is drawn again from the one it has.
    redraws_together = False

    @classmethod
    def of(cls, reader: PadReader) -> PadSampler:
        """With the lattice that the pad's map asks for."""
        return cls(reader, lattice_for(reader))

    def pieces(self, rows: IndexArray, again: bool) -> list[IndexArray]:
        """Rows in windows."""
        return [rows[start : start + _WINDOW] for start in range(0, len(rows), _WINDOW)]

    def shapes(self, chains: int, draws: int) -> dict[str, tuple[int, ...]]:
        """Of coordinates and load, `PLACES` and `PREDICTED`."""
        m = self.reader.map.n_elements
        drawn = dict.fromkeys(coordinates(self.reader), (chains, draws))
        return {**drawn, **dict.fromkeys(PLACES, ()), **dict.fromkeys(PREDICTED, (m,))}

    def groups(self, touches: TouchMeans, rows: IndexArray) -> Iterator[PadGroup]:
        """Some of the touches, in groups of those whose proposals have about as many parts."""
        window = touches.select(rows)
        known = self.reader.touches(window)
        components = components_of(self.reader, known, self.lattice)
        modes = count_places(components, len(rows))
        parts = many_parts(components, len(rows))
        uncertain = _uncertain(self.reader, known, components)
        order = np.argsort((parts.weight > 0).sum(axis=1), kind="stable")
        for start in range(0, len(order), _TOGETHER):
            some = np.sort(order[start : start + _TOGETHER])
            group = known.select(some) if uncertain[some].any() else replace(known, changes=None).select(some)
            yield PadGroup(rows[some], self.reader, group, window.location[some], parts.select(some), modes[some])


def _uncertain(reader: PadReader, known: PadTouches, components: Components) -> BoolArray:
    """Touches (t,) whose effects are so uncertain that it shows in a posterior."""
    out = np.zeros(known.n_touches, dtype=bool)
    if known.changes is not None:
        x, touch = components.mean, components.touch
        signal, variance = reader.predict(x[:, :-1], x[:, -1], known.counts[touch])
        changes = reader.changes(known, x[:, None], touch, signal[:, None])[:, 0] ** 2
        share = np.where(known.present[touch], changes[:, :, :-1].sum(axis=1) / variance, 0.0).sum(axis=1)
        share += changes[:, :, -1].sum(axis=1) / known.load_sd[touch] ** 2
        out[touch[share > _NEGLIGIBLE]] = True
    return out


def coordinates(reader: PadReader) -> tuple[str, ...]:
    """Names of what is drawn of a touch: its location and its load."""
    return (*COORDINATES[: reader.map.dimensions], "P")


def _thinned(draws: FloatArray) -> FloatArray:
    """Some of the draws (chain, draw, t, d) of all chains together, (t, n, d)."""
    joined = np.moveaxis(draws, 2, 0).reshape(draws.shape[2], -1, draws.shape[3])
    return joined[:, :: max(1, joined.shape[1] // _THINNED)]


def _levels(parts: ManyParts, draws: FloatArray, reference: FloatArray) -> FloatArray:
    """Share of draws at which the location's density is higher than at the reference (t, D), shape (t,)."""
    location = parts.without_last()
    with np.errstate(invalid="ignore"):
        known = location.log_density(reference[:, None])
        level = (location.log_density(draws[..., :-1]) > known).mean(axis=1)
    return np.where(np.isfinite(reference).all(axis=1), level, np.nan)


def _predicted(reader: PadReader, known: PadTouches, draws: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Posterior mean of the readings, (t, m), and the standard deviation of a reading about it."""
    signal, variance = reader.predict(draws[..., :-1], draws[..., -1], known.counts[:, None])
    spread = np.sqrt(variance.mean(axis=1) + signal.var(axis=1))
    return reader.map.offset + signal.mean(axis=1), np.where(known.counts > 0, spread, np.inf)
