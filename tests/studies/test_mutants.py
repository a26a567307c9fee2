"""The mutation trial: the same places for the same seed, one change at each, and the tests that go with a module."""

from __future__ import annotations

from pathlib import Path

import pytest
from study_modules import study

ROOT = Path(__file__).parents[2]
CODE = '''"""Two sums."""

from __future__ import annotations

FACTOR = 3


def total(a: int | None, b: int, *, twice: bool = False) -> int:
    """The sum, or twice the sum."""
    return FACTOR * ((a or 0) - b) if twice else b + 1


def first(values: list[int]) -> int:
    for value in values:
        if value < 2:
            return value
    return 7
'''


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "sums.py").write_text(CODE, "utf-8")
    return tmp_path


def test_each_change_is_python_and_alters_one_place(folder: Path) -> None:
    pytest.importorskip("cosmic_ray", reason="cosmic-ray is not installed (extra mutants)")
    module = study("_mutants")
    found, places = module.sample([Path("sums.py")], 100, 1, folder)
    assert len(found) == len({mutant.spec.start_pos for mutant in found})
    changes = {(mutant.before, mutant.after) for mutant in found}
    assert all(before != after for before, after in changes)
    # the mark `*` of what comes by name is no product, and `|` joins types: neither is changed
    assert not any(after.startswith("def ") and "twice: bool = False" in after for _, after in changes)
    assert any(before == "FACTOR = 3" for before, _ in changes)
    assert any(before.startswith("if value < 2") for before, _ in changes)
    assert places >= len(found) >= 10


def test_a_sample_stays_when_other_lines_change(folder: Path) -> None:
    pytest.importorskip("cosmic_ray", reason="cosmic-ray is not installed (extra mutants)")
    module = study("_mutants")

    def changes(seed: int) -> list[tuple[str, str]]:
        found, _ = module.sample([Path("sums.py")], 4, seed, folder)
        return [(mutant.before, mutant.after) for mutant in found]

    before = changes(1)
    assert changes(1) == before
    assert changes(2) != before
    (folder / "sums.py").write_text(CODE.replace('"""Two sums."""', '"""Two sums.\n\nAnd a note.\n"""'), "utf-8")
    assert changes(1) == before


@pytest.mark.slow
def test_parts_share_no_module_and_every_module_has_tests() -> None:
    module = study("_mutant_tests")
    parts, every = module.parts()
    modules = [path for part in parts for path in part.modules]
    assert len(modules) == len(set(modules)) > 100
    tests = module.Tests.read(every)
    for part in parts:
        for path in part.modules:
            assert all(tests.candidates(path, part)[1]), path
    assert all(list((ROOT / "tests").glob(pattern)) for pattern in every)


def test_importers_run_first_and_the_budget_holds() -> None:
    module = study("_mutant_tests")
    part = module.Part(
        "layer", (Path("bayestouch/body/layer.py"),), ("test_annulus_fem.py", "test_layer.py", "test_emap.py")
    )
    imports = {
        Path("tests/body/test_layer.py"): frozenset({"bayestouch.body.layer"}),
        Path("tests/body/test_annulus_fem.py"): frozenset({"bayestouch.body.layer", "numpy"}),
        Path("tests/body/test_emap.py"): frozenset({"numpy"}),
        Path("tests/commands/test_cli.py"): frozenset({"numpy"}),
    }
    tests = module.Tests(imports, ("test_cli.py",))
    seconds = {
        Path(f"tests/{name}.py"): took
        for name, took in {
            "body/test_layer": 9,
            "body/test_annulus_fem": 3,
            "body/test_emap": 5,
            "commands/test_cli": 1,
        }.items()
    }
    chosen = tests.chosen(part.modules[0], part, seconds, 14)
    assert [path.stem for path in chosen] == ["test_annulus_fem", "test_layer", "test_cli"]
    assert module.imported_modules(ROOT / "tests" / "body" / "test_layer.py") >= {"bayestouch.body.layer"}


def test_score_leaves_out_what_changes_nothing() -> None:
    page = study("_mutant_page")
    outcomes = ["killed"] * 16 + ["timeout"] + ["survived"] * 3 + ["broken"]
    tried = [page.Tried("chain", "m.py", i, f"a {i}", "b", outcome) for i, outcome in enumerate(outcomes)]
    judged = {("m.py", "a 17", "b"): page.Judgement(True, "r"), ("m.py", "a 18", "b"): page.Judgement(False, "r")}
    score = page.Score.of(tried, judged)
    assert (score.made, score.equivalent, score.survived) == (20, 1, 2)
    assert score.share == pytest.approx(17 / 19, rel=1e-12)
    # Wilson's interval of 17 of 19 by its formula
    p, n, z = 17 / 19, 19, 1.959964
    middle, half = (p + z**2 / (2 * n)), z * ((p * (1 - p) + z**2 / (4 * n)) / n) ** 0.5
    expected = [(middle - half) / (1 + z**2 / n), (middle + half) / (1 + z**2 / n)]
    assert list(score.interval) == pytest.approx(expected, rel=1e-5)
