"""Files of an interrupted run, from which the next run continues.

They are in a folder ``OUTPUT.partial`` next to the output: the incomplete posterior file, a fingerprint of the run
(data, options and versions), and the numbers of the finished blocks. The folder is removed when the output is complete.
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

#: Longest waiting time for a lock, seconds.
PATIENCE = 2.0

_RUN, _FINISHED, _LOCK = "run.json", "finished.txt", "lock"


@dataclass(frozen=True)
class Partial:
    """Folder with the files of one run.

    Attributes
    ----------
    folder : Path
        Path of the folder.
    target : Path
        File that the run writes.
    fingerprint : str
        Hash of everything that the result depends on.
    """

    folder: Path
    target: Path
    fingerprint: str

    @property
    def file(self) -> Path:
        """Path of the incomplete posterior file."""
        return self.folder / "posterior"

    def finished(self) -> set[int]:
        """Numbers of the blocks that are written to disk."""
        with suppress(FileNotFoundError):
            # A last line without an end was interrupted and does not count.
            whole, _, _ = (self.folder / _FINISHED).read_text().rpartition("\n")
            return {int(line) for line in whole.split()}
        return set()

    def add(self, block: int) -> None:
        """Record that a block is written to disk."""
        with (self.folder / _FINISHED).open("a") as stream:
            stream.write(f"{block}\n")
            stream.flush()
            _sync(stream)

    def layout(self) -> str | None:
        """Layout of the file of an earlier run with the same fingerprint, as text; None if there is no such run."""
        try:
            run = json.loads((self.folder / _RUN).read_text())
            same = run["fingerprint"] == self.fingerprint and self.file.is_file()
            return str(run["layout"]) if same else None
        except (OSError, ValueError, KeyError, TypeError):
            return None

    def begin(self, layout: str) -> None:
        """Record fingerprint and layout of the run, after the posterior file was created."""
        temporary = self.folder / f"{_RUN}.new"
        with temporary.open("w") as stream:
            json.dump({"fingerprint": self.fingerprint, "layout": layout}, stream)
            stream.flush()
            _sync(stream)
        temporary.replace(self.folder / _RUN)

    def clear(self) -> None:
        """Remove the files of an earlier run."""
        for name in (_RUN, _FINISHED, self.file.name):
            (self.folder / name).unlink(missing_ok=True)

    def deliver(self) -> None:
        """Move the complete posterior file to the output path, and remove the folder."""
        self.file.replace(self.target)
        # The lock last: as soon as it is gone, another run can begin in this folder.
        with suppress(OSError):
            self.clear()
        shutil.rmtree(self.folder, ignore_errors=True)


@contextmanager
def partial_folder(target: Path, fingerprint: str) -> Iterator[Partial]:
    """Folder of a run that writes `target`, new or left by an interrupted run; locked for this process.

    Raises
    ------
    InputError
        If it cannot be written, or another process is writing the same output.
    """
    folder = target.with_name(f"{target.name}.partial")
    try:
        with _lock_in(folder) as locked:
            if not locked:
                raise InputError("another run is writing this file", file=target)
            try:
                yield Partial(folder, target, fingerprint)
            except BaseException:
                # Nothing was written yet that another run could go on from; after `deliver` there is no folder.
                if folder.is_dir() and {each.name for each in folder.iterdir()} <= {_LOCK}:
                    shutil.rmtree(folder, ignore_errors=True)
                raise
    except OSError as error:
        raise InputError(f"cannot be written: {error.strerror or error}", file=target) from error


def fingerprint_of(*parts: Any) -> str:
    """Hash of arrays, dataclasses, mappings and any objects whose ``repr`` describes them completely."""
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
        # the repr of a dataclass may be only a summary, so its fields are used
        digest.update(f"{type(part).__qualname__}(".encode())
        _feed(digest, {each.name: getattr(part, each.name) for each in fields(part)})
    else:
        digest.update(f"{part!r};".encode())


def _sync(stream: IO[str]) -> None:
    os.fsync(stream.fileno())


@contextmanager
def _lock_in(folder: Path) -> Iterator[bool]:
    """True if this process holds the lock of the folder, which ends with the process."""
    until = time.monotonic() + PATIENCE
    while True:
        folder.mkdir(exist_ok=True)
        with (folder / _LOCK).open("w") as stream:
            locked = _locked(stream, until)
            # The run that had the lock removes folder and file when it is complete. A lock of a file that was removed
            # keeps nobody out, so the folder is made again.
            if not locked or _is_at(folder / _LOCK, stream) or time.monotonic() > until:
                yield locked
                return


def _is_at(path: Path, stream: IO[str]) -> bool:
    """True if this path is still that of an open file."""
    try:
        return os.path.samestat(os.fstat(stream.fileno()), path.stat())
    except FileNotFoundError:
        return False


def _locked(stream: IO[str], until: float) -> bool:
    """True if this process got the lock of an open file. Always true on systems without locks.

    Child processes of a killed run hold its lock until they notice that it has ended; this function waits for them.
    """
    try:
        import fcntl
    except ImportError:
        return True
    while True:
        try:
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return True
        except OSError:
            if time.monotonic() > until:
                return False
            time.sleep(0.02)
