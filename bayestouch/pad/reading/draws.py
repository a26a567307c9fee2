"""Draws of touches on a pad: by emcee, window by window, on as many processes as there are cores."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray, IndexArray
from bayestouch.pad.reading.components import components_of
from bayestouch.pad.reading.lattice import Lattice
from bayestouch.pad.reading.proposal import ManyParts, count_places, many_parts
from bayestouch.pad.reading.reader import PadReader, PadTouches
from bayestouch.parallel.processes import cores, may_fork, shared_empty, spread_out
from bayestouch.progress import Progress
from bayestouch.sampling import BlockDraws, Demands, sample_blocks

CHAINS = 4

# Touches of which one process holds the parts of the posteriors in memory: at most 1,000 parts of 150 B each.
_WINDOW = 256

# Touches drawn together, of about the same number of parts.
_TOGETHER = 128

# Fewer effective draws than this share of all, or than 400, call for another round.
_LEAST_SHARE = 0.4

# Draws of each touch that the level of its reference is found from, and that its readings are predicted with.
_THINNED = 200


STATS = ("ess_bulk", "rhat", "acceptance", "pareto_k", "second_round", "grade", "modes", "reference_level")


@dataclass(frozen=True, eq=False)
class PadDraws:
    """Draws of touches, their grades, and what they predict; t touches, m elements.

    Attributes
    ----------
    draws : (chain, draw, t, D + 1) array
        Location (mm), then load as it acts.
    stats : dict of (t,) arrays
        Grades by the names of `STATS`.
    predicted, sd : (t, m) arrays
        Posterior mean of the readings, and the standard deviation of a reading about it.
    """

    draws: FloatArray
    stats: dict[str, FloatArray]
    predicted: FloatArray
    sd: FloatArray


def draw_pad(
    reader: PadReader,
    known: PadTouches,
    location: FloatArray,
    lattice: Lattice,
    *,
    draws: int,
    seed: int,
    first: int,
    workers: int | None,
    progress: Progress | None,
) -> PadDraws:
    """Draw the posteriors of touches.

    Parameters
    ----------
    reader : PadReader
        What the calibration says of readings.
    known : PadTouches
        The touches.
    location : (t, D) array
        Reference locations, mm; NaN unknown. They decide ``reference_level`` alone.
    lattice : Lattice
        Places that are tried for every touch.
    draws, seed : int
        Draws of each touch in all, and the seed.
    first : int
        Number of the first touch.
    workers : int, optional
        How many processes draw; as many as there are cores by default. The result does not depend on it.
    progress : callable, optional
        Called with the share of the work done.
    """
    n, t = -(-draws // CHAINS), known.n_touches
    windows = [np.arange(start, min(start + _WINDOW, t)) for start in range(0, t, _WINDOW)]
    workers = cores(workers) if len(windows) > 1 else 1
    empty = np.empty if workers == 1 or not may_fork() else shared_empty
    out = PadDraws(
        draws=empty((CHAINS, n, t, location.shape[1] + 1)),
        stats={name: empty((t,)) for name in STATS},
        predicted=empty(known.readings.shape),
        sd=empty(known.readings.shape),
    )

    def draw(window: IndexArray) -> int:
        for index, parts, modes in _groups(reader, known, lattice, window):
            result = sample_blocks(
                lambda x, blocks: reader.log_density(known, x, blocks - first),
                parts,
                walkers=CHAINS,
                draws=n,
                seed=seed,
                blocks=first + index,
                demands=demands(n),
            )
            out.draws[:, :, index] = result.draws
            for name, values in _grades(result).items():
                out.stats[name][index] = values
            out.stats["modes"][index] = modes
            thinned = _thinned(result.draws)
            out.stats["reference_level"][index] = _levels(parts, thinned, location[index])
            out.predicted[index], out.sd[index] = _predicted(reader, known.select(index), thinned)
        return len(window)

    done = 0
    with spread_out(draw, workers) as spread:
        for count in spread(windows):
            done += count
            if progress is not None:
                progress(done / t)
    return out


def demands(n: int) -> Demands:
    """What chains of n draws must reach."""
    # R-hat of chains that are right scatters by as many hundredths as there are chains for each hundred draws.
    return Demands(ess_bulk=min(400.0, _LEAST_SHARE * CHAINS * n), rhat=1 + max(0.02, 3 / n))


def _groups(
    reader: PadReader, known: PadTouches, lattice: Lattice, window: IndexArray
) -> Iterator[tuple[IndexArray, ManyParts, IndexArray]]:
    """Touches of a window to be drawn together: which, their proposals, and how many places each names."""
    components = components_of(reader, known.select(window), lattice)
    modes = count_places(components, len(window))
    parts = many_parts(components, len(window))
    order = np.argsort((parts.weight > 0).sum(axis=1), kind="stable")
    for start in range(0, len(order), _TOGETHER):
        some = np.sort(order[start : start + _TOGETHER])
        yield window[some], parts.select(some), modes[some]


def _grades(result: BlockDraws) -> dict[str, FloatArray]:
    return {
        "ess_bulk": result.worst_ess,
        "rhat": result.worst_rhat,
        "acceptance": result.acceptance,
        "pareto_k": result.pareto_k,
        "second_round": result.second_round.astype(float),
        "grade": result.grade.astype(float),
    }


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
