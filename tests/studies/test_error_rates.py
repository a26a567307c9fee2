"""What `studies/error_rates.py` keeps and prints: results of one version of the code, of named fingers."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from study_modules import study

rates = study("error_rates")
MEMBER, OTHER = "proximity: Lorentzian", "gain_nonlinearity: tanh"
# Effects of a finger of each kind.
KINDS: dict[str, tuple[tuple[str, float], ...]] = {
    "none": (),
    "one": ((MEMBER, 1.0),),
    "pair": ((MEMBER, 1.5), (OTHER, 1.5)),
    "unlisted": (("far_lobe: ", 1.0),),
}


def result(case: Any, version: str, named: str | None = None) -> dict[str, Any]:
    """A made-up result of a case, in which `named` was found."""
    effects = [] if named is None else [{"name": named}]
    errors = {"lack_of_fit": 1.0, "R_bias_mm": 0.0, "R_rms_mm": 0.1, "theta_rms_deg": 0.1, "P_rms_N_per_m": 1.0}
    errors |= {"coverage_90": 0.9}
    return {
        "kind": case.kind,
        "effects": [list(each) for each in case.effects],
        "design": case.design,
        "key": case.key,
        "names": case.names,
        "finger": case.finger,
        "version": version,
        "seconds": 1.0,
        "cpu_seconds": 1.0,
        "diagnosis": {
            "verdict": "adequate" if named is None else "explained",
            "effects": effects,
            "before": errors,
            "after": errors,
        },
    }


@pytest.fixture
def runs(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Keys of the cases that were run; none is simulated."""
    done: list[str] = []

    def run(shared: object, case: Any) -> dict[str, Any]:
        done.append(case.key)
        return result(case, rates.code_version(), case.names[0] if case.names else None)

    monkeypatch.setattr(rates, "run", run)
    return done


def test_results_of_another_version_are_run_again(runs: list[str], tmp_path: Path) -> None:
    first, second = list(rates.cases(range(1), "small"))[:2]
    cache = tmp_path / "results.jsonl"
    old = [result(first, rates.code_version()), result(second, "0.1.0+0123456789")]
    cache.write_text("".join(json.dumps(each) + "\n" for each in old))
    got = rates.results(tmp_path, [first, second], 1, True, float("inf"))
    assert runs == [second.key]
    assert {record["version"] for record in got} == {rates.code_version()}
    # results from before versions were recorded are of another version, too
    unnamed = {key: value for key, value in old[0].items() if key != "version"}
    cache.write_text(json.dumps(unnamed) + "\n")
    rates.results(tmp_path, [first], 1, True, float("inf"))
    assert runs == [second.key, first.key]


def test_a_worker_with_other_code_is_refused(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(rates, "run", lambda shared, case: result(case, "0.1.0+0123456789"))
    with pytest.raises(RuntimeError, match=r"a worker runs version 0\.1\.0\+0123456789"):
        rates.results(tmp_path, list(rates.small_cases()), 1, True, float("inf"))


def test_a_page_holds_one_version() -> None:
    first, second = list(rates.cases(range(1), "small"))[:2]
    with pytest.raises(ValueError, match="one version"):
        rates.page([result(first, "a"), result(second, "b")])
    assert rates.newest([result(first, "a"), result(second, "b")]) == [result(second, "b")]


def test_the_version_changes_with_a_source(tmp_path: Path) -> None:
    versions = study("_error_rate_versions")
    source = tmp_path / "a.py"
    source.write_text("x = 1\n")
    before = versions.source_hash(tmp_path)
    assert versions.source_hash(tmp_path) == before
    source.write_text("x = 2\n")
    assert versions.source_hash(tmp_path) != before


@pytest.mark.slow
def test_fresh_fingers_are_run_and_named(runs: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The page says which fingers it holds, of which version, and leaves other versions out."""
    page = tmp_path / "docs" / "error_rates.md"
    page.parent.mkdir()
    old = result(rates.Case("none", (), 10_000, "small"), "0.1.0+0123456789")
    (tmp_path / "results.jsonl").write_text(json.dumps(old) + "\n")
    options = ["--small", "--fingers", "2", "--seeds-from", "100", "--processes", "1", "--docs", str(page)]
    records = rates.main(["-o", str(tmp_path), *options])
    assert len(runs) == len(records) == 2 * len(list(rates.cases(range(1), "small")))
    assert {record["finger"] for record in records} == {100, 101}
    assert "1 results of other versions are left out" in capsys.readouterr().out
    text = page.read_text("utf-8")
    assert f"`{rates.code_version()}`" in text
    assert "**Fresh: fingers 100 to 101.**" in text
    assert "**Development set: fingers" not in text
    assert "## Small fingers 100 to 101 (fresh)" in text
    assert f"{len(records)} diagnoses of 2 small fingers 100 to 101 (fresh)" in text
    assert (page.parent / "figures" / "error_rates_detection.png").stat().st_size > 0


def test_fingers_that_were_looked_at_are_called_a_development_set() -> None:
    cases = [next(rates.cases(range(finger, finger + 1), "whole")) for finger in (0, 1, 9, 12)]
    text = rates.page([result(case, "a") for case in cases])
    assert "**Development set: fingers 0 to 1, 9.**" in text
    assert "**Fresh: fingers 12.**" in text
    assert "## Whole fingers 0 to 1, 9 (development set)" in text
    assert "## Whole fingers 12 (fresh)" in text


def test_members_of_the_catalogue_are_counted_apart() -> None:
    cases = [rates.Case("one", ((key, 1.0),), finger) for finger in range(3) for key in (MEMBER, OTHER)]
    named = ["proximity", "crosstalk", "proximity", "gain_nonlinearity", "proximity", "crosstalk"]
    text = rates.page([result(case, "a", name) for case, name in zip(cases, named, strict=True)])
    rows = [[cell.strip() for cell in line.split("|")[1:3]] for line in text.splitlines() if line.startswith("|")]
    place = rows.index(["size 1 and above: named first", "4 of 6"])
    assert rows[place + 1] == ["... forms that are members of the catalogue", "3 of 3"]
    assert rows[place + 2] == ["... other forms", "1 of 3"]
    assert f"{MEMBER} *" in text
    assert f"{OTHER} *" not in text


def test_a_diagnosis_that_failed_is_wrong(tmp_path: Path) -> None:
    """One of two fingers of each kind failed: it is not named, not adequate, not unattributed, and was not detected."""
    seeds = {kind: (1, 2) if effects else (rates.PLAIN_SEEDS, rates.PLAIN_SEEDS + 1) for kind, effects in KINDS.items()}
    cases = [rates.Case(kind, KINDS[kind], seed, "small") for kind, several in seeds.items() for seed in several]
    records = [result(case, "a", case.names[0] if case.names else None) for case in cases]
    for record in records:
        if record["kind"] == "unlisted":
            record["diagnosis"]["verdict"] = "unattributed"
        if record["kind"] == "pair":
            record["diagnosis"]["effects"] = [{"name": name} for name in record["names"]]
    for record in records[1::2]:
        del record["diagnosis"], record["seconds"], record["cpu_seconds"]
        record["error"] = "ValueError: no"
    text = rates.page(records)
    rows = dict([cell.strip() for cell in line.split("|")[1:3]] for line in text.splitlines() if line.count("|") > 2)
    aims = ("no effect: `adequate`", "size 1 and above: named first", "pairs, size 1.5 each: both found")
    for row in (*aims, "outside the catalogue: `unattributed`", "no effect: held-out lack of fit at most 1.1"):
        assert rows[row] == "1 of 2", row
    assert rows["size 1 and above: another effect named first"] == "0 of 2"
    assert "8 diagnoses, 4 of them failed; 0 cases out of reach" in text
    # Detected, named first, and the same or indistinguishable.
    line = next(line for line in text.splitlines() if line.startswith("all "))
    assert line.split()[1:] == ["1/2", "1/2", "1/2"]
    rates.save_figures(records, tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {"detection.png", "confusion.png", "before_after.png"}


def test_a_run_that_was_killed_in_the_middle_of_a_line_goes_on(runs: list[str], tmp_path: Path) -> None:
    first, second = list(rates.cases(range(1), "small"))[:2]
    cache = tmp_path / "results.jsonl"
    whole = json.dumps(result(first, rates.code_version())) + "\n"
    cache.write_text(whole + json.dumps(result(second, rates.code_version()))[:40])
    got = rates.results(tmp_path, [first, second], 1, True, float("inf"))
    assert runs == [second.key]
    assert [record["key"] for record in got] == [first.key, second.key]
    assert [json.loads(line)["key"] for line in cache.read_text().splitlines()] == [first.key, second.key]


def test_biases_of_two_signs_do_not_cancel() -> None:
    """Biases of 0.2, 0.4 and -0.6 mm: their mean is 0, the mean of their sizes 0.4, and so is the median."""
    records = [result(rates.Case("one", ((MEMBER, 1.0),), finger), "a", "proximity") for finger in range(3)]
    for record, bias in zip(records, (0.2, 0.4, -0.6), strict=True):
        record["diagnosis"]["before"] = {**record["diagnosis"]["before"], "R_bias_mm": bias}
    text = rates.page(records)
    (row,) = (line for line in text.splitlines() if line.startswith("| R, bias without its sign (mm) |"))
    assert row.split("|")[2].strip() == "0.4 ± 0.1 (3)"
    line = next(line for line in text.splitlines() if line.startswith("proximity ") and "->" in line)
    assert line.split()[4:7] == ["0.4", "->", "0"]
