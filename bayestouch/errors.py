"""The one error a user causes: input or options that cannot be used."""

from __future__ import annotations

from pathlib import Path


class InputError(ValueError):
    """Input or options that cannot be used, told in one line.

    Parameters
    ----------
    message : str
        What is wrong and what was expected.
    file : str or Path, optional
        File at fault; only its name and folder as given are shown.
    row : int, optional
        Line number in the file; the header is line 1.
    column : str, optional
        Column or key at fault.
    """

    def __init__(
        self,
        message: str,
        *,
        file: str | Path | None = None,
        row: int | None = None,
        column: str | None = None,
    ) -> None:
        self.message = message
        self.file = None if file is None else str(file)
        self.row = row
        self.column = column
        place = ", ".join(
            part
            for part in (
                self.file,
                None if row is None else f"row {row}",
                None if column is None else f"column {column}",
            )
            if part
        )
        line = f"{place}: {message}" if place else message
        super().__init__(" ".join(line.split()))
