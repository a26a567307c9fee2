"""The wheel and the source distribution hold what an installation needs, and nothing else."""

from __future__ import annotations

import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest
from committed import ROOT, committed_files

import bayestouch

pytest.importorskip("hatchling", reason="hatchling is not installed (it is the build backend)")


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with both files, built from the checkout."""
    folder = tmp_path_factory.mktemp("dist")
    subprocess.run([sys.executable, "-m", "hatchling", "build", "-d", str(folder)], cwd=ROOT, check=True)
    return folder


def test_wheel_holds_the_package_and_nothing_else(built: Path) -> None:
    (wheel,) = built.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
        folder = f"bayestouch-{bayestouch.__version__}.dist-info"
        metadata = archive.read(f"{folder}/METADATA").decode()
        commands = archive.read(f"{folder}/entry_points.txt").decode()
    wanted = {name for name in committed_files() if name.startswith("bayestouch/")}
    # templates, stubs, the mark of typed packages and the table of the finite strain are no Python files
    assert {Path(name).suffix for name in wanted} >= {".py", ".pyi", ".html", ".css", ".js", ".npz"}
    assert "bayestouch/py.typed" in wanted
    assert {name for name in names if not name.startswith(f"{folder}/")} == wanted
    assert "Requires-Python: >=3.11" in metadata and "License-Expression: BSD-3-Clause" in metadata
    assert "bayestouch = bayestouch.commands.cli:run" in commands
    assert wheel.stat().st_size < 3e6


def test_source_distribution_builds_the_same_wheel(built: Path, tmp_path: Path) -> None:
    (source,) = built.glob("*.tar.gz")
    with tarfile.open(source) as archive:
        archive.extractall(tmp_path, filter="data")
    (unpacked,) = tmp_path.iterdir()
    for name in (
        "README.md",
        "LICENSE",
        "CITATION.cff",
        "CHANGELOG.md",
        "pyproject.toml",
        "tests/project/test_wheel.py",
    ):
        assert (unpacked / name).is_file(), name
    again = tmp_path / "again"
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(again)]
    subprocess.run(command, cwd=unpacked, check=True)
    (first,), (second,) = built.glob("*.whl"), again.glob("*.whl")
    assert first.read_bytes() == second.read_bytes()
