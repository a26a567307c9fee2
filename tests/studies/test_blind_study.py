"""The blind studies: cases are complete, each runs only at its tag, and tables count what they say."""

from __future__ import annotations

import ast
import hashlib
import json
import random
import subprocess
from collections import Counter
from itertools import combinations
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from independent import dataset
from study_modules import STUDIES, study

blind = study("blind_study")
import _blind_run as runs  # noqa: E402  # beside the study, which puts its folder on the path
import _blind_tables as tables  # noqa: E402

CASES = {name: blind.cases(each) for name, each in blind.BLIND_STUDIES.items()}
ALL = [case for each in CASES.values() for case in each]
#: What a study has, and how its page says it.
NUMBERS = {
    "first": {
        "one": (126, "one effect: 42 forms at sizes 1, 2 and 5"),
        "none": (100, "nothing is missing: 25 for each rubber and order"),
        "unlisted": (96, "an unlisted cause: 12 at sizes 2 and 5, for each rubber and order"),
        "pair": (60, "two effects of size 2: 30 pairs, twice"),
    },
    "second": {
        "one": (126, "one effect: 42 forms at sizes 1, 2 and 5"),
        "none": (60, "nothing is missing: 15 for each rubber and order"),
        "unlisted": (80, "an unlisted cause: 10 at sizes 2 and 5, for each rubber and order"),
        "pair": (48, "two effects of size 2: 24 pairs, twice"),
    },
    "third": {
        "one": (504, "one effect: 42 forms at sizes 1, 2 and 5, for each rubber and order"),
        "none": (144, "nothing is missing: 36 for each rubber and order"),
        "unlisted": (160, "an unlisted cause: 10 at sizes 2 and 5, twice for each rubber and order"),
        "pair": (192, "two effects of size 2: 24 pairs, eight times"),
    },
    "fourth": {
        "one": (126, "one effect: 42 forms at sizes 1, 2 and 5"),
        "none": (40, "nothing is missing: 10 for each rubber and order"),
        "unlisted": (40, "an unlisted cause: 10 at sizes 2 and 5, for two of the rubbers and orders"),
        "pair": (48, "two effects of size 2: 24 pairs, twice"),
    },
    "fifth": {
        "one": (42, "one effect: 42 forms at size 2"),
        "none": (20, "nothing is missing: 5 for each rubber and order"),
        "unlisted": (20, "an unlisted cause: 10 at sizes 2 and 5"),
    },
}
#: Of the keys of the first study in their order.
FIRST_CASES = "ce41bbd7e3c9e60bb310b292ec81c9e4e64af0b0a71fff2f89654852aabe5fea"
each_study = pytest.mark.parametrize("name", CASES)


def of_kind(name: str, kind: str) -> list[Any]:
    return [case for case in CASES[name] if case.kind == kind and case.design == "small"]


def result(kind: str, truth: list[str], named: list[str], verdict: str = "explained", **more: Any) -> dict[str, Any]:
    """A made-up result."""
    sizes = {each: 2.0 for each in truth}
    return {
        "kind": kind,
        "effects": [[f"{each}: form", 2.0] for each in truth],
        "truth": truth,
        "sizes": sizes,
        "rubber": "soft",
        "order": "scan",
        "seed": 1,
        "design": "small",
        "key": json.dumps([kind, truth, named, verdict, len(more)]),
        "version": "1",
        "commit": "0123456789ab",
        "verdict": verdict,
        "effects_found": [{"name": each, "indistinguishable_from": ["aperture"]} for each in named],
        "in_place": None,
        "causes": [{"names": truth or ["nothing"], "probability": 0.9}],
        "processor_s": 4.0,
        "exam": {name: {"before": 1.0, "after": 1.0, "change": 0.0, "standard_error": 0.0} for name in tables.UNITS},
    } | more


def test_the_first_study_has_the_cases_that_were_run() -> None:
    """Hash of the keys in their order, made when the study had no other beside it."""
    keys = "\n".join(case.key for case in CASES["first"])
    assert hashlib.sha256(keys.encode()).hexdigest() == FIRST_CASES


@each_study
def test_every_form_has_all_sizes_both_rubbers_and_both_orders(name: str) -> None:
    for form in blind.BLIND_STUDIES[name].registry.LISTED:
        own = [case for case in of_kind(name, "one") if case.effects[0][0] == form.key]
        each = blind.BLIND_STUDIES[name].of_form
        sizes = (2.0,) if name == "fifth" else (1.0, 2.0, 5.0)
        assert Counter(case.effects[0][1] for case in own) == dict.fromkeys(sizes, each)
        if name == "fifth":
            continue
        if each == len(blind.CONDITIONS):
            assert {(case.effects[0][1], case.rubber, case.order) for case in own} == {
                (size, *condition) for size in (1.0, 2.0, 5.0) for condition in blind.CONDITIONS
            }
        assert {case.rubber for case in own} == {"soft", "stiff"}
        assert {case.order for case in own} == {"scan", "random"}


@each_study
def test_the_other_kinds_are_complete(name: str) -> None:
    of = blind.BLIND_STUDIES[name]
    none = Counter((case.rubber, case.order) for case in of_kind(name, "none"))
    assert none == dict.fromkeys(blind.CONDITIONS, of.plain)
    unlisted = Counter((*case.effects[0], case.rubber, case.order) for case in of_kind(name, "unlisted"))
    assert {key for key, *_ in unlisted} == {cause.key for cause in of.registry.UNLISTED}
    conditions = min(of.of_cause, len(blind.CONDITIONS))
    assert len(unlisted) == len(of.registry.UNLISTED) * 2 * conditions
    assert len({key[2:] for key in unlisted}) == max(conditions, 2 if name == "fourth" else 4)
    assert set(unlisted.values()) == {of.of_cause // conditions}
    pairs = of_kind(name, "pair")
    assert len(pairs) == of.of_pair * len(set(map(frozenset, of.pairs))) == of.of_pair * len(of.pairs)
    for names in of.pairs:
        own = [case for case in pairs if tuple(case.names) == names]
        assert len({key for case in own for key, _ in case.effects}) == 4
        seen = Counter((case.effects, case.rubber, case.order) for case in own)
        assert len(seen) == of.of_pair and set(seen.values()) == {1}
    assert {case.design for case in (*CASES["second"], *CASES["third"])} == {"small"}
    whole = Counter(case.kind for case in CASES["first"] if case.design == "whole")
    assert whole == {"none": 2, "one": 6, "unlisted": 4}


def test_the_pairs_of_the_first_study_have_every_effect() -> None:
    effects = {form.name for form in blind.BLIND_STUDIES["first"].registry.LISTED}
    assert {name for pair in blind.PAIRS for name in pair} == effects


@pytest.mark.parametrize(
    ("name", "earlier"),
    [
        ("second", blind.PAIRS),
        ("third", blind.PAIRS + blind.SECOND_PAIRS),
        ("fourth", blind.PAIRS + blind.SECOND_PAIRS + blind.THIRD_PAIRS),
    ],
)
def test_pairs_of_later_studies_were_drawn_with_their_seeds(name: str, earlier: tuple[tuple[str, str], ...]) -> None:
    of = blind.BLIND_STUDIES[name]
    names = dict.fromkeys(form.name for form in blind.BLIND_STUDIES["second"].registry.LISTED)
    others = [pair for pair in combinations(names, 2) if set(pair) not in [set(each) for each in earlier]]
    drawn = random.Random(of.first_seed).sample(others, len(of.pairs))
    assert sorted(drawn, key=others.index) == list(of.pairs)


@each_study
def test_all_cases_have_forms_of_their_study_alone(name: str) -> None:
    keys = {key for case in CASES[name] for key, _ in case.effects}
    assert keys == set(blind.BLIND_STUDIES[name].registry.EFFECTS)


def test_trials_have_forms_of_today_and_other_seeds() -> None:
    trials = blind.trial_cases()
    assert {case.kind for case in trials} == set(tables.KINDS)
    assert {key for case in trials for key, _ in case.effects} <= set(dataset.EFFECTS)
    assert not {case.seed for case in trials} & {case.seed for case in ALL}


def test_seeds_are_of_no_other_study() -> None:
    """Each case of every study has its own, and no other study has a number in their ranges."""
    seeds = {case.seed for case in ALL}
    assert len(seeds) == len(ALL)
    assert [min(case.seed for case in CASES[name]) for name in CASES] == [88_000, 91_000, 94_000, 97_000, 103_000]
    for path in STUDIES.rglob("*.py"):
        if path.name != "blind_study.py":
            nodes = ast.walk(ast.parse(path.read_text("utf-8")))
            constants = [node.value for node in nodes if isinstance(node, ast.Constant)]
            assert not {each for each in constants if type(each) is int} & seeds, path.name


@each_study
def test_the_page_counts_the_cases(name: str) -> None:
    page = (STUDIES.parent / "docs" / f"{blind.BLIND_STUDIES[name].name}.md").read_text("utf-8")
    for kind, (number, text) in NUMBERS[name].items():
        assert len(of_kind(name, kind)) == number
        assert f"| {text} | {number} |" in page
    whole = len(CASES[name]) - sum(number for number, _ in NUMBERS[name].values())
    assert whole == 0 or f"| fingers of practice size | {whole} |" in page


@each_study
def test_tables_go_into_the_page_of_the_study(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    of, asked = blind.BLIND_STUDIES[name], []

    def frozen_commit(tag: str, paths: tuple[str, ...]) -> str:
        asked.append((tag, paths))
        return "0123456789ab"

    def put_into_page(script: str, text: str, page: Path) -> None:
        asked.append((script, page.name))

    monkeypatch.setattr(blind, "frozen_commit", frozen_commit)
    monkeypatch.setattr(blind, "put_into_page", put_into_page)
    (tmp_path / "results.jsonl").write_text(json.dumps(result("none", [], [], "adequate")) + "\n")
    blind.main(["-o", str(tmp_path), "--docs", "--study", name])
    assert asked == [(of.tag, runs.COUNTING), ("blind_study.py", f"{of.name}.md")]
    assert "<!-- table of studies/blind_study.py -->" in (blind.DOCS / f"{of.name}.md").read_text("utf-8")


@pytest.fixture
def repository(tmp_path: Path) -> Path:
    def git(*arguments: str) -> None:
        names = ("-c", "user.name=n", "-c", "user.email=e")
        subprocess.run(["git", *names, *arguments], cwd=tmp_path, check=True, capture_output=True)

    git("init")
    (tmp_path / "code").mkdir()
    (tmp_path / "code" / "a.py").write_text("1\n")
    (tmp_path / "page.md").write_text("1\n")
    git("add", ".")
    git("commit", "-m", "frozen")
    git("tag", "frozen")
    return tmp_path


def test_it_runs_at_the_tag_whatever_else_changes(repository: Path) -> None:
    (repository / "page.md").write_text("2\n")
    assert len(runs.frozen_commit("frozen", ("code",), repository)) == 40


@pytest.mark.parametrize("changed", ["a.py", "new.py"])
def test_it_refuses_code_that_is_not_that_of_the_tag(repository: Path, changed: str) -> None:
    (repository / "code" / changed).write_text("2\n")
    with pytest.raises(runs.FrozenError, match=changed):
        runs.frozen_commit("frozen", ("code",), repository)


def test_it_refuses_without_a_tag(repository: Path) -> None:
    with pytest.raises(runs.FrozenError, match="no frozen code"):
        runs.frozen_commit("another", ("code",), repository)


def test_what_makes_and_counts_results_is_frozen() -> None:
    """Every file of the studies that the command imports, directly or not; the figures of other studies are not."""
    assert all((STUDIES.parent / path).exists() for path in runs.FROZEN)
    left, seen = ["blind_study"], set()
    while left:
        name = left.pop()
        seen.add(f"studies/{name}.py")
        tree = ast.parse((STUDIES / f"{name}.py").read_text("utf-8"))
        modules = {each.module for each in ast.walk(tree) if isinstance(each, ast.ImportFrom)}
        modules |= {one.name for each in ast.walk(tree) if isinstance(each, ast.Import) for one in each.names}
        here = {each for each in modules if each and (STUDIES / f"{each}.py").exists()}
        left += [each for each in here if f"studies/{each}.py" not in seen]
    assert {"studies/_blind_tables.py", "studies/_cause_rules.py"} <= seen <= set(runs.FROZEN)


def test_it_refuses_the_package_of_another_checkout(tmp_path: Path) -> None:
    runs.require_own_package()
    with pytest.raises(runs.FrozenError, match=r"bayestouch is imported from .*, which is not in"):
        runs.require_own_package(tmp_path)


def test_a_refusal_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    def elsewhere() -> None:
        raise runs.FrozenError("bayestouch is imported from elsewhere")

    monkeypatch.setattr(blind, "require_own_package", elsewhere)
    with pytest.raises(SystemExit) as ended:
        blind.main(["-o", str(tmp_path), "--development"])
    assert ended.value.code == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_an_error_of_the_simulation_is_a_result(monkeypatch: pytest.MonkeyPatch) -> None:
    def simulate(*_: Any) -> None:
        raise ZeroDivisionError("in\ntwo lines")

    monkeypatch.setattr(blind, "simulate", simulate)
    record = blind.run("development", blind.trial_cases()[0])
    assert record["not_simulated"] == "ZeroDivisionError: in two lines"
    text = tables.tables([record, result("none", [], [], "adequate")])
    assert "Cases that could not be simulated, left out: 1." in text and "in two lines" in text
    assert "| nothing is missing: `adequate` | 1 of 1 |" in text


@pytest.fixture
def diagnosis() -> Any:
    """What a diagnosis gives, as far as the study looks at it."""
    numbers = {"verdict": "adequate", "effects": [], "not_distinguishable": [], "in_place": None, "causes": []}
    return SimpleNamespace(numbers=numbers, calibration_before=0.0, calibration_after=0.0)


def test_an_error_in_the_exam_leaves_the_diagnosis(
    diagnosis: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import bayestouch

    def exam(table: Path, *_: Any) -> None:
        raise ValueError(f"{table}: cannot be read")

    monkeypatch.setattr(runs, "exam", exam)
    monkeypatch.setattr(bayestouch, "load_dataset", lambda folder: folder)
    monkeypatch.setattr(bayestouch, "diagnose", lambda *_, **__: diagnosis)
    unused: Any = None
    said = runs.diagnosed(tmp_path / "finger", unused)
    assert said["verdict"] == "adequate"
    assert said["exam_error"] == "ValueError: finger/exam.csv: cannot be read"
    record = {key: value for key, value in result("none", [], []).items() if key != "exam"} | said
    text = tables.tables([record])
    assert "| nothing is missing: `adequate` | 1 of 1 |" in text
    assert "Exams that failed, so that nothing is known of these readings: 1." in text and "cannot be read" in text
    assert "0 of 0 readings" in text


def test_half_a_line_of_a_killed_run_is_left_out_and_made_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, *others = blind.trial_cases()
    same = {"commit": "development", "version": blind.code_version()}

    def run(commit: str, case: Any) -> dict[str, Any]:
        return result(case.kind, case.names, [], "adequate", key=case.key, **same)

    monkeypatch.setattr(blind, "run", run)
    whole, half = (json.dumps(run("", each)) for each in (first, others[0]))
    (tmp_path / "results.jsonl").write_text(f"{whole}\n{half[: len(half) // 2]}")
    assert [each["key"] for each in blind.kept(tmp_path)] == [first.key]
    blind.main(["-o", str(tmp_path), "--development", "--processes", "1"])
    lines = (tmp_path / "results.jsonl").read_text("utf-8").splitlines()
    assert [json.loads(line)["key"] for line in lines] == [each.key for each in (first, *others)]


def test_results_of_two_versions_are_refused(tmp_path: Path) -> None:
    lines = [result("none", [], [], "adequate", version=version) for version in "12"]
    (tmp_path / "results.jsonl").write_text("".join(json.dumps(each) + "\n" for each in lines))
    with pytest.raises(runs.FrozenError, match="several versions"):
        blind.kept(tmp_path)


def test_only_what_is_missing_is_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ran: list[str] = []

    def run(commit: str, case: Any) -> dict[str, Any]:
        ran.append(case.key)
        return result(case.kind, case.names, [], "adequate", key=case.key, commit=commit, version=blind.code_version())

    monkeypatch.setattr(blind, "run", run)
    arguments = ["-o", str(tmp_path), "--development", "--processes", "1"]
    assert len(blind.main([*arguments, "--cases", "1"])) == 1
    assert len(blind.main(arguments)) == 4
    assert sorted(ran) == sorted(case.key for case in blind.trial_cases())


def test_an_earlier_study_runs_again_for_development(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its fingers of 8 elements, with the code of today; nothing of this comes into its page."""
    ran: list[Any] = []

    def run(commit: str, case: Any) -> dict[str, Any]:
        ran.append(case)
        return result(case.kind, case.names, [], "adequate", key=case.key, commit=commit, version=blind.code_version())

    monkeypatch.setattr(blind, "run", run)
    arguments = ["-o", str(tmp_path), "--again", "--processes", "1", "--study", "first"]
    blind.main(arguments)
    assert [each.key for each in ran] == [each.key for each in CASES["first"] if each.design == "small"]
    assert {each["commit"] for each in blind.kept(tmp_path)} == {"development"}
    with pytest.raises(SystemExit):
        blind.main([*arguments, "--docs"])
    # some of them by the name of a form, which a study itself cannot be asked for
    ran.clear()
    some = "crosstalk: ribbon"
    blind.main(["-o", str(tmp_path / "some"), *arguments[2:], "--form", some])
    wanted = [each for each in CASES["first"] if each.design == "small" and some in dict(each.effects)]
    assert [each.key for each in ran] == [each.key for each in wanted] and len(wanted) > 2
    with pytest.raises(SystemExit):
        blind.main(["-o", str(tmp_path / "whole"), "--form", some])


def test_results_of_a_trial_do_not_come_into_the_page(tmp_path: Path) -> None:
    line = result("none", [], [], "adequate", commit="development")
    (tmp_path / "results.jsonl").write_text(json.dumps(line) + "\n")
    with pytest.raises(SystemExit):
        blind.main(["-o", str(tmp_path), "--docs"])


def test_rates_by_hand() -> None:
    some = [
        result("one", ["creep"], ["creep"]),
        result("one", ["aperture"], ["creep"]),
        result("one", ["memory"], ["creep", "memory"]),
        result("one", ["creep"], ["creep"], sizes={"creep": 0.7}),
        result("none", [], [], "adequate"),
        result("none", [], [], "unattributed"),
        result("unlisted", ["grain"], [], "unattributed"),
        result("unlisted", ["grain"], [], "explained", in_place={"gain": 1.0}),
        result("unlisted", ["grain"], [], "adequate", in_place={"gain": 1.0}),
        result("unlisted", ["grain"], ["creep"], "unattributed"),
        result("pair", ["creep", "baseline_drift"], ["baseline_drift", "memory", "creep"]),
        result("pair", ["creep", "gain_drift"], ["creep"]),
        {key: value for key, value in result("one", ["gain_drift"], []).items() if key in KEPT_OF_FAILED},
    ]
    lines = tables.headline(some).splitlines()[2:]
    cells = [[cell.strip() for cell in line.split("|")[2:4]] for line in lines]
    # Clopper and Pearson: 1 of 4 from 0.6 to 80.6 %, 2 of 4 from 6.8 to 93.2 %, 1 of 2 from 1.3 to 98.7 %
    assert cells == [
        ["1 of 4", "1 to 81 %"],
        ["2 of 4", "7 to 93 %"],
        ["1 of 2", "1 to 99 %"],
        ["2 of 4", "7 to 93 %"],
        ["1 of 2", "1 to 99 %"],
        ["1 of 3", "1 to 91 %"],
    ]


KEPT_OF_FAILED = {"kind", "effects", "truth", "sizes", "rubber", "order", "seed", "design", "key", "version", "commit"}


def test_all_tables_of_all_kinds_of_results() -> None:
    failed = {key: value for key, value in result("one", ["creep"], []).items() if key in KEPT_OF_FAILED}
    some = [
        result("one", ["creep"], ["creep"]),
        result("none", [], ["memory"]),
        result("unlisted", ["grain"], [], "unattributed"),
        result("pair", ["creep", "memory"], ["creep"], design="whole"),
        {**failed, "error": "ValueError: no"},
        {**failed, "out_of_reach": "creep", "key": "far"},
    ]
    some[0]["exam"]["R"] = {"before": 0.5, "after": 0.75, "change": 0.3, "standard_error": 0.1}
    some[1]["exam"]["P"] = {"before": 2.0, "after": 3.0, "change": 5.0, "standard_error": 2.5}
    text = tables.tables(some)
    assert "6 cases, 1 of them out of reach. Version of the code: `1` (commit 0123456789)." in text
    assert "Diagnoses that failed, counted as wrong: 1." in text and "ValueError: no" in text
    assert "1 of 12 readings" in text and "2 of them changed" in text
    assert "| creep: form | soft, scan | R: 0.5 → 0.75 mm | 3.0 |" in text
    assert "| memory | 1 |" in text
    assert "Processor time of a case, s (least, median, 90 %, most): 4, 4, 4, 4." in text
    # three small fingers with causes: the first sets name what is there in two, and the unlisted one has no name
    assert "| 0.8 to 0.9 | 3 | 90 | 67 |" in text


def test_a_change_of_errors_by_hand() -> None:
    """Two places with two touches each: squares change by 1 and 2 at the first, by 3 and 6 at the second."""
    before, after = np.zeros(4), np.sqrt([1.0, 2.0, 3.0, 6.0])
    got = runs.compared(before, -after, np.array([0.0, 0.0, 5.0, 5.0]))
    assert got["before"] == 0 and got["after"] == pytest.approx(np.sqrt(3))
    assert got["change"] == pytest.approx(3)
    # means 1.5 and 4.5: sd √4.5, over √2
    assert got["standard_error"] == pytest.approx(1.5)


def test_the_exam_is_compared_with_what_was_pressed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Estimates that are the commanded places and the nominal radii err where the truth is elsewhere."""
    import bayestouch

    tip, commanded = np.array([0.0, np.inf, 12.7, 12.7]), np.array([0.0, 0.0, 10.0, 20.0])
    press = SimpleNamespace(angle=np.add(commanded, [0, 0, 0.5, 0.5]), load=np.full(4, 200.0))
    body = SimpleNamespace(body=SimpleNamespace(outer=12.7))
    recording: Any = SimpleNamespace(parts=(1, 1, 2), tip=tip, commanded=commanded, press=press, finger=body)
    asked: list[bool] = []

    def infer(table: Path, calibration: float, *, use_load: bool, **more: Any) -> Any:
        asked.append(use_load)
        values = {"R": np.full(2, 6.35 + calibration), "theta_c": commanded[2:], "P": np.full(2, 200.0)}
        return SimpleNamespace(mean=values.__getitem__)

    monkeypatch.setattr(bayestouch, "infer", infer)
    got = runs.exam(Path("exam.csv"), recording, 0.0, 0.25)
    assert (got["R"]["before"], got["R"]["after"]) == pytest.approx((0, 0.25))
    assert got["theta_c"]["before"] == pytest.approx(0.5)
    assert asked == [True, False, True, False]
