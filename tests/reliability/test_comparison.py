"""The comparison with the paper's numbers: what agrees, and its page."""

from __future__ import annotations

from dataclasses import replace

import pytest

from bayestouch.paper import published
from bayestouch.reliability import Beside, PublishedComparison


@pytest.fixture(scope="module")
def exact() -> PublishedComparison:
    return PublishedComparison.of([Beside(n.key, n.value) for n in published.all_numbers()])


def test_a_number_agrees_within_rounding_and_interval() -> None:
    key = "table_4.model.noise.theta_c"  # 0.14 degree
    assert Beside(key, 0.1449).agrees and not Beside(key, 0.1451).agrees
    assert Beside(key, 0.2, 0.144, 0.3).agrees and not Beside(key, 0.2, 0.146, 0.3).agrees


def test_every_number_has_a_line_of_the_page(exact: PublishedComparison) -> None:
    lines = [line for line in exact.markdown().splitlines() if line.startswith("| `")]
    assert len(lines) == len(list(published.all_numbers()))
    assert all(line.count(" | ") == 5 or line.endswith("|  |") for line in lines)


def test_a_second_simulation_has_two_more_columns(exact: PublishedComparison) -> None:
    key = "table_2.error.min"
    after = {key: replace(Beside(key, 0.95), low=0.91, high=1.02)}
    by_key = {line.split("`")[1]: line for line in exact.markdown(after).splitlines() if line.startswith("| `")}
    plain = {line.split("`")[1]: line for line in exact.markdown().splitlines() if line.startswith("| `")}
    cells = [cell.strip() for cell in by_key[key].split("|")]
    assert cells[6:8] == ["0.950", "0.910 to 1.02"]
    other = [cell.strip() for cell in by_key["table_2.error.max"].split("|")]
    assert other[6:8] == ["", ""]
    assert other[:6] == [cell.strip() for cell in plain["table_2.error.max"].split("|")][:6]
