"""Printed numbers beside ours."""

from __future__ import annotations

import numpy as np
import pytest

from bayestouch import InputError, published
from bayestouch.reliability import Beside, Comparison
from bayestouch.reliability.comparison import shown


def all_rows(offset: float = 0.0) -> list[Beside]:
    return [Beside(number.key, number.value + offset, why="because") for number in published.all_numbers()]


def test_agreement_allows_for_rounding_and_intervals() -> None:
    assert Beside("cutoff.deep", 4.54).agrees  # printed 4.5
    assert not Beside("cutoff.deep", 4.56).agrees
    assert Beside("cutoff.deep", 5.0, 4.55, 5.5).agrees
    assert not Beside("cutoff.deep", 5.0, 4.56, 5.5).agrees
    assert Beside("location_error.over_spacing", 0.04).agrees  # a fraction has no rounding
    assert not Beside("tips.length", np.nan).agrees
    assert Beside("cutoff.deep", 5.0).difference == pytest.approx(0.5)


def test_comparison_is_complete_and_in_order() -> None:
    found = Comparison.of(reversed(all_rows()))
    assert [row.key for row in found.rows] == [number.key for number in published.all_numbers()]
    assert len(found.predicted) == len(found.rows)
    assert f"{len(found.rows)} agree" in found.counted()
    with pytest.raises(InputError, match=r"cutoff\.deep"):
        Comparison.of([row for row in all_rows() if row.key != "cutoff.deep"])
    with pytest.raises(InputError, match="two numbers"):
        Comparison.of([*all_rows(), Beside("cutoff.deep", 1.0)])


def test_page_has_every_row_once() -> None:
    page = Comparison.of(all_rows(0.1)).markdown()
    lines = [line for line in page.splitlines() if line.startswith("| `")]
    assert len(lines) == len(list(published.all_numbers()))
    assert all(line.count("|") == 7 for line in lines)
    assert [line for line in page.splitlines() if line.startswith("## ")][:4] == [f"## Table {i}" for i in range(1, 5)]


@pytest.mark.parametrize(
    ("value", "text"), [(0.0, "0"), (16.0, "16"), (0.05412, "0.0541"), (123.46, "123"), (-2.5, "-2.50"), (np.nan, "–")]
)
def test_numbers_are_shown_with_three_digits(value: float, text: str) -> None:
    assert shown(value) == text
