"""Tables read by pandas, many rows at a time: to the bit what the single rows say, and the same errors and notes."""

from __future__ import annotations

import csv
import io
import itertools
import math
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bayestouch.data import tables
from bayestouch.data.cells import MISSING, NumberReader
from bayestouch.data.plain_rows import plain_rows
from bayestouch.data.tables import Header, csv_pieces
from bayestouch.errors import InputError

#: Cells that two readers of tables may take for different things.
ODD = [
    "", " ", "\t", "nan", "NaN", " nan", "-NaN", "nan(1)", "NA", "Na", "n/a", "#N/A", "null", "None", "-", "?",
    "inf", "-inf", "+Inf", "Infinity", "INFINITY ", "infx", "1_0", "0x10", "1e5", "1E+05", "1d5", "1e", "e5",
    "1e999", "-1e999", "1e-999", "4.9e-324", "2.4e-324", "1.7976931348623159e308", "9007199254740993", "9" * 400,
    "0." + "0" * 400 + "1", "1.", ".5", "+.5", "-0", "00", "- 1", " 1", "1 ", "1 2", "1.2.3", "1,5", "1.234,5",
    "1'000", "True", "false", "TRUE", "FALSE", "١", "½", "\xa01", "1\u2028", "\ufeff1", "µ", '"', '"1"', '"1', '1"',
    '"1\n2"', '"1,5"', '""', "\x00", "1\x002", "\x1a", "\r", "\\", "'1'", "<NA>", "N/A", "1.0f", "0b1", "1j",
    "$1", "5%", "#", "//",
]  # fmt: skip
CELLS = st.one_of(
    st.floats().map(repr),
    st.floats(allow_nan=False).map("{:.20e}".format),
    st.integers().map(str),
    st.sampled_from(ODD),
)


def by_rows(*_: object) -> None:
    """Nothing is plain."""


def outcome(path: Path, wanted: Sequence[str], read: Callable[..., object]) -> object:
    """All that comes out of a file in pieces of three rows, floats by their bits."""

    def schema(header: Header) -> frozenset[str]:
        return frozenset(wanted) & frozenset(header.names)

    out: list[object] = []
    with ExitStack() as stack:
        stack.enter_context(patch.object(tables, "CHUNK", 3))
        stack.enter_context(patch.object(tables, "MAX_LINE", 1000))
        stack.enter_context(patch.object(tables, "plain_rows", read))
        try:
            for piece in csv_pieces(path, schema):
                for name, values in piece.numbers.items():
                    assert values.dtype == np.float64
                    out.append((name, [None if math.isnan(v) else v.hex() for v in values.tolist()]))
                for name, texts in piece.texts.items():
                    assert all(type(text) is str for text in texts)
                    out.append((name, list(texts)))
                assert piece.line.dtype == np.int64
                out += [piece.line.tolist(), piece.notes, piece.header]
        except InputError as error:
            out.append(str(error))
    return out


@st.composite
def files(draw: st.DrawFn) -> bytes:
    """A table, mostly plain, in one of the ways in which programs write them, with some damage."""
    width = draw(st.integers(1, 4))
    separator, end = draw(st.sampled_from(",,,;\t")), draw(st.sampled_from(["\n", "\n", "\r\n", "\r"]))
    plain = st.floats(allow_nan=False).map(repr)
    if separator != "," and draw(st.booleans()):
        plain = plain.map(lambda text: text.replace(".", ","))
    rows = draw(st.lists(st.lists(plain, min_size=width, max_size=width), max_size=12))
    for _ in range(draw(st.integers(0, 3)) if rows else 0):
        row = draw(st.sampled_from(rows))
        match draw(st.sampled_from(["cell", "cell", "cell", "cell", "longer", "shorter", "empty"])):
            case "cell" if row:
                row[draw(st.integers(0, len(row) - 1))] = draw(CELLS)
            case "longer":
                row.append(draw(CELLS))
            case "shorter":
                del row[-1:]
            case "empty":
                row[:] = [""] * len(row)
    lines = [separator.join(row) for row in [["a", "b", "c", "d"][:width], *rows]]
    for _ in range(draw(st.sampled_from([0, 0, 0, 1, 2]))):
        lines.insert(
            draw(st.integers(0, len(lines))), draw(st.sampled_from(["", " ", separator * (width - 1), "x" * 1001]))
        )
    data = (draw(st.sampled_from(["", "", "\ufeff"])) + end.join(lines) + draw(st.sampled_from(["", end]))).encode()
    if draw(st.sampled_from([False] * 9 + [True])):
        place = draw(st.integers(0, len(data)))
        data = data[:place] + draw(st.binary(min_size=1, max_size=2)) + data[place:]
    return data


@pytest.mark.slow
@given(files(), st.sampled_from(["abcd", "abcd", "ac", "b"]))
@settings(max_examples=1500, deadline=None)
def test_whatever_a_file_holds_it_is_read_as_by_single_rows(
    tmp_path_factory: pytest.TempPathFactory, data: bytes, wanted: str
) -> None:
    path = tmp_path_factory.getbasetemp() / "table.csv"
    path.write_bytes(data)
    assert outcome(path, wanted, plain_rows) == outcome(path, wanted, by_rows)


@pytest.mark.parametrize("separator", [",", ";"])
@pytest.mark.parametrize("cell", ODD)
def test_an_odd_cell_is_read_as_by_single_rows(tmp_path: Path, separator: str, cell: str) -> None:
    for table in [["1", cell]], [[cell, "1"]], [["1", "2"], [cell, cell]], [["1.5", cell]], [[cell, "1.5"], ["2", "3"]]:
        rows = [["a", "b"], *table]
        (tmp_path / "table.csv").write_text("\n".join(separator.join(row) for row in rows), newline="")
        for wanted in ("ab", "b", "a"):
            read, expected = (outcome(tmp_path / "table.csv", wanted, reader) for reader in (plain_rows, by_rows))
            assert read == expected


@pytest.mark.parametrize(("rows", "message"), [("1,2\n3\n4,5,6\n", "3.*got 1"), ("1,2,3\n4\n", "2.*got 3")])
def test_rows_too_short_and_too_long_do_not_make_up_for_each_other(tmp_path: Path, rows: str, message: str) -> None:
    (tmp_path / "table.csv").write_text("a,b\n" + rows)
    with pytest.raises(InputError, match=f"row {message}$"):
        tables.read_csv(tmp_path / "table.csv", lambda header: {"a", "b"})


def numbers_of(cells: Sequence[str], separator: str = ",") -> list[float] | None:
    """What the plain reader makes of cells in a column."""
    reader = NumberReader(Path("table.csv"), decimal_comma=separator != ",")
    read = plain_rows("".join(f"0{separator}{cell}\n" for cell in cells).encode(), 2, "ab", "ab", separator, reader)
    return None if read is None else read.numbers["b"].tolist()


def test_every_short_text_is_the_number_that_python_makes_of_it_or_left_to_single_rows() -> None:
    def check(cells: list[str]) -> int:
        if (values := numbers_of(cells)) is None:
            if len(cells) == 1:
                return 0
            return check(cells[: len(cells) // 2]) + check(cells[len(cells) // 2 :])
        for cell, value in zip(cells, values, strict=True):
            if math.isnan(value):
                assert not cell or cell.strip().lower() in MISSING
            else:
                assert value.hex() == float(cell).hex() and "_" not in cell
        return len(cells)

    alphabet = "019.+-eE_ inaf"
    texts = ["".join(letters) for n in range(4) for letters in itertools.product(alphabet, repeat=n)]
    # of the texts that are numbers to Python, only those with an underscore are left to single rows
    read = check(texts)
    assert read == sum(_is_number(text) or text in ("", "nan", "na") for text in texts)


def _is_number(text: str) -> bool:
    try:
        return "_" not in text and not math.isnan(float(text))
    except ValueError:
        return False


@given(st.lists(st.one_of(st.floats(allow_nan=False), st.floats(-1e3, 1e3)), min_size=1), st.data())
@settings(max_examples=300, deadline=None)
def test_numbers_are_exact_to_the_last_bit(values: list[float], data: st.DataObject) -> None:
    ways = st.sampled_from(["{!r}", "{:.17g}", "{:.6f}", "{:.40f}", "{:.3e}", "{:+.12E}"])
    cells = [data.draw(ways).format(value) for value in values]
    read = numbers_of(cells)
    assert read is not None
    assert [value.hex() for value in read] == [float(cell).hex() for cell in cells]


@pytest.mark.parametrize(
    "table",
    [
        "a,b\n1,2.5\n,inf\n-1e5,3",
        "\ufeffa,b\r\n1,2.5\r\n,inf\r\n",
        "a;b\n1;2,5\n;inf\n",
        "a\tb\n1\t2.5\n\tinf\n",
        "a,b\nnan,2.5\nNaN,\nn/a,1\n",
        "a,b,note\n1,2,an edge: µm; 5 %\n2,3, \n,,-\n",
    ],
)
def test_ordinary_tables_are_not_read_row_by_row(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, table: str) -> None:
    path = tmp_path / "table.csv"
    path.write_text(table, newline="", encoding="utf-8")
    monkeypatch.delattr(tables, "_row_by_row")
    read = tables.read_csv(path, lambda header: {"a", "b"})
    separator = next(mark for mark in "\t;," if mark in table.splitlines()[0])
    rows = list(csv.reader(io.StringIO(table.removeprefix("\ufeff"), newline=""), delimiter=separator))[1:]
    for k, name in enumerate("ab"):
        cells = [row[k].replace(",", ".").lower() for row in rows]
        expected = [math.nan if cell in ("", "nan", "n/a") else float(cell) for cell in cells]
        np.testing.assert_array_equal(read.numbers[name], expected)
    assert list(read.line) == list(range(2, 2 + len(rows)))
    assert {name: list(texts) for name, texts in read.texts.items()} == (
        {"note": [row[2] for row in rows]} if "note" in table else {}
    )


def test_a_row_that_is_not_plain_costs_its_piece_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Pieces before and after it are plain again, and every row keeps its place."""
    path = tmp_path / "table.csv"
    path.write_text("a,b\n" + "1,2\n" * 6 + '3,"x\ny"\n\n' + "1,2\n" * 7)
    seen: list[list[int]] = []
    read = tables._row_by_row
    monkeypatch.setattr(tables, "CHUNK", 3)
    monkeypatch.setattr(
        tables, "_row_by_row", lambda rows, *a: (seen.append([at for at, _ in rows]), read(rows, *a))[1]
    )
    table = tables.read_csv(path, lambda header: {"a"})
    assert table.line.tolist() == [2, 3, 4, 5, 6, 7, 8, 11, 12, 13, 14, 15, 16, 17]
    assert seen == [[8, 11, 12]]
    assert table.texts["b"].tolist() == ["2"] * 6 + ["x\ny"] + ["2"] * 7


def test_a_header_of_quotes_alone_is_none(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text('""\n')
    with pytest.raises(InputError, match="expected a header with column names"):
        tables.read_csv(path, lambda header: ())


@pytest.mark.parametrize("read", [plain_rows, by_rows])
@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_a_row_of_spaces_is_empty(tmp_path: Path, separator: str, read: Callable[..., object]) -> None:
    """As one without spaces; a row with one cell that says something is none."""
    path = tmp_path / "table.csv"
    rows = [["a", "note", "b"], ["1", "x", "2"], [" ", "", "  "], ["", " ", ""], ["", "", ""], ["", "y", " "]]
    path.write_text("\n".join(separator.join(row) for row in rows) + "\n")
    with patch.object(tables, "plain_rows", read):
        table = tables.read_csv(path, lambda header: ("a", "b"))
    assert table.line.tolist() == [2, 6] and table.texts["note"].tolist() == ["x", "y"]
    np.testing.assert_array_equal(table.numbers["a"], [1, np.nan])
    assert "table.csv: 3 empty rows skipped" in table.notes
