"""``python -m studies.nicolson_fearing`` runs the studies of the paper one by one, and says how long each took."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path

import pytest
from study_modules import SCRIPTS, STUDIES


@pytest.fixture
def entry(monkeypatch: pytest.MonkeyPatch):  # type: ignore[no-untyped-def]  # a module
    monkeypatch.syspath_prepend(str(STUDIES.parent))
    return importlib.import_module("studies.nicolson_fearing.__main__")


def test_all_studies_of_the_paper_are_known(entry) -> None:  # type: ignore[no-untyped-def]
    paper = {name.removeprefix("nicolson_fearing/") for name in SCRIPTS if name.startswith("nicolson_fearing/")}
    assert set(entry.STUDIES) == paper
    assert {"table_1", "figure_13", "noise_row", "compare_published"} <= paper


def test_each_is_run_with_the_options_and_timed(
    entry,  # type: ignore[no-untyped-def]
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    good, bad = tmp_path / "good.py", tmp_path / "bad.py"
    good.write_text("import sys\nprint('with', *sys.argv[1:])\nsum(i * i for i in range(3_000_000))\n")
    bad.write_text("import sys\nsys.exit(3)\n")
    monkeypatch.setattr(entry, "STUDIES", {"bad": bad, "good": good})
    assert entry.main([str(tmp_path), "--small"]) == 1
    out = capfd.readouterr().out
    assert f"with {tmp_path} --small" in out  # the one after the failure ran
    assert "failed with status 3" in out
    assert out.splitlines()[-1].startswith("all")
    assert entry.main(["--only", "good"]) == 0
    ran = entry.run("good", [])
    assert 0.02 < ran.processor_seconds <= ran.seconds + 0.5


def test_an_unknown_study_is_refused(entry) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(SystemExit):
        entry.main(["--only", "figure_99"])
    assert sys.modules["studies.nicolson_fearing.__main__"] is entry
