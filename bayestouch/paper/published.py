"""Numbers that the paper printed: Tables 1 to 4 and every number of its text, with location, unit and quotation.

Source: E. J. Nicolson and R. S. Fearing, "The Reliability of Curvature Estimates from Linear Elastic Tactile
Sensors", 1995. Values are as printed, never corrected; `NOTES` lists their contradictions.

Examples
--------
>>> from bayestouch.paper import published
>>> published.TABLE_3[6].hertz_model
7.6
>>> print(published.number("spacing"))
1.52 mm (Figure 7, caption)
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from bayestouch.paper._published_notes import NOTES, Note
from bayestouch.paper._published_text import SENTENCES

__all__ = [
    "NOTES",
    "TABLE_1",
    "TABLE_2",
    "TABLE_3",
    "TABLE_4",
    "ErrorRow",
    "FitRow",
    "Note",
    "PublishedNumber",
    "RadiusRow",
    "all_numbers",
    "number",
]

_TABLE_1 = {
    ("sigma", "1"): "σ 0.41 0.46 0.48",
    ("r_s", "mm"): "r_s (mm) 9.8 10.3 10.7",
    ("error", "% peak strain"): "Error (% Peak) 1.28 2.16 3.95",
    ("noise_level", "% peak strain"): "Noise Level (% Peak) 0.95 1.72 2.87",
}
_TABLE_2 = {("error", "% peak strain"): "0.93 1.41 1.76"}
_TABLE_3 = """
0.50  0.41 0.52   0.95  0.99
1.59  1.34 1.77   2.39  2.53
3.90  2.09 2.46   3.37  3.33
6.01  3.71 4.28   5.84  6.01
7.55  5.22 5.58   8.17  7.92
9.30  5.85 6.23   9.41  9.03
12.30 7.60 7.81  12.94 11.89
18.71 8.58 8.64  15.51 13.77
25.25 9.90 9.91  19.36 16.50
"""
_TABLE_4 = {
    ("model", "total"): "Total 0.24 13.1 1.26",
    ("model", "location"): "Location 0.20 9.1 1.00",
    ("model", "noise"): "Noise 0.14 9.6 0.79",
    ("empirical", "total"): "Total 0.24 11.7 0.96",
    ("empirical", "location"): "Location 0.19 6.4 0.60",
    ("empirical", "noise"): "Noise 0.14 9.8 0.77",
}
_TABLE_3_COLUMNS = {
    "r_c": "Actual r_c",
    "hertz_model": "Hertz contact model, Model calibration",
    "hertz_empirical": "Hertz contact model, Empirical calibration",
    "frictionless_model": "Approximate frictionless contact model, Model calibration",
    "frictionless_empirical": "Approximate frictionless contact model, Empirical calibration",
}
_TABLE_4_COLUMNS = {"theta_c": ("θ_c", "degree"), "P": ("P", "N/m"), "R": ("R", "mm")}


@dataclass(frozen=True)
class PublishedNumber:
    """One number that the paper printed.

    Attributes
    ----------
    key : str
        Unique name, such as ``table_3[12.30].hertz_model`` or ``spacing``.
    value : float
        The number, in `unit`.
    unit : str
        Unit in the notation of bayestouch; ``1`` for counts and ratios.
    where : str
        Location in the paper: table, row and column; section; or caption.
    quote : str
        The row or the words that contain the number.
    printed : str
        The number as printed: digits, a fraction or a word.
    """

    key: str
    value: float
    unit: str
    where: str
    quote: str
    printed: str

    @property
    def rounding(self) -> float:
        """Half a unit of the last printed digit, in `unit`; 0 for a fraction or a word."""
        if not self.printed.lstrip("-").replace(".", "", 1).isdigit():
            return 0.0
        return float(0.5 * 10.0 ** -len(self.printed.partition(".")[2]))

    def __str__(self) -> str:
        unit = "" if self.unit == "1" else f" {self.unit}"
        return f"{self.printed}{unit} ({self.where})"


@dataclass(frozen=True)
class FitRow:
    """A row of Table 1, or Table 2: minimum, mean and maximum of a fitted quantity over the elements."""

    quantity: str
    unit: str
    minimum: float
    average: float
    maximum: float


@dataclass(frozen=True)
class RadiusRow:
    """A row of Table 3: mean estimates of the indenter radius r_c in mm, by contact model and calibration."""

    r_c: float
    hertz_model: float
    hertz_empirical: float
    frictionless_model: float
    frictionless_empirical: float


@dataclass(frozen=True)
class ErrorRow:
    """A row of Table 4: standard deviations of the errors in θ_c (degree), P (N/m) and R (mm).

    `calibration` is ``model`` or ``empirical``; `part` is ``total``, ``location`` or ``noise``.
    """

    calibration: str
    part: str
    theta_c: float
    P: float
    R: float


def _last(row: str, count: int) -> list[float]:
    return [float(cell) for cell in row.split()[-count:]]


TABLE_1 = tuple(FitRow(name, unit, *_last(row, 3)) for (name, unit), row in _TABLE_1.items())
TABLE_2 = tuple(FitRow(name, unit, *_last(row, 3)) for (name, unit), row in _TABLE_2.items())
TABLE_3 = tuple(RadiusRow(*_last(row, 5)) for row in _TABLE_3.strip().splitlines())
TABLE_4 = tuple(ErrorRow(*names, *_last(row, 3)) for names, row in _TABLE_4.items())


def _table_numbers() -> Iterator[PublishedNumber]:
    for table, rows in (("1", _TABLE_1), ("2", _TABLE_2)):
        for (name, unit), row in rows.items():
            for column, cell in zip(("Min", "Avg", "Max"), row.split()[-3:], strict=True):
                where = f"Table {table}, row {name}, column {column}"
                yield PublishedNumber(f"table_{table}.{name}.{column.lower()}", float(cell), unit, where, row, cell)
    for row in _TABLE_3.strip().splitlines():
        cells = row.split()
        for (name, title), cell in zip(_TABLE_3_COLUMNS.items(), cells, strict=True):
            where = f"Table 3, row {cells[0]}, column {title}"
            key = f"table_3[{cells[0]}].{name}"
            yield PublishedNumber(key, float(cell), "mm", where, " ".join(cells), cell)
    for (calibration, part), row in _TABLE_4.items():
        for (name, (title, unit)), cell in zip(_TABLE_4_COLUMNS.items(), row.split()[-3:], strict=True):
            where = f"Table 4, rows {calibration.capitalize()} based, row {part.capitalize()}, column {title}"
            key = f"table_4.{calibration}.{part}.{name}"
            yield PublishedNumber(key, float(cell), unit, where, row, cell)


def _text_numbers() -> Iterator[PublishedNumber]:
    for where, quote, numbers in SENTENCES:
        for key, printed, unit, *value in numbers:
            yield PublishedNumber(key, value[0] if value else float(printed), unit, where, quote, printed)


_NUMBERS = {item.key: item for item in (*_table_numbers(), *_text_numbers())}


def all_numbers() -> Iterator[PublishedNumber]:
    """Return an iterator over all numbers of the paper: the four tables row by row, then the text in order."""
    return iter(_NUMBERS.values())


def number(key: str) -> PublishedNumber:
    """Return the published number with the given key.

    Raises
    ------
    KeyError
        If the paper has no number with this key.
    """
    return _NUMBERS[key]
