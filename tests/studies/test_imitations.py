"""Shares of named causes that are there: counted by hand, and those of the package counted again from the results."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import pytest
from study_modules import study

from bayestouch.diagnosis import imitations as package
from bayestouch.diagnosis.causes import NOTHING, Causes
from bayestouch.diagnosis.place_or_time import IN_PLACE

module = study("imitations")


def result(kind: str, truth: list[str], verdict: str, *stated: str) -> dict[str, Any]:
    causes = [{"names": list(stated), "probability": 1.0}]
    return {"kind": kind, "truth": truth, "verdict": verdict, "stated": list(stated), "causes": causes}


def test_counts_by_hand() -> None:
    """Of three places alone the best effect is there in one; it is not where it is one of two."""
    place = result("one", ["creep"], "unattributed", "something in place")
    place["causes"] += [
        {"names": names, "probability": 0.0} for names in (["something in time"], ["creep"], ["memory"])
    ]
    found = module.counted(
        [
            result("one", ["creep"], "explained", "creep", "memory"),
            result("pair", ["creep", "memory"], "explained", "memory", "creep", "gain_drift"),
            result("unlisted", ["grain"], "partly explained", "soft_spot"),
            result("unlisted", ["grain"], "unattributed", "something in place"),
            result("none", [], "adequate", "nothing"),
            place,
            {**place, "kind": "pair", "truth": ["creep", "memory"]},
        ]
    )
    counts = [str(found[row]) for row in module.ROWS]
    assert counts == ["2 of 2", "0 of 1", "1 of 3", "0 of 0", "1 of 3", "1 of 3"]


def test_each_study_has_the_same_weight() -> None:
    row = next(iter(module.ROWS))
    one = dict.fromkeys(module.ROWS, module.Count(90, 100))
    two = dict.fromkeys(module.ROWS, module.Count(10, 10))
    assert module.shares([one, two])[row] == pytest.approx(0.95)


@pytest.mark.parametrize("left", [False, True])
def test_probabilities_are_taken_back(left: bool) -> None:
    """Those that allow for imitations with the earlier shares give those that do not."""
    before = [
        Causes(("creep", "memory", IN_PLACE), 0.5),
        Causes((IN_PLACE,), 0.2),
        Causes(("memory",), 0.15),
        Causes(("creep",), 0.1),
        Causes((NOTHING,), 0.05),
    ]
    had = module.HAD[left]
    found = {each.names: each.probability for each in module.as_fitted(package.allowing(before, had, None), had)}
    assert found == pytest.approx({**dict.fromkeys(found, 0.0), **{each.names: each.probability for each in before}})


def test_the_package_has_these_shares() -> None:
    """To half a unit of the second digit, which they are stated with."""
    counts = [module.counted(records) for records in module.results().values()]
    for left, share in module.by_structure(module.shares(counts)).items():
        stated = package.STRUCTURE_LEFT if left else package.NOTHING_LEFT
        assert asdict(stated) == pytest.approx(asdict(share), abs=0.00501)
