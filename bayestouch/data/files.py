"""Writing files completely or not at all, and reading with clear errors."""

from __future__ import annotations

import uuid
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from bayestouch.errors import InputError


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """Yield a temporary file in the folder of `path`; it replaces `path` when the block ends without an error.

    Yields
    ------
    Path
        The temporary file to write to (same folder, so that the rename is atomic). If the block raises,
        the temporary file is removed and `path` is not changed.

    Raises
    ------
    InputError
        The folder cannot be written to. An `InputError` from the block that names no file is raised with `path`.
    """
    target = Path(path)
    # Not `tempfile`: it would set mode 0600 regardless of the umask.
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
    """Write several files; none gets its final name before all are written completely.

    Parameters
    ----------
    writers : mapping of path to function
        Each function writes its content to the path that it receives.

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
    """Yield the path; errors of the file system become an `InputError` of one line.

    Raises
    ------
    InputError
        `path` is missing, is not a regular file, or may not be read.
    """
    file = Path(path)
    try:
        # Checked first, because opening a pipe would never return.
        if not file.exists():
            raise InputError("no such file", file=file)
        if not file.is_file():
            raise InputError("expected a file, found something else of that name", file=file)
        yield file
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror or error}", file=file) from error
