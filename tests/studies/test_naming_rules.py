"""Rules that name fewer causes: rates counted by hand, and the table of the page counted again."""

from __future__ import annotations

from typing import Any

import pytest
from study_modules import STUDIES, study

module = study("naming_rules")


def result(kind: str, truth: str, *named: str, probability: float = 0.5, source: str = "a") -> dict[str, Any]:
    """A result of a blind study."""
    return {
        "kind": kind,
        "truth": [truth],
        "sizes": {truth: 2.0},
        "verdict": "explained" if named else "unattributed",
        "effects_found": [{"name": name, "indistinguishable_from": []} for name in named],
        "in_place": None,
        "causes": [{"names": list(named) or ["something else"], "probability": probability}],
        "before": {"lack_of_fit": 3.0},
        "after": {"lack_of_fit": 1.1},
        "study": source,
    }


def test_rates_by_hand() -> None:
    """Named from 0.6 on: one of three single effects, and all but one of three unlisted causes are left."""
    of = [
        result("one", "creep", "creep", probability=0.9),
        result("one", "creep", "creep", probability=0.5),
        result("one", "creep", "memory", "creep", probability=0.9),
        result("unlisted", "grain"),
        result("unlisted", "grain", "creep", probability=0.5),
        result("unlisted", "grain", "creep", probability=0.7),
    ]
    score = {id(each): module.probability(each) for each in of if each["effects_found"]}
    assert module.rates(of, score, 0.0) == pytest.approx((2 / 3, 1 / 3))
    assert module.rates(of, score, 0.6) == pytest.approx((1 / 3, 2 / 3))


def test_the_forest_is_examined_on_studies_that_it_did_not_see() -> None:
    """In one study only creep is right, in the other only memory: each says the opposite of the other."""
    creep_is_right = [result("one", "creep", name, source="a") for name in ("creep", "memory") for _ in range(20)]
    memory_is_right = [result("one", "memory", name, source="b") for name in ("creep", "memory") for _ in range(20)]
    found = module.learned(creep_is_right + memory_is_right)
    assert max(found[:20] + found[60:]) < 0.01
    assert min(found[20:60]) > 0.99


@pytest.mark.parametrize(
    ("name", "one", "unlisted"),
    [
        ("blind_study", (92, 121), (72, 96)),
        ("second_blind_study", (92, 126), (64, 80)),
        ("third_blind_study", (332, 486), (109, 160)),
        ("fourth_blind_study", (79, 126), (21, 40)),
        ("fifth_blind_study", (28, 42), (13, 20)),
    ],
)
def test_diagnoses_are_counted_as_the_pages_count_them(
    name: str, one: tuple[int, int], unlisted: tuple[int, int]
) -> None:
    """Numbers that the first table of each page prints: failed diagnoses are wrong, whole fingers are apart."""
    page = (STUDIES.parent / "docs" / f"{name}.md").read_text("utf-8")
    assert f"named first | {one[0]} of {one[1]} |" in page and f"in place | {unlisted[0]} of {unlisted[1]} |" in page
    of = [each for each in module.records() if each["study"] == name]
    assert sum(map(module.is_right, of)) == one[0]
    assert sum(each["kind"] == "one" for each in of) == one[1]
    assert sum(each["kind"] == "unlisted" and module.is_left_unnamed(each) for each in of) == unlisted[0]
    assert sum(each["kind"] == "unlisted" for each in of) == unlisted[1]


@pytest.mark.slow
def test_the_table_of_the_page() -> None:
    """No rule reaches both aims, and the page has what the study prints."""
    rows = module.main()
    page = (STUDIES.parent / "docs" / "fifth_blind_study.md").read_text("utf-8")
    assert module.markdown_table(module.HEAD, rows) in page
    assert not any(float(left[:-2]) >= 90 and float(named[:-2]) >= 95 for _, left, named, _ in rows)
