"""Shares of named causes that are there: counted by hand, and those of the package counted again from the results."""

from __future__ import annotations

from typing import Any

import pytest
from study_modules import study

from bayestouch.diagnosis import imitations as package

module = study("imitations")


def result(kind: str, truth: list[str], verdict: str, *stated: str) -> dict[str, Any]:
    causes = [{"names": list(stated), "probability": 1.0}]
    return {"kind": kind, "truth": truth, "verdict": verdict, "stated": list(stated), "causes": causes}


def test_counts_by_hand() -> None:
    found = module.counted(
        [
            result("one", ["creep"], "explained", "creep", "memory"),
            result("pair", ["creep", "memory"], "explained", "memory", "creep", "gain_drift"),
            result("unlisted", ["grain"], "partly explained", "soft_spot"),
            result("unlisted", ["grain"], "unattributed", "something in place"),
            result("one", ["creep"], "unattributed", "something in place"),
            result("none", [], "adequate", "nothing"),
            {"error": "failed"},
        ]
    )
    assert [str(found[row]) for row in module.ROWS] == ["2 of 2", "0 of 1", "1 of 3", "0 of 0", "1 of 2"]


def test_each_study_has_half_of_the_weight_unless_it_has_few() -> None:
    row, other = list(module.ROWS)[:2]
    rest = dict.fromkeys(module.ROWS, module.Count(1, 1))
    one = {**rest, row: module.Count(90, 100), other: module.Count(60, 100)}
    two = {**rest, row: module.Count(10, 10), other: module.Count(9, 9)}
    found = module.shares([one, two])
    assert found[row] == pytest.approx(0.95) and found[other] == pytest.approx(69 / 109)


def test_the_package_has_these_shares() -> None:
    """To half a unit of the second digit, which they are stated with."""
    found = module.shares(list(module.results().values()))
    for (name, structure_left), share in found.items():
        stated = package.STRUCTURE_LEFT if structure_left else package.NOTHING_LEFT
        assert getattr(stated, name) == pytest.approx(share, abs=0.00501)
    assert package.NOTHING_LEFT.in_place == package.STRUCTURE_LEFT.in_place
