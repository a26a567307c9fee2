"""The study of the probabilities of causes: what is right, tables and diagram by hand, and which results are pooled."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from study_modules import study

causes = study("causes")
import _cause_figure as figures  # noqa: E402  # beside the study, which puts its folder on the path
import _cause_rules as rules  # noqa: E402


def result(kind: str, truth: list[str], *sets: tuple[list[str], float], stated: list[str], **more: Any) -> Any:
    """A made-up result."""
    found = [{"names": names, "probability": probability} for names, probability in sets]
    key = json.dumps([kind, truth, found, stated, sorted(more.items())])
    one = {"kind": kind, "truth": truth, "causes": found, "stated": stated, "version": "1", "key": key}
    return {**one, "effects": [], "seed": 20, "design": "small"} | more


@pytest.mark.parametrize(
    ("kind", "truth", "names", "is_right"),
    [
        ("none", [], ["nothing"], True),
        ("none", [], ["something in place"], False),
        ("one", ["creep"], ["creep"], True),
        ("one", ["creep"], ["creep", "something in place"], True),
        ("one", ["creep"], ["something in place"], False),
        ("one", ["creep"], ["creep", "memory"], False),
        ("one", ["gain_drift"], ["something in time"], True),
        ("pair", ["gain_drift", "creep"], ["creep", "something in time"], True),
        ("pair", ["gain_drift", "creep"], ["creep"], False),
        ("pair", ["gain_drift", "baseline_drift"], ["something in time"], False),
        ("unlisted", ["grain"], ["something in place"], True),
        ("unlisted", ["grain"], ["something in place", "something in time"], True),
        ("unlisted", ["grain"], ["something else"], True),
        ("unlisted", ["grain"], ["something in single touches"], True),
        ("one", ["gain_drift"], ["something in single touches"], False),
        ("one", ["creep"], ["something else"], False),
        ("none", [], ["something else"], False),
        ("pair", ["creep", "memory"], ["creep", "something else"], True),
        ("pair", ["creep", "memory"], ["creep", "something in place", "something else"], True),
        ("pair", ["creep", "memory"], ["creep", "memory", "something else"], False),
        ("pair", ["creep", "memory"], ["gain_drift", "something else"], False),
        ("pair", ["creep", "gain_drift"], ["something in time", "something else"], True),
        ("one", ["creep"], ["creep", "something else"], False),
        ("unlisted", ["grain"], ["creep", "something else"], False),
        ("unlisted", ["grain"], ["something in time", "something else"], True),
        ("unlisted", ["grain"], ["nothing"], False),
        ("unlisted", ["grain"], ["creep"], False),
    ],
)
def test_right_sets(kind: str, truth: list[str], names: list[str], is_right: bool) -> None:
    assert rules.right(names, {"kind": kind, "truth": truth}) is is_right


CREEP = [(["creep"], 0.5), (["creep", "something in place"], 0.42), (["memory"], 0.08)]
SOME = [
    result("one", ["creep"], *CREEP, stated=["creep"]),
    result("one", ["creep"], (["memory"], 0.94), (["creep"], 0.06), stated=["memory"]),
    result("none", [], (["nothing"], 0.6), (["creep"], 0.4), stated=["nothing"], seed=10_080),
    result("unlisted", ["grain"], (["something in place"], 1.0), stated=["something in place"]),
]


def test_sets_that_are_right_or_wrong_together_are_one_statement() -> None:
    assert rules.statements(SOME[0]["causes"]) == [(("creep",), pytest.approx(0.92)), (("memory",), 0.08)]
    of_two = [{"names": ["something in place", "creep", "aperture"], "probability": 1.0}]
    assert rules.statements(of_two) == [(("aperture", "creep"), 1.0)]
    assert rules.statements(SOME[3]["causes"]) == [(("something in place",), 1.0)]


def test_scores_by_hand() -> None:
    """Probabilities of all right sets 0.92, 0.06, 0.6 and 1; the verdict is wrong once; bins of 1, 2 and 1."""
    of = rules.Forecasts.of(SOME)
    assert of.hit.tolist() == [True, False, True, True] and of.rule_hit.tolist() == [True, False, True, True]
    assert of.log_score == pytest.approx(np.log([0.92, 0.06, 0.6, 0.99]).mean())
    assert of.rule_log_score == pytest.approx(np.log([0.99, 0.01, 0.99, 0.99]).mean())
    # 0.9 to 0.95: |1 - 0.92 - 0.94|; 0.5 to 0.7: 1 - 0.6; above 0.99: 0
    assert of.calibration_error == pytest.approx((0.86 + 0.4) / 4)
    found = rules.bins(of)
    assert [(each.fingers, each.right) for each in found] == [(1, 1), (2, 1), (1, 1)]
    # Clopper and Pearson: 1 of 2, and 1 of 1 with the lower end 0.025
    assert found[1].interval == pytest.approx((0.0126, 0.9874), abs=1e-4)
    assert found[0].interval == pytest.approx((0.025, 1.0))
    assert "| 0.9 to 0.95 | 2 | 93 | 50 | 1 to 99 |" in rules.tables(SOME)


def test_the_diagram_shows_shares_and_intervals(tmp_path: Path) -> None:
    drawn = figures.diagram(SOME)
    points = drawn.axes[0].containers[0].lines[0].get_xydata()
    assert points == pytest.approx(np.array([[0.6, 1.0], [0.93, 0.5], [1.0, 1.0]]))
    (bars,) = drawn.axes[0].containers[0].lines[2]
    assert np.asarray(bars.get_segments())[1, :, 1] == pytest.approx([0.0126, 0.9874], abs=1e-4)
    figures.save_diagram(SOME, tmp_path / "causes.png")
    assert (tmp_path / "causes.png").stat().st_size > 10_000


def written(path: Path, results: list[Any]) -> Path:
    path.write_text("".join(json.dumps(each) + "\n" for each in results), "utf-8")
    return path


def test_files_are_pooled(tmp_path: Path) -> None:
    """Results of `blind_study` and `error_rates` beside those of the study; a repeated case counts once."""
    blind = result("one", ["creep"], (["creep"], 1.0), stated=[], commit="0123", verdict="explained")
    blind |= {"effects_found": [{"name": "creep"}]}
    del blind["stated"]
    said = {"causes": [{"names": ["nothing"], "probability": 1.0}], "verdict": "adequate", "effects": []}
    rates = {"kind": "none", "names": [], "effects": [], "seed": 10_000, "design": "small", "key": "a", "version": "1"}
    own = written(tmp_path / "own.jsonl", [*SOME, SOME[0]])
    others = [written(tmp_path / f"{i}.jsonl", [each]) for i, each in enumerate([blind, {**rates, "diagnosis": said}])]
    arguments = ["-o", str(own), "--tables", "--with", *map(str, others), "--diagram", str(tmp_path / "a.png")]
    pooled = causes.main(arguments)
    assert len(pooled) == len(SOME) + 2
    assert [each["stated"] for each in pooled[-2:]] == [["creep"], ["nothing"]]
    assert (tmp_path / "a.png").exists()
    # the finger of `error_rates` is number 0
    assert causes.summary(pooled).startswith("6 fingers, 1 of them of the development set.")


def test_versions_are_not_mixed_unless_they_are_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    own, other = written(tmp_path / "1", SOME), written(tmp_path / "2", [{**SOME[0], "version": "2"}])
    arguments = ["-o", str(own), "--tables", "--with", str(other)]
    with pytest.raises(SystemExit):
        causes.main(arguments)
    assert "1 (4), 2 (1)" in capsys.readouterr().err
    assert len(causes.main([*arguments, "--versions", "1"])) == 4
    assert len(causes.main([*arguments, "--versions", "1", "2"])) == 5
    assert "Version of the code: `1`, `2`." in capsys.readouterr().out
    with pytest.raises(SystemExit):
        causes.main([*arguments, "--versions", "3"])


def test_fresh_fingers_are_at_least_a_thousand_cases() -> None:
    """Of the development set a tenth and more was out of reach of the size; a thousand are left after as many."""
    fresh = causes.planned(causes.FRESH, 13)
    assert {each.finger for each in fresh} == set(range(10, 23))
    assert 0.85 * len(fresh) > 1000
    assert len({each.key for each in fresh}) == len(fresh)
