"""Inference block by block: in memory, or into a file that holds any number of touches."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np

import bayestouch
from bayestouch.growing_file import GrowingFile
from bayestouch.inference.options import Kept, Options
from bayestouch.partial import Partial, fingerprint_of, partial_folder
from bayestouch.progress import Progress
from bayestouch.results import Calibration, TouchPosteriors, TouchRows
from bayestouch.summaries import summarise
from bayestouch.tip_probabilities import TipProbabilities
from bayestouch.touches import Touches

# Draws of a block, over its touches: 128 MB as R, r_c, θ_c and P. A multiple of what is drawn together.
BLOCK_DRAWS = 1 << 22
BLOCK_UNIT = 512


class TouchRun(Protocol):
    """Touches that are ready to be read."""

    @property
    def n_touches(self) -> int:
        """How many."""
        ...

    def read(self, start: int, stop: int, progress: Progress | None) -> TouchPosteriors:
        """Posteriors of some of the touches, which do not depend on the others."""
        ...


def _block(kept: Kept) -> int:
    """Touches that are read together."""
    return max(1, BLOCK_DRAWS // kept.draws // BLOCK_UNIT) * BLOCK_UNIT


def _keep(block: TouchPosteriors, kept: Kept) -> TouchPosteriors:
    """A block with the summary of all its draws, and those to be kept."""
    draws = {} if kept.summary_only else {name: a[:, :: kept.thin] for name, a in block.posterior.items()}
    return replace(block, posterior=draws, summary=summarise(block.posterior))


def read_in_memory(run: TouchRun, kept: Kept, progress: Progress | None) -> TouchPosteriors:
    """Posteriors of all touches."""
    if kept.thin == 1 and not kept.summary_only:
        return run.read(0, run.n_touches, progress)
    return _joined([_keep(block, kept) for _, block in _blocks(run, kept, progress)])


def read_to_file(run: TouchRun, kept: Kept, path: Path, fingerprint: str, progress: Progress | None) -> None:
    """Write the posteriors of all touches to a file, going on from where an interrupted run stopped.

    Raises
    ------
    InputError
        The file cannot be written, or another process is writing it.
    """
    from bayestouch.posterior_groups import touch_groups

    with partial_folder(path, fingerprint) as partial:
        layout = partial.layout()
        file = None if layout is None else GrowingFile.from_json(partial.file, layout)
        done = set() if file is None else partial.finished()
        for first, block in _blocks(run, kept, progress, done):
            groups, attributes = touch_groups(_keep(block, kept))
            if file is None:
                file = _begin(partial, groups, attributes, run.n_touches)
            file.write(groups, first)
            partial.add(first)
        assert file is not None
        file.finish()
        partial.deliver()


def fingerprint(touches: Touches, calibration: Calibration, options: Options) -> str:
    """Hash of all that the draws follow from: data, calibration, options, and the versions of what computes."""
    from importlib.metadata import version

    from bayestouch.posterior_groups import calibration_groups

    groups, attributes = calibration_groups(calibration)
    return fingerprint_of(
        {each.name: getattr(touches, each.name) for each in fields(touches)},
        {
            f"{name}/{key}": variable.values
            for name, group in groups.items()
            for key, variable in group.variables.items()
        },
        attributes,
        options,
        (BLOCK_DRAWS, BLOCK_UNIT),
        {"bayestouch": bayestouch.__version__} | {name: version(name) for name in ("numpy", "scipy", "emcee")},
    )


def _begin(partial: Partial, groups: Any, attributes: dict[str, str], n_touches: int) -> GrowingFile:
    partial.clear()
    file = GrowingFile.create(partial.file, groups, attributes, n_touches)
    partial.begin(file.to_json())
    return file


def _blocks(
    run: TouchRun, kept: Kept, progress: Progress | None, done: frozenset[int] | set[int] = frozenset()
) -> Iterator[tuple[int, TouchPosteriors]]:
    """First touch and posteriors of each block that is not done."""
    t = run.n_touches
    for first in range(0, t, _block(kept)):
        last = min(first + _block(kept), t)
        if first not in done:
            yield first, run.read(first, last, _share_of(progress, first / t, last / t))
        elif progress is not None:
            progress(last / t)


def _share_of(progress: Progress | None, low: float, high: float) -> Progress | None:
    if progress is None:
        return None
    told = progress
    return lambda fraction: told(low + (high - low) * fraction)


def _joined(blocks: Sequence[TouchPosteriors]) -> TouchPosteriors:
    first = blocks[0]

    def last_axis(name: str) -> dict[str, Any]:
        parts = [getattr(block, name) for block in blocks]
        return {key: np.concatenate([part[key] for part in parts], axis=-1) for key in parts[0]}

    rows: dict[str, Any] = {
        each.name: np.concatenate([getattr(block.rows, each.name) for block in blocks])
        for each in fields(TouchRows)
        if each.name != "location"
    }
    location = {key: np.concatenate([block.rows.location[key] for block in blocks]) for key in first.rows.location}
    tips = [block.tips.log_probability for block in blocks if block.tips is not None]
    return replace(
        first,
        posterior=last_axis("posterior"),
        sample_stats=last_axis("sample_stats"),
        reference=last_axis("reference"),
        summary=last_axis("summary"),
        rows=TouchRows(location=location, **rows),
        tips=None
        if first.tips is None
        else TipProbabilities(first.tips.radius_mm, first.tips.prior, np.concatenate(tips)),
    )
