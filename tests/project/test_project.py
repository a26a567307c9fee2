"""The project as a whole: one version everywhere, a cheap import, nothing of one machine in the files."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tomllib
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest
from committed import ROOT, committed_files

import bayestouch

# what only sampling, tables, statistics and pictures need; each is imported where it is used
HEAVY = (
    "arviz",
    "pandas",
    "matplotlib",
    "xarray",
    "emcee",
    "corner",
    "scipy.stats",
    "scipy.optimize",
    "h5py",
)


def test_one_version() -> None:
    release = re.search(r"^## \[(\d[^]]*)\] - (\S+)$", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.MULTILINE)
    citation = (ROOT / "CITATION.cff").read_text("utf-8")
    cited = re.search(r"^version: (.+)$", citation, re.MULTILINE)
    released = re.search(r"^date-released: (.+)$", citation, re.MULTILINE)
    assert release and release[1] == bayestouch.__version__
    assert cited and cited[1] == bayestouch.__version__
    assert released and released[1] == release[2]
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    assert project["project"]["dynamic"] == ["version"]
    stated = (ROOT / project["tool"]["hatch"]["version"]["path"]).read_text("utf-8")
    assert f'__version__ = "{bayestouch.__version__}"' in stated


def test_import_leaves_heavy_libraries_alone() -> None:
    """In a fresh interpreter: pytest and its plug-ins have imported some of them here."""
    program = f"import sys, bayestouch; print(*(name for name in {HEAVY} if name in sys.modules))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


def test_no_study_hides_a_library() -> None:
    """A study's folder comes first on the path: numba, which ArviZ imports, asked for `coverage` and got the study."""
    studies = {Path(name).stem for name in committed_files() if re.fullmatch(r"studies/(.+/)?[^/]+\.py", name)}
    assert len(studies) > 80
    asked_for_if_there = {"coverage", "numba", "dask", "IPython", "tbb"}
    taken = set(sys.stdlib_module_names) | set(packages_distributions()) | asked_for_if_there
    assert studies & taken == set()


def test_no_file_names_a_place_on_one_machine() -> None:
    """No absolute path of a home, a work folder or a temporary folder, in any committed text."""
    folders = ("work", "root", "tmp", "home", "Users")  # joined here, so that this file does not match itself
    path = re.compile(rb"(?<![\w.~)}-])/(?:" + "|".join(folders).encode() + rb")/[\w.]")
    found = [
        f"{name}:{number}"
        for name in committed_files()
        for number, line in enumerate((ROOT / name).read_bytes().splitlines(), start=1)
        if path.search(line)
    ]
    assert found == []


def test_lock_holds_exact_versions_and_nothing_else() -> None:
    """Neither index addresses nor extras, which pip refuses in a constraints file."""
    lines = (ROOT / "constraints.txt").read_text("utf-8").splitlines()
    assert [line for line in lines if not re.fullmatch(r"[a-z0-9-]+==[\w.]+( ; .+)?", line)] == []


def direct_dependencies() -> set[str]:
    """Names of all that pyproject.toml asks for, to run, to develop and to build."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    wanted = list(project["project"]["dependencies"]) + list(project["build-system"]["requires"])
    for extra in project["project"]["optional-dependencies"].values():
        wanted += extra
    return {re.split(r"[\[<>=!~; ]", requirement)[0] for requirement in wanted} - {"bayestouch"}


def test_lock_covers_every_direct_dependency() -> None:
    locked = {line.partition("==")[0] for line in (ROOT / "constraints.txt").read_text("utf-8").splitlines()}
    assert {name.lower() for name in direct_dependencies()} <= locked


def test_every_dependency_is_explained() -> None:
    page = (ROOT / "docs" / "dependencies.md").read_text("utf-8")
    assert {name for name in direct_dependencies() if f"**{name}**" not in page} == set()


@pytest.fixture
def bare_checkout(tmp_path: Path) -> Path:
    """A folder with the three files that decide what `make` sets up."""
    if shutil.which("make") is None:
        pytest.skip("make is absent")
    for name in ("Makefile", "pyproject.toml", "constraints.txt"):
        shutil.copy(ROOT / name, tmp_path)
    return tmp_path


def make(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    # the tests may run under `make test`, whose flags must not reach this make
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("MAKE", "MFLAGS"))}
    command = ["make", *arguments]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("stamp", [".ready-runtime", ".ready-dev", ".ready-docs", ".ready-mutants"])
def test_set_up_is_done_once_and_again_only_for_a_new_lock(bare_checkout: Path, stamp: str) -> None:
    venv = bare_checkout / ".venv"
    venv.mkdir()
    (venv / ".created").touch()
    assert "pip install" in make(bare_checkout, "-n", f".venv/{stamp}").stdout
    (venv / stamp).touch()
    assert "up to date" in make(bare_checkout, "-n", f".venv/{stamp}").stdout
    later = (venv / stamp).stat().st_mtime + 10
    os.utime(bare_checkout / "constraints.txt", (later, later))
    assert "pip install" in make(bare_checkout, "-n", f".venv/{stamp}").stdout


@pytest.mark.parametrize("python", ["", "false", "no-such-python"])
def test_set_up_without_a_python_ends_in_one_clear_line(bare_checkout: Path, python: str) -> None:
    done = make(bare_checkout, "-s", f"PYTHON={python}", ".venv/.ready-dev")
    first, *rest = done.stderr.splitlines()
    assert done.returncode != 0
    assert "needs Python 3.11 or newer" in first
    assert all(line.startswith("make: ***") for line in rest)  # make's own word that the target failed
    assert not (bare_checkout / ".venv").exists()
