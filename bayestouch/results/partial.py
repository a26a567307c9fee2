"""What an interrupted run leaves behind, and how the next one goes on from it.

Beside the output stands a folder ``OUTPUT.partial`` with the growing file, what the run was (a fingerprint of data,
options and versions), and the numbers of its finished blocks. It goes when the output comes.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np

from bayestouch.errors import InputError

#: How long a lock is waited for, seconds.
PATIENCE = 2.0

_RUN, _FINISHED, _LOCK = "run.json", "finished.txt", "lock"


@dataclass(frozen=True)
class Partial:
    """The folder of one run.

    Attributes
    ----------
    folder : Path
        Where it is.
    target : Path
        What the run is to write.
    fingerprint : str
        Of everything that the result follows from.
    """

    folder: Path
    target: Path
    fingerprint: str

    @property
    def file(self) -> Path:
        """The growing file."""
        return self.folder / "posterior"

    def finished(self) -> set[int]:
        """Numbers of the blocks that are on disk."""
        with suppress(FileNotFoundError):
            # The line that a kill cut off does not count.
            whole, _, _ = (self.folder / _FINISHED).read_text().rpartition("\n")
            return {int(line) for line in whole.split()}
        return set()

    def add(self, block: int) -> None:
        """Note that a block is on disk."""
        with (self.folder / _FINISHED).open("a") as stream:
            stream.write(f"{block}\n")
            stream.flush()
            _sync(stream)

    def layout(self) -> str | None:
        """Layout of the growing file that an earlier run of the same fingerprint left, as text; None without one."""
        try:
            run = json.loads((self.folder / _RUN).read_text())
            same = run["fingerprint"] == self.fingerprint and self.file.is_file()
            return str(run["layout"]) if same else None
        except (OSError, ValueError, KeyError, TypeError):
            return None

    def begin(self, layout: str) -> None:
        """Note what the run is; the growing file is there."""
        temporary = self.folder / f"{_RUN}.new"
        with temporary.open("w") as stream:
            json.dump({"fingerprint": self.fingerprint, "layout": layout}, stream)
            stream.flush()
            _sync(stream)
        temporary.replace(self.folder / _RUN)

    def clear(self) -> None:
        """Forget what an earlier run left."""
        for name in (_RUN, _FINISHED, self.file.name):
            (self.folder / name).unlink(missing_ok=True)

    def deliver(self) -> None:
        """Put the growing file, now whole, where the output belongs, and remove the folder."""
        self.file.replace(self.target)
        shutil.rmtree(self.folder, ignore_errors=True)


@contextmanager
def partial_folder(target: Path, fingerprint: str) -> Iterator[Partial]:
    """Folder of a run that writes `target`, made or taken over from an interrupted one, for this process alone.

    Raises
    ------
    InputError
        It cannot be written, or another process is writing the same output.
    """
    folder = target.with_name(f"{target.name}.partial")
    try:
        folder.mkdir(exist_ok=True)
        with (folder / _LOCK).open("w") as stream:
            if not _locked(stream):
                raise InputError("another run is writing this file", file=target)
            yield Partial(folder, target, fingerprint)
    except OSError as error:
        raise InputError(f"cannot be written: {error.strerror or error}", file=target) from error


def fingerprint_of(*parts: Any) -> str:
    """Hash of arrays, dataclasses, mappings and whatever else has a ``repr`` that says all it is."""
    digest = hashlib.sha256()
    for part in parts:
        _feed(digest, part)
    return digest.hexdigest()


def _feed(digest: Any, part: Any) -> None:
    if isinstance(part, np.ndarray) and part.dtype.kind != "O":
        digest.update(f"{part.dtype.str}{part.shape}".encode())
        digest.update(np.ascontiguousarray(part).data.cast("B") if part.size else b"")
    elif isinstance(part, np.ndarray):
        _feed(digest, "\0".join(map(str, part.ravel())))
    elif isinstance(part, Mapping):
        for name, value in part.items():
            digest.update(f"{name}:".encode())
            _feed(digest, value)
    elif is_dataclass(part):
        # their repr may be a summary
        digest.update(f"{type(part).__qualname__}(".encode())
        _feed(digest, {each.name: getattr(part, each.name) for each in fields(part)})
    else:
        digest.update(f"{part!r};".encode())


def _sync(stream: IO[str]) -> None:
    os.fsync(stream.fileno())


def _locked(stream: IO[str]) -> bool:
    """Whether the lock is ours; it goes with the process. Where there are no locks, it always is.

    Processes that a killed run had forked hold its lock until they see that it is gone: they are waited for.
    """
    try:
        import fcntl
    except ImportError:
        return True
    until = time.monotonic() + PATIENCE
    while True:
        try:
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return True
        except OSError:
            if time.monotonic() > until:
                return False
            time.sleep(0.02)
