"""Writing a file so that it is there whole or not at all."""

from __future__ import annotations

import uuid
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from bayestouch.errors import InputError


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """Write to a temporary neighbour of `path`, renamed onto it when the block ends well.

    Yields
    ------
    Path
        The temporary file to write to (same folder, so that the rename is atomic). It is removed
        if the block raises, and `path` keeps whatever it held.

    Raises
    ------
    InputError
        The folder cannot be written to. One raised in the block without a file is given `path`.
    """
    target = Path(path)
    # A name of our own instead of `tempfile`: that would give the result mode 0600 whatever the umask.
    temporary = target.with_name(f".{target.name}.{uuid.uuid4().hex}.tmp")
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


def write_together(writers: Mapping[Path, Callable[[Path], None]]) -> None:
    """Write several files; none is put in place before all are written in full.

    Parameters
    ----------
    writers : mapping of path to function
        Each function writes its content to the path it is given.

    Raises
    ------
    InputError
        As `replacing`.
    """
    with ExitStack() as stack:
        for path, write in writers.items():
            write(stack.enter_context(replacing(path)))


@contextmanager
def reading(path: str | Path) -> Iterator[Path]:
    """Turn everything the file system may refuse into one clear line.

    Raises
    ------
    InputError
        `path` is missing, is not a regular file, or may not be read.
    """
    file = Path(path)
    try:
        # Asked first, because opening a pipe would wait for ever.
        if not file.exists():
            raise InputError("no such file", file=file)
        if not file.is_file():
            raise InputError("expected a file, found something else of that name", file=file)
        yield file
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror or error}", file=file) from error
