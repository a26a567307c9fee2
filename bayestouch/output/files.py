"""Writing a report completely or not at all."""

from __future__ import annotations

import json
import shutil
import uuid
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from bayestouch.errors import InputError

PAGE, NUMBERS, COMPARED = "index.html", "report.json", "comparison.json"
#: Files that list the figures of a folder: of a report, of a comparison, or of a diagnosis.
LISTS = (NUMBERS, COMPARED, "diagnosis.json")


@contextmanager
def new_folder(output: Path) -> Iterator[Path]:
    """Yield a temporary folder beside `output`, which becomes `output` when the block ends without an error.

    After an error the temporary folder is removed. If `output` exists, its files are replaced one by one by complete
    files, the page last. Files with other names remain, except figures that only the lists had which are replaced.

    Raises
    ------
    InputError
        `output` is a file, or its folder cannot be written to.
    """
    if output.exists() and not output.is_dir():
        raise InputError("expected the name of a folder to write, this is a file", file=output)
    # The name is cut, as in `bayestouch.data.files.temporary_name`.
    temporary = output.absolute().parent / f".{output.absolute().name[:40]}.{uuid.uuid4().hex}.tmp"
    try:
        temporary.mkdir(parents=True)
    except OSError as error:
        raise InputError(f"cannot be written: {error.strerror or error}", file=output) from error
    try:
        yield temporary
        try:
            _move(temporary, output)
        except OSError as error:
            raise InputError(f"cannot be written: {error.strerror or error}", file=output) from error
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def _move(new: Path, output: Path) -> None:
    if not output.exists():
        new.rename(output)
        return
    replaced = {name for name in LISTS if (new / name).exists()}
    stale = _figures_of(output, replaced) - _figures_of(new, replaced) - _figures_of(output, {*LISTS} - replaced)
    files = sorted(path.relative_to(new) for path in new.rglob("*") if path.is_file())
    files.sort(key=lambda file: (file.name == PAGE, file.name in LISTS))
    for file in files:
        (output / file).parent.mkdir(parents=True, exist_ok=True)
        (new / file).replace(output / file)
    for name in stale:
        with suppress(OSError):
            (output / "figures" / Path(name).name).unlink()


def _figures_of(folder: Path, lists: set[str]) -> set[str]:
    """Names of the figures in these lists of a folder, of those that there are."""
    found: set[str] = set()
    for name in lists:
        with suppress(OSError, ValueError, KeyError, TypeError):
            figures = json.loads((folder / name).read_text("utf-8"))["figures"]
            found |= {str(figure["file"]) for figure in figures}
    return found


def write_text(path: Path, text: str) -> None:
    """Write UTF-8 text with Unix line ends."""
    path.write_text(text, encoding="utf-8", newline="\n")


def write_numbers(path: Path, numbers: Mapping[str, Any]) -> None:
    """Write strict JSON: no NaN, no Infinity."""
    write_text(path, json.dumps(numbers, indent=1, ensure_ascii=False, allow_nan=False) + "\n")


def write_pictures(folder: Path, pictures: Sequence[Any]) -> None:
    """Write every figure to the figures of the folder."""
    (folder / "figures").mkdir(exist_ok=True)
    for picture in pictures:
        (folder / picture.file).write_bytes(picture.content)
