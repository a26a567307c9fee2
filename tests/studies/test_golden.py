"""What `golden.py` writes of a version is of that version."""

from __future__ import annotations

import subprocess
from pathlib import Path
from types import SimpleNamespace

import pytest
from study_modules import study

import bayestouch


def test_error_lines_are_of_the_version_that_is_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """PYTHONPATH may be relative, as its docstring has it; a command that runs in another folder would not find it."""
    given: list[str] = []

    def run(command: list[str], *, env: dict[str, str], **_: object) -> SimpleNamespace:
        given.append(env["PYTHONPATH"])
        return SimpleNamespace(returncode=2, stderr="a line\n")

    monkeypatch.setenv("PYTHONPATH", str(Path("..") / "old"))
    monkeypatch.setattr(subprocess, "run", run)
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "sensor.toml").write_text("", "utf-8")
    found = study("golden")._said(tmp_path, "sensor.toml", ("", ""), ("calibrate", "{data}"))
    assert found == {"status": 2, "said": ["a line"]}
    assert given == [str(Path(bayestouch.__file__).parents[1])]
