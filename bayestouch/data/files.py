"""Writing files completely or not at all, and reading with clear errors."""

from __future__ import annotations

import os
import uuid
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from bayestouch.errors import InputError, shown


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """Yield a temporary file in the folder of `path`; it replaces `path` when the block ends without an error.

    If `path` is a symbolic link, the file is replaced that it leads to.

    Yields
    ------
    Path
        The temporary file to write to (same folder, so that the rename is atomic). If the block raises,
        the temporary file is removed and `path` is not changed.

    Raises
    ------
    InputError
        The folder cannot be written to, or `path` is a folder, pipe or device. An `InputError` from the block that
        names no file is raised with `path`.
    """
    target = file_to_write(path)
    temporary = target.with_name(temporary_name(target.name))
    try:
        yield temporary
        temporary.replace(target)
    except InputError as error:
        raise InputError(error.message, file=error.file or target, row=error.row, column=error.column) from None
    except OSError as error:
        raise InputError(f"cannot be written: {error.strerror or error}", file=target) from error
    finally:
        with suppress(OSError):
            temporary.unlink()


def path_of(path: str | Path) -> Path:
    """Return the path; anything else than a text or a path raises an error.

    Raises
    ------
    InputError
        It is neither.
    """
    if not isinstance(path, str | os.PathLike):
        raise InputError(f"expected a path, got {shown(path)}")
    return Path(path)


def file_to_write(path: str | Path) -> Path:
    """Return the path of the file that is written under this name: that to which a symbolic link leads.

    Raises
    ------
    InputError
        It is no path, or what is there is no regular file: a folder, a pipe or a device, which a new file would
        replace.
    """
    target = path_of(path)
    try:
        if target.is_symlink():
            target = Path(os.path.realpath(target))
        if target.exists() and not target.is_file():
            kind = "a folder" if target.is_dir() else "no regular file"
            raise InputError(f"expected the name of a file to write, this is {kind}", file=path)
    except OSError as error:  # a name that is too long
        raise InputError(f"cannot be written: {error.strerror or error}", file=path) from error
    return target


def temporary_name(name: str) -> str:
    """Return a new name for a temporary file or folder, which will be renamed to `name`."""
    # Not `tempfile`: it would set mode 0600 regardless of the umask. The name is cut: with more behind it, it could be
    # longer than file systems allow, 255 bytes on most, of which a character takes up to four.
    return f".{name[:40]}.{uuid.uuid4().hex}.tmp"


def check_writable(path: str | Path) -> None:
    """Raise an error if no file or folder can be written at this path, whose folders may have to be made.

    An empty temporary file is written in the nearest folder that exists, and removed.

    Raises
    ------
    InputError
        It cannot be written.
    """
    target = path_of(path)
    try:
        target.exists()  # raises an error for a name that is too long
        whole = target.absolute()
        nearest = next((each for each in whole.parents if each.exists()), whole)
        trial = nearest / temporary_name(whole.name)
        trial.touch(exist_ok=False)
        trial.unlink()
    except OSError as error:
        raise InputError(f"cannot be written: {error.strerror or error}", file=target) from error


def check_room(path: Path, size: int) -> None:
    """Raise `OSError` if the disk has no room for a new file of so many bytes at this path.

    The HDF5 library must not find this out: it prints tracebacks for each number that it cannot write, and may end the
    process.
    """
    with path.open("wb") as stream:
        if hasattr(os, "posix_fallocate") and size:
            os.posix_fallocate(stream.fileno(), 0, size)
    path.unlink()


def check_not_read(path: str | Path, inputs: Iterable[str | Path]) -> None:
    """Raise an error if the file to be written is one of the inputs, which would be lost.

    Raises
    ------
    InputError
        It is one of them, under this name or another one.
    """
    target = Path(path)
    if target.exists() and any(Path(each).exists() and target.samefile(each) for each in inputs):
        raise InputError("is read, so that it cannot be the output too; give another name", file=target)


def write_together(writers: Mapping[Path, Callable[[Path], None]]) -> None:
    """Write several files; none gets its final name before all are written completely.

    Parameters
    ----------
    writers : mapping of path to function
        Each function writes its content to the path that it receives.

    Raises
    ------
    InputError
        As `replacing`; then no file is replaced.
    """
    with ExitStack() as stack:
        for path, write in writers.items():
            write(stack.enter_context(replacing(path)))


@contextmanager
def reading(path: str | Path) -> Iterator[Path]:
    """Yield the path; errors of the file system become an `InputError` of one line.

    Raises
    ------
    InputError
        `path` is missing, is not a regular file, or may not be read.
    """
    file = path_of(path)
    try:
        # Checked first, because opening a pipe would never return.
        if not file.exists():
            raise InputError("no such file", file=file)
        if not file.is_file():
            raise InputError("expected a file, found something else of that name", file=file)
        yield file
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror or error}", file=file) from error
