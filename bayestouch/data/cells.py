"""Conversion of text cells to numbers; an error names the row and column of the first cell that is not a number."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.errors import InputError, shown

#: Words that other programs write where a number is missing.
MISSING = frozenset({"nan", "+nan", "-nan", "na", "n/a", "#n/a", "null", "none"})


class NumberReader:
    """Converts columns of one file to numbers and records the irregularities that it corrects.

    Parameters
    ----------
    file : Path
        Named in error messages and notes.
    decimal_comma : bool
        Whether ``1,5`` may mean 1.5 (where the comma does not separate columns).
    """

    def __init__(self, file: Path, *, decimal_comma: bool) -> None:
        self.file = file
        self.decimal_comma = decimal_comma
        self.decimal: str | None = None
        self.missing_words = 0
        self.first_missing_word = ""

    def numbers(self, cells: Sequence[str], column: str, rows: Sequence[int]) -> FloatArray:
        """Return one column as numbers.

        Parameters
        ----------
        cells : sequence of str
            Empty strings for missing numbers.
        column : str
        rows : sequence of int
            Line of each cell in the file.

        Returns
        -------
        float array, shape (n,)
            The double closest to each decimal number; NaN where missing.

        Raises
        ------
        InputError
            A cell is not a number; the message names the first such cell.
        """
        joined = "".join(cells)
        # float() accepts 1_000; this format does not.
        if "_" not in joined and not (self.decimal_comma and ("," in joined or "." in joined)):
            try:
                values = np.array([float(cell) if cell else math.nan for cell in cells], dtype=np.float64)
            except ValueError:
                pass
            else:
                if np.count_nonzero(np.isnan(values)) == cells.count(""):
                    return values
        return np.array(
            [self._number(cell.strip(), column, row) for cell, row in zip(cells, rows, strict=True)],
            dtype=np.float64,
        )

    def take_words(self, count: int, column: str, rows: Sequence[int]) -> None:
        """Count `count` words for a missing number in a column; the first word is in `rows[0]`."""
        if count:
            self.first_missing_word = self.first_missing_word or f"row {rows[0]}, column {column}"
            self.missing_words += count

    def notes(self) -> tuple[str, ...]:
        """Return one line for each irregularity that was corrected."""
        notes = []
        if self.decimal == ",":
            notes.append(f"{self.file.name}: read with decimal commas")
        if self.missing_words:
            notes.append(
                f"{self.file.name}: {self.missing_words} cells with a word for a missing number, "
                f"taken as missing; the first in {self.first_missing_word}"
            )
        return tuple(notes)

    def _number(self, cell: str, column: str, row: int) -> float:
        if not cell:
            return math.nan
        if cell.lower() in MISSING:
            self.take_words(1, column, [row])
            return math.nan
        text = cell
        if self.decimal_comma and (mark := "," if "," in cell else "." if "." in cell else None):
            self.decimal = self.decimal or mark
            if mark != self.decimal:
                kind = "comma" if self.decimal == "," else "point"
                message = f"expected a decimal {kind} as elsewhere in the file, got {shown(cell)}"
                raise InputError(message, file=self.file, row=row, column=column)
            # `1.234,5` has a point and a comma and fails below: which one groups thousands is not certain.
            text = cell.replace(",", ".", 1) if mark == "," and "." not in cell else cell
        try:
            if "_" not in text:
                return float(text)
        except ValueError:
            pass
        raise InputError(f"expected a number, got {shown(cell)}", file=self.file, row=row, column=column)
