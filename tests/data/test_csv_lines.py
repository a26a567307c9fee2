"""Lines of a file: as Python splits a text into lines, however few bytes are read at a time."""

from __future__ import annotations

import io
from pathlib import Path
from unittest.mock import patch

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bayestouch.data import csv_lines
from bayestouch.data.csv_lines import Lines
from bayestouch.errors import InputError

TEXTS = st.lists(st.sampled_from(["a", "1,2", "µm", "\n", "\r", "\r\n", "", "🙂", "\ufeff"]), max_size=24).map("".join)


def lines_of(data: bytes, longest: int = 1000) -> Lines:
    return Lines(io.BytesIO(data), Path("table.csv"), longest)


@given(TEXTS, st.integers(3, 7))
@settings(max_examples=500, deadline=None)
def test_lines_are_those_of_a_text_file(text: str, ahead: int) -> None:
    data = text.encode()
    with patch.object(csv_lines, "READ_AHEAD", ahead):
        lines = lines_of(data)
        looked = []
        while line := lines.look():
            looked.append(line)
            assert next(lines) == line
        expected = list(io.TextIOWrapper(io.BytesIO(data), encoding="utf-8-sig", newline=""))
        assert looked == expected and lines.taken == len(expected)
        assert next(lines, None) is None


@given(st.lists(st.sampled_from(["", "1,2", "µ", "\r"]), max_size=12), st.booleans(), st.data())
@settings(max_examples=500, deadline=None)
def test_blocks_and_single_lines_take_turns(texts: list[str], closed: bool, data: st.DataObject) -> None:
    """Whatever is taken in between, the bytes that come out in order are those of the file."""
    content = ("\n".join(texts) + ("\n" if closed else "")).encode()
    out = b""
    with patch.object(csv_lines, "READ_AHEAD", data.draw(st.integers(1, 5))):
        lines = lines_of(content)
        while lines.look():
            if data.draw(st.booleans()):
                out += next(lines).encode()
                continue
            block = lines.block(n := data.draw(st.integers(1, 4)))
            remains = content[len(out) :].split(b"\n")
            assert block == content[len(out) :][: len(b"\n".join(remains[:n])) + 1]
            assert lines.block(n) == block  # not taken yet
            before = lines.taken
            lines.take_block(block, count := len(block.splitlines()))
            assert lines.taken == before + count
            out += block
    assert out == content


def test_a_block_of_very_long_lines_has_fewer_of_them() -> None:
    data = b"x" * 40 + b"\n" + b"y" * 40 + b"\n" + b"z\n"
    with patch.object(csv_lines, "READ_AHEAD", 10), patch.object(csv_lines, "MOST_HELD", 60):
        lines = lines_of(data)
        assert lines.block(3) == data[:41]


@pytest.mark.parametrize("ahead", [3, 1 << 20])
def test_a_line_that_is_too_long_is_named(ahead: int) -> None:
    with patch.object(csv_lines, "READ_AHEAD", ahead):
        lines = lines_of(b"12345\n\xc2\xb5\xc2\xb5\xc2\xb5\xc2\xb5\xc2\xb5\n123456\n", longest=6)
        assert [next(lines), next(lines)] == ["12345\n", "µµµµµ\n"]
        assert lines.look() == ""
        with pytest.raises(InputError, match=r"table\.csv, row 3: expected a line of at most 6 characters"):
            next(lines)


def test_a_line_without_end_is_not_read_whole() -> None:
    stream = io.BytesIO(b"x" * 1000)
    with patch.object(csv_lines, "READ_AHEAD", 10):
        lines = Lines(stream, Path("table.csv"), 6)
        with pytest.raises(InputError, match="at most 6 characters"):
            next(lines)
    assert stream.tell() < 100


def test_a_bad_byte_counts_where_its_line_is_taken() -> None:
    lines = lines_of(b"a\n\xff\n")
    assert next(lines) == "a\n" and lines.look() == ""
    with pytest.raises(UnicodeDecodeError):
        next(lines)
