"""Draws that stay in their file because they are larger than memory, and draws that were not kept."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.data.files import reading
from bayestouch.errors import InputError


@dataclass(frozen=True)
class DrawsOnFile(Mapping[str, FloatArray]):
    """Draws by parameter name, read from the file each time they are used.

    Attributes
    ----------
    path : Path
        Posterior file.
    shapes : mapping of str to tuple of int
        Shape (chain, draw, t) of each parameter's draws.
    stamp : tuple of int
        Size and time of the file when it was opened. A file that has changed since then is refused.
    positions : (t,) int array or None
        Positions of these touches in the file; None if they are all touches of the file.
    """

    path: Path
    shapes: Mapping[str, tuple[int, ...]]
    stamp: tuple[int, int]
    positions: IntArray | None = None

    def __getitem__(self, name: str) -> FloatArray:
        """All draws of a parameter, (chain, draw, t)."""
        return self.some(name, slice(None))

    def __iter__(self) -> Iterator[str]:
        return iter(self.shapes)

    def __len__(self) -> int:
        return len(self.shapes)

    def at(self, positions: IntArray) -> DrawsOnFile:
        """Draws of the touches at some of the positions (from 0); they stay on file."""
        shapes = {name: (*shape[:-1], len(positions)) for name, shape in self.shapes.items()}
        within = positions if self.positions is None else self.positions[positions]
        return replace(self, shapes=shapes, positions=within)

    def some(self, name: str, touches: slice) -> FloatArray:
        """Draws of a parameter for some of the touches, (chain, draw, some).

        Raises
        ------
        InputError
            If the file is missing or has changed.
        KeyError
            If there is no such parameter.
        """
        import h5py  # type: ignore[import-untyped, unused-ignore]  # stubs are in newer ones only

        if name not in self.shapes:
            raise KeyError(name)
        with reading(self.path) as file:
            if stamp_of(file) != self.stamp:
                raise InputError("has changed since it was opened", file=file)
            with h5py.File(file, "r") as root:
                draws = root["posterior"][name]
                if self.positions is None:
                    return np.asarray(draws[..., touches], dtype=np.float64)
                # h5py reads positions in rising order, each once
                rising, back = np.unique(self.positions[touches], return_inverse=True)
                return np.asarray(draws[..., rising], dtype=np.float64)[..., back]


_NO_DRAWS = "only summaries were kept of these posteriors, no draws"


def require_draws(posterior: Mapping[str, FloatArray]) -> None:
    """Raise an error if draws were not kept.

    Raises
    ------
    InputError
        There are none.
    """
    if not posterior:
        raise InputError(_NO_DRAWS)


class NoDraws(Mapping[str, FloatArray]):
    """Empty mapping for results of which only summaries were kept; reading draws from it raises an `InputError`."""

    def __getitem__(self, name: str) -> FloatArray:
        raise InputError(_NO_DRAWS, column=name)

    def __contains__(self, name: object) -> bool:
        return False

    def __iter__(self) -> Iterator[str]:
        return iter(())

    def __len__(self) -> int:
        return 0


def stamp_of(file: Path) -> tuple[int, int]:
    """Size (bytes) and time of the last change (ns) of a file."""
    status = file.stat()
    return status.st_size, status.st_mtime_ns
