"""Fresh fingers with the forms of the blind studies: what is drawn, and tables counted by hand."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import pytest
from study_modules import study

from bayestouch.diagnosis.imitations import SHARES, SOMETHING_ELSE

module = study("causes_of_forms")
PLANNED = module.planned()


def test_kinds_are_as_frequent_as_in_the_third_study() -> None:
    """Of 1,000 draws a share p is within four standard errors, four times sqrt(p (1 - p)/1000)."""
    found = Counter(case.kind for case in PLANNED)
    for kind, share in module.KINDS.items():
        assert abs(found[kind] / 1000 - share) < 4 * (share * (1 - share) / 1000) ** 0.5
    assert [case.seed for case in PLANNED] == list(range(123_000, 124_000))


def test_every_form_is_drawn_and_no_effect_twice_in_a_finger() -> None:
    registries = [each.registry for each in module.BLIND_STUDIES.values()]
    every = {form.key for each in registries for form in (*each.LISTED, *each.UNLISTED)}
    drawn = Counter(key for case in PLANNED for key, _ in case.effects)
    # Of about 890 draws of 210 listed forms hardly one is left out: exp(-890/210) of them, 1.5 %.
    assert set(drawn) <= every and len(drawn) > 0.95 * len(every)
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


def result(seed: int, truth: list[str], verdict: str, stated: list[str], **sets: float) -> dict[str, Any]:
    of = [{"names": key.split("__"), "probability": each} for key, each in sets.items()]
    kind = {0: "none", 1: "one", 2: "pair"}[len(truth)]
    return {"seed": seed, "key": str(seed), "kind": kind, "truth": truth, "verdict": verdict, "stated": stated} | {
        "fitted": of,
        "version": "1",
    }


def test_tables_are_of_what_the_package_said() -> None:
    """Two fingers with statements of 90 and 60 %, of which the first is right: off by 10 and 60 %, 35 % on average."""
    one, two = (result(123_000 + i, ["creep"], "explained", ["creep"], creep=1.0) for i in range(2))
    one["causes"] = [{"names": ["creep"], "probability": 0.9}, {"names": ["memory"], "probability": 0.1}]
    two["causes"] = [{"names": ["memory"], "probability": 0.6}, {"names": ["creep"], "probability": 0.4}]
    text = module.summary([one, two, {"version": "1", "key": "x", "error": "E"}])
    assert text.startswith(
        "2 fingers. Version of the code: `1`. Diagnoses that failed: 1; out of reach of the size: 0;"
    )
    assert "Expected calibration error 0.350" in text


def test_fingers_of_development_have_the_shares_of_the_package() -> None:
    sets = {"creep__memory": 0.25, "creep": 0.75}
    found = module.allowed(result(120_000, ["creep"], "explained", ["creep"], **sets))
    probability, of = {tuple(each["names"]): each["probability"] for each in found["causes"]}, SHARES[False]
    there = of.alone * (0.75 + 0.25 * (1 - of.passed_over))
    assert probability["creep",] == pytest.approx(there * (1 - of.more))
    assert probability["creep", SOMETHING_ELSE] == pytest.approx(there * of.more)
    assert sum(probability.values()) == pytest.approx(1)


def test_results_of_two_versions_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lines = tmp_path / "lines.jsonl"
    lines.write_text('{"key": "a", "version": "of another code"}\n', encoding="utf-8")
    with pytest.raises(SystemExit) as ended:
        module.main(["-o", str(lines), "--cases", "1"])
    assert ended.value.code == 2 and "of another code" in capsys.readouterr().err
