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
    return {"kind": kind, "truth": truth, "verdict": verdict, "stated": list(stated), "causes": causes} | {
        "best": None,
        "not_distinguishable": [],
    }


def test_counts_by_hand() -> None:
    """Of three places alone the best effect is there in one; it is not where it is one of two."""
    place = result("one", ["creep"], "unattributed", "something in place")
    place["best"] = ("creep",)
    found = module.counted(
        [
            result("one", ["creep"], "explained", "creep", "memory"),
            result("pair", ["creep", "memory"], "explained", "memory", "creep", "gain_drift"),
            result("one", ["creep"], "explained", "memory", "creep"),
            result("one", ["creep"], "explained", "creep"),
            result("pair", ["creep", "memory"], "partly explained", "creep"),
            result("unlisted", ["grain"], "partly explained", "soft_spot"),
            result("unlisted", ["grain"], "unattributed", "something in place"),
            result("none", [], "adequate", "nothing"),
            place,
            {**place, "kind": "pair", "truth": ["creep", "memory"]},
        ]
    )
    counts = {row: str(count) for row, count in found.items() if count.of}
    assert counts == {
        ("alone", False): "1 of 1",
        ("first", False): "2 of 3",
        ("beside", False): "1 of 2",
        ("instead", False): "1 of 1",
        ("further", False): "0 of 1",
        ("more", False): "0 of 4",
        ("alone", True): "1 of 2",
        ("more", True): "1 of 1",
        ("unlisted", None): "1 of 3",
        ("hidden", None): "1 of 3",
    }


def test_what_was_passed_over_counts_with_its_probability() -> None:
    """A drift in time, too, by whether one was simulated; nothing is passed over where all is left open."""
    sets = {("creep",): 0.5, ("creep", "memory"): 0.25, ("creep", "something in time", IN_PLACE): 0.25}
    fitted = {"causes": [{"names": list(names), "probability": each} for names, each in sets.items()]}
    one = {**result("pair", ["creep", "memory"], "explained", "creep"), **fitted}
    two = {**result("pair", ["creep", "gain_drift"], "explained", "creep"), **fitted}
    found = module.counted([one, two, {**two, "verdict": "unattributed", "stated": [IN_PLACE]}])
    assert found["passed_over", False] == module.Count(0.25, 0.5)
    assert found["in_time", None] == module.Count(0.25, 0.5)
    assert found["passed_over", True] == module.Count()
    rival = {**two, "stated": ["memory"], "not_distinguishable": [["memory", "creep"]]}
    found = module.counted([rival])
    # In two of the three sets "creep" stands in place of "memory", and only beside it was it passed over.
    assert found["passed_over", False] == module.Count(0.25, 0.25)
    assert found["in_time", None] == module.Count(0.25, 0.25)


def test_each_finger_has_the_same_weight() -> None:
    row = next(iter(module.ROWS))
    one = dict.fromkeys(module.ROWS, module.Count(90, 100))
    two = dict.fromkeys(module.ROWS, module.Count(8, 10))
    assert module.shares([one, two])[row] == pytest.approx(98 / 110)


@pytest.mark.parametrize("left", [False, True])
@pytest.mark.parametrize("had", ["HAD", "HAD_LATER"])
def test_probabilities_are_taken_back(left: bool, had: str) -> None:
    """Those that allow for imitations with earlier shares give those that do not."""
    before = [
        Causes(("creep", "memory", IN_PLACE), 0.5),
        Causes((IN_PLACE,), 0.2),
        Causes(("memory",), 0.15),
        Causes(("creep",), 0.1),
        Causes((NOTHING,), 0.05),
    ]
    of, best = getattr(module, had)[left], ("memory",)
    after = module.as_fitted(package.allowing(before, module.ALL_OPEN, of, best), of, best)
    found = {each.names: each.probability for each in after}
    assert found == pytest.approx({**dict.fromkeys(found, 0.0), **{each.names: each.probability for each in before}})


def test_the_package_has_these_shares() -> None:
    """To half a unit of the second digit, which they are stated with."""
    counts = [module.counted(records) for records in module.results().values()]
    counted = module.by_structure(module.shares(counts))
    assert {left: asdict(of) for left, of in package.SHARES.items()} == {
        left: pytest.approx(asdict(of), abs=0.00501) for left, of in counted.items()
    }
