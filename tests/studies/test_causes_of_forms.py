"""Fresh fingers with the forms of the blind studies: what is drawn, and tables counted by hand."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import pytest
from study_modules import study

from bayestouch.diagnosis.imitations import NOTHING_LEFT, SOMETHING_ELSE
from bayestouch.diagnosis.place_or_time import IN_PLACE

module = study("causes_of_forms")
PLANNED = module.planned()


def test_kinds_are_as_frequent_as_in_the_third_study() -> None:
    """Of 1,200 draws a share p is within four standard errors, four times sqrt(p (1 - p)/1200)."""
    found = Counter(case.kind for case in PLANNED)
    for kind, share in module.KINDS.items():
        assert abs(found[kind] / 1200 - share) < 4 * (share * (1 - share) / 1200) ** 0.5
    assert [case.seed for case in PLANNED] == list(range(120_000, 121_200))


def test_every_form_is_drawn_and_no_effect_twice_in_a_finger() -> None:
    registries = [each.registry for each in module.BLIND_STUDIES.values()]
    every = {form.key for each in registries for form in (*each.LISTED, *each.UNLISTED)}
    drawn = Counter(key for case in PLANNED for key, _ in case.effects)
    # Of 1,094 draws of 210 listed forms hardly one is left out: exp(-1094/210) of them, 0.5 %.
    assert set(drawn) <= every and len(drawn) > 0.97 * len(every)
    for case in PLANNED:
        names = [module.EFFECTS[key].name for key, _ in case.effects]
        assert len(set(names)) == len(names) == {"none": 0, "pair": 2}.get(case.kind, 1)
        assert {module.EFFECTS[key].listed for key, _ in case.effects} <= {case.kind != "unlisted"}
        assert all(size in module.SIZES[case.kind] for _, size in case.effects)
    assert {(case.rubber, case.order) for case in PLANNED} == set(module.CONDITIONS)


def test_a_cause_that_the_catalogue_describes_since_is_an_effect() -> None:
    warm = next(case for case in PLANNED if case.names == ["warm_column"])
    assert warm.kind == "unlisted"
    assert module.known(warm) == {"kind": "one", "truth": ["prober_eccentricity"]}
    pair = next(case for case in PLANNED if case.kind == "pair")
    assert module.known(pair) == {"kind": "pair", "truth": pair.names}


def result(seed: int, truth: list[str], verdict: str, stated: list[str], fitted: dict[str, float]) -> dict[str, Any]:
    sets = [{"names": key.split("+"), "probability": each} for key, each in fitted.items()]
    kind = {0: "none", 1: "one", 2: "pair"}[len(truth)]
    return {"seed": seed, "key": str(seed), "kind": kind, "truth": truth, "verdict": verdict, "stated": stated} | {
        "fitted": sets,
        "version": "1",
    }


def test_shares_are_of_the_first_and_tables_of_the_others() -> None:
    """Three of four first causes are there where nothing is left: a sure cause then has 75 %."""
    first = [
        result(120_000 + i, ["creep"], "explained", ["creep" if i else "memory"], {"creep": 1.0}) for i in range(4)
    ]
    rest = [result(120_200, ["creep"], "explained", ["creep"], {"creep": 0.9, "memory": 0.1})]
    text, allowed = module.summary([*first, *rest, {"version": "1", "key": "x", "error": "E"}])
    by_package, again = text.split("Shares counted again, on 4 other fingers")
    assert "| named first, nothing left | 3 of 4 | 0.75 |" in again and "Diagnoses that failed: 1" in by_package
    # One finger, whose statement of 67.5 % is right: it is off by 32.5 %.
    assert "Expected calibration error 0.325" in again
    assert IN_PLACE not in text
    (found,) = allowed
    sets, share = {tuple(each["names"]): each["probability"] for each in found["causes"]}, NOTHING_LEFT.first
    assert sets == pytest.approx({("creep",): 0.9 * share, ("memory",): 0.1 * share, (SOMETHING_ELSE,): 1 - share})
    assert f"Expected calibration error {1 - 0.9 * share:.3f}" in by_package


def test_few_results_are_no_table() -> None:
    text, allowed = module.summary([result(120_000, [], "adequate", ["nothing"], {"nothing": 1.0})])
    assert "too few for tables" in text and allowed == []


def test_results_of_two_versions_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lines = tmp_path / "lines.jsonl"
    lines.write_text('{"key": "a", "version": "of another code"}\n', encoding="utf-8")
    with pytest.raises(SystemExit) as ended:
        module.main(["-o", str(lines), "--cases", "1"])
    assert ended.value.code == 2 and "of another code" in capsys.readouterr().err
