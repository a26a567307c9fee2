"""Inference block by block, in memory or into a file, for any number of touches."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray
from bayestouch.data.touch_source import TouchSource
from bayestouch.output.progress import Progress
from bayestouch.parallel.cluster import on_cluster
from bayestouch.reading.options import Kept, Options
from bayestouch.reading.touch_reader import AnyBlock
from bayestouch.results.data import TouchRows
from bayestouch.results.draws_on_file import NoDraws
from bayestouch.results.growing_file import GrowingFile
from bayestouch.results.objects import Calibration, TouchPosteriors
from bayestouch.results.partial import Partial, fingerprint_of, partial_folder
from bayestouch.results.schema import schema_attributes
from bayestouch.results.summaries import summarise
from bayestouch.results.tips import TipProbabilities
from bayestouch.version import __version__

# Draws of a block, over all its touches: 64 MB for R, r_c, θ_c and P. Block sizes are multiples of `BLOCK_UNIT`. Three
# blocks are in memory: one is written while the others are drawn.
BLOCK_DRAWS = 1 << 21
BLOCK_UNIT = 512


#: Blocks of touches, each with the number of its first touch.
Numbered = Iterator[tuple[int, Any]]


class BlockReader(Protocol):
    """A calibrated sensor that can infer blocks of touches. It is sent to other processes or machines."""

    def read(self, block: Any, first: int) -> TouchPosteriors:
        """Posteriors of a block of touches, numbered from `first`; they do not depend on other blocks."""
        ...

    def read_blocks(
        self,
        blocks: Numbered,
        n_touches: int,
        largest: int,
        workers: int | None,
        progress: Callable[[int], None] | None,
    ) -> Iterator[tuple[int, TouchPosteriors]]:
        """Posteriors of blocks of touches, in order, computed by `workers` processes of this machine.

        There are `n_touches` touches in all, at most `largest` in a block. Draws and grades are in memory that later
        blocks use again. `progress` is called with the number of touches that are drawn.
        """
        ...


@dataclass(frozen=True, eq=False)
class TouchRun:
    """Touches that are prepared for inference.

    Attributes
    ----------
    reader : BlockReader
        Infers the posteriors of a block.
    n_touches : int
        Number of touches.
    blocks : callable
        Function of a block size. It yields the touches in order, in blocks of that size (the last one smaller).
    """

    reader: BlockReader
    n_touches: int
    blocks: Callable[[int], Iterator[Any]]


#: Function that infers blocks, in any order, and reduces them to what is kept. Arguments: the reader; what is kept; the
#: blocks, each with the number of its first touch; the number of touches in all blocks, and in the largest one; a
#: function that is called with the number of touches that are drawn. What it yields may change at the next request.
Executor = Callable[
    [BlockReader, Kept, Numbered, int, int, Callable[[int], None] | None], Iterator[tuple[int, TouchPosteriors]]
]


def rows_of_blocks(n: int, size: int) -> Iterator[NDArray[np.int64]]:
    """Numbers 0 ... n - 1 in arrays of length `size` (the last one shorter)."""
    return (np.arange(first, min(first + size, n)) for first in range(0, n, size))


def in_blocks(parts: Iterable[AnyBlock], size: int) -> Iterator[AnyBlock]:
    """Touches from parts of any size, in blocks of one size (the last one smaller)."""
    held: list[AnyBlock] = []
    for part in parts:
        held.append(part)
        if sum(each.n_touches for each in held) < size:
            continue
        whole = type(part).joined(held)
        full = whole.n_touches // size * size
        yield from map(whole.select, rows_of_blocks(full, size))
        held = [whole.select(np.arange(full, whole.n_touches))]
    if held and (last := type(held[0]).joined(held)).n_touches:
        yield last


def size_of_block(kept: Kept) -> int:
    """Number of touches in a block."""
    return max(1, BLOCK_DRAWS // kept.draws // BLOCK_UNIT) * BLOCK_UNIT


def keep(block: TouchPosteriors, kept: Kept) -> TouchPosteriors:
    """Block reduced to the draws that are kept, with the summary of all its draws."""
    if kept.everything:
        return block
    draws = {} if kept.summary_only else {name: a[:, :: kept.thin] for name, a in block.posterior.items()}
    return replace(block, posterior=draws, estimates=summarise(block.posterior))


def local_executor(workers: int | None) -> Executor:
    """Executor that infers blocks on this machine, with `workers` processes (default: cores)."""

    def executor(
        reader: BlockReader,
        kept: Kept,
        blocks: Numbered,
        n_touches: int,
        largest: int,
        progress: Callable[[int], None] | None,
    ) -> Iterator[tuple[int, TouchPosteriors]]:
        for first, block in reader.read_blocks(blocks, n_touches, largest, workers, progress):
            yield first, keep(block, kept)

    return executor


def cluster_executor(address: str) -> Executor:
    """Executor that uses the Dask cluster with its scheduler at `address`; raises as `on_cluster`."""

    def executor(
        reader: BlockReader,
        kept: Kept,
        blocks: Numbered,
        n_touches: int,
        largest: int,
        progress: Callable[[int], None] | None,
    ) -> Iterator[tuple[int, TouchPosteriors]]:
        numbered, done = ((first, (first, block)) for first, block in blocks), 0
        for first, block in on_cluster(address, _read_on_worker, (reader, kept), numbered):
            yield first, block
            done += len(block.rows.touch)
            if progress is not None:
                progress(done)

    return executor


def _read_on_worker(shared: tuple[BlockReader, Kept], piece: tuple[int, Any]) -> TouchPosteriors:
    (reader, kept), (first, block) = shared, piece
    return keep(reader.read(block, first), kept)


def read_in_memory(run: TouchRun, kept: Kept, executor: Executor, progress: Progress | None) -> TouchPosteriors:
    """Posteriors of all touches, in memory."""
    blocks = {first: _copied(block) for first, block in _read(run, kept, executor, progress, set())}
    joined = _joined([blocks[first] for first in sorted(blocks)])
    return replace(joined, posterior=NoDraws()) if kept.summary_only else joined


def read_to_file(
    run: TouchRun, kept: Kept, executor: Executor, path: Path, fingerprint: str, progress: Progress | None
) -> None:
    """Write the posteriors of all touches to a file; an interrupted run is continued.

    Raises
    ------
    InputError
        If the file cannot be written, or another process is writing it.
    """
    from bayestouch.results.groups import touch_groups

    with partial_folder(path, fingerprint) as partial:
        layout = partial.layout()
        file = None if layout is None else GrowingFile.from_json(partial.file, layout)
        done = set() if file is None else partial.finished()
        for first, block in _read(run, kept, executor, progress, done):
            groups, attributes = touch_groups(block, first)
            if file is None:
                file = _begin(partial, groups, attributes, run.n_touches)
            file.write(groups, first)
            partial.add(first)
        assert file is not None
        file.finish()
        partial.deliver()


def fingerprint(source: TouchSource, calibration: Calibration, options: Options) -> str:
    """Hash of everything that the draws depend on: data, calibration, options, versions of the packages used."""
    from importlib.metadata import version

    from bayestouch.results.groups import calibration_groups

    groups, attributes = calibration_groups(calibration)
    return fingerprint_of(
        source.mark(),
        {
            f"{name}/{key}": variable.values
            for name, group in groups.items()
            for key, variable in group.variables.items()
        },
        attributes,
        options,
        (BLOCK_DRAWS, BLOCK_UNIT),
        {"bayestouch": __version__} | {name: version(name) for name in ("numpy", "scipy", "emcee")},
    )


def _begin(partial: Partial, groups: Any, attributes: dict[str, str], n_touches: int) -> GrowingFile:
    partial.clear()
    schema = schema_attributes()
    groups = {name: group.assign_attrs(schema) for name, group in groups.items()}
    file = GrowingFile.create(partial.file, groups, {**attributes, **schema}, n_touches)
    partial.begin(file.to_json())
    return file


def _read(
    run: TouchRun, kept: Kept, executor: Executor, progress: Progress | None, done: set[int]
) -> Iterator[tuple[int, TouchPosteriors]]:
    """First touch and posteriors of each block whose number is not in `done`; they may change at the next request."""
    size = size_of_block(kept)
    before = min(len(done) * size, run.n_touches)

    def report(count: int) -> None:
        if progress is not None:
            progress(min(1.0, (before + count) / run.n_touches))

    left = ((i * size, block) for i, block in enumerate(run.blocks(size)) if i * size not in done)
    largest = min(size, run.n_touches)
    yield from executor(run.reader, kept, left, run.n_touches - before, largest, None if progress is None else report)


def _copied(block: TouchPosteriors) -> TouchPosteriors:
    """Block with draws and grades of its own."""

    def own(arrays: Mapping[str, Any]) -> dict[str, Any]:
        return {name: np.array(values) for name, values in arrays.items()}

    return replace(block, posterior=own(block.posterior), sample_stats=own(block.sample_stats))


def _joined(blocks: Sequence[TouchPosteriors]) -> TouchPosteriors:
    first = blocks[0]
    if len(blocks) == 1:
        return first

    def last_axis(name: str) -> dict[str, Any]:
        parts = [getattr(block, name) for block in blocks]
        return {key: np.concatenate([part[key] for part in parts], axis=-1) for key in parts[0]}

    rows: dict[str, Any] = {
        name: np.concatenate([getattr(block.rows, name) for block in blocks]) for name in first.rows.arrays()
    }
    location = {key: np.concatenate([block.rows.location[key] for block in blocks]) for key in first.rows.location}
    tips = [block.tips.log_probability for block in blocks if block.tips is not None]
    return replace(
        first,
        posterior=last_axis("posterior"),
        sample_stats=last_axis("sample_stats"),
        reference=last_axis("reference"),
        estimates=last_axis("estimates"),
        groups={group: _along_touches([block.groups[group] for block in blocks]) for group in first.groups},
        rows=TouchRows(location=location, **rows),
        tips=None
        if first.tips is None
        else TipProbabilities(first.tips.radius_mm, first.tips.prior, np.concatenate(tips)),
    )


def _along_touches(parts: Sequence[Mapping[str, FloatArray]]) -> dict[str, FloatArray]:
    """Arrays (chain, draw, touch, ...) of several blocks, joined."""
    return {name: np.concatenate([part[name] for part in parts], axis=2) for name in parts[0]}
