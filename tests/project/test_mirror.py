"""Tests mirror the package: each file is named after a module or a package, or is in a folder of its own kind."""

from __future__ import annotations

from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

#: Folders of tests that belong to no single module.
OTHER = ("end_to_end", "project", "simulator", "studies")


def test_every_test_file_mirrors_the_package() -> None:
    files = {path.relative_to(ROOT / "tests") for path in (ROOT / "tests").rglob("test_*.py")}
    assert len(files) > 200
    assert sorted(file.as_posix() for file in files if not _has_its_place(file)) == []


@pytest.mark.parametrize(
    ("file", "place"),
    [
        ("body/test_annulus.py", True),
        ("body/test_annulus_fem.py", True),
        ("body/test_annulusfem.py", False),
        ("contact/test_annulus.py", False),
        ("live/test_live.py", True),
        ("finger/test_reading.py", True),
        ("finger/reading/test_rows.py", True),
        ("end_to_end/test_anything.py", True),
        ("anywhere/test_anything.py", False),
        ("test_errors.py", True),
        ("test_anything.py", False),
    ],
)
def test_files_that_have_their_place_and_files_that_have_none(file: str, place: bool) -> None:
    assert _has_its_place(Path(file)) is place


def _has_its_place(file: Path) -> bool:
    """Whether a test file, by its path below tests/, is named after what lies at the same path of the package."""
    if file.parts[0] in OTHER:
        return True
    package = ROOT / "bayestouch" / file.parent
    if not package.is_dir():
        return False
    modules = {path.stem for path in package.glob("*.py")} - {"__init__"}
    packages = {path.parent.name for path in package.glob("*/__init__.py")} | {package.name}
    tested = file.stem.removeprefix("test_")
    return any(tested == name or tested.startswith(f"{name}_") for name in modules | packages)
