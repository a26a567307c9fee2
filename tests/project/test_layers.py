"""The house of docs/contributing.md: what imports what, and how much lies loose at the top."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("importlinter", reason="import-linter is not installed (extra dev)")

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "bayestouch"


def test_no_layer_imports_one_above_it() -> None:
    code = "from importlinter.cli import lint_imports; raise SystemExit(lint_imports(cache_dir=None))"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


def test_files_do_not_import_each_other_in_a_circle() -> None:
    """Imports inside functions and for type checkers count too."""
    files = {path: _dotted(path) for path in PACKAGE.rglob("*.py")}
    names = set(files.values())
    imports = {name: _imported(path, names) - {name, "bayestouch"} for path, name in files.items()}
    free: set[str] = set()
    while True:
        more = {name for name in imports if name not in free and imports[name] <= free}
        if not more:
            break
        free |= more
    assert names - free <= {"bayestouch"}


def test_few_modules_lie_loose_at_the_top() -> None:
    loose = sorted(path.name for path in PACKAGE.glob("*.py"))
    assert len(loose) <= 8, loose
    assert all(len(path.read_text("utf-8").splitlines()) <= 300 for path in PACKAGE.glob("*.py"))


def _dotted(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


def _imported(path: Path, names: set[str]) -> set[str]:
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            found |= {each.name for each in node.names if each.name in names}
        elif isinstance(node, ast.ImportFrom) and node.module in names:
            for each in node.names:
                inner = f"{node.module}.{each.name}"
                found.add(inner if inner in names else str(node.module))
    return found
