"""One meaning a name: no public class of the package is defined twice, and hardly a public function."""

from __future__ import annotations

import ast
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "bayestouch"

# A command and the function of Python that it calls have the name of the verb.
COMMANDS = ("calibrate", "check", "diagnose", "infer", "report", "simulate")
# `published.number("spacing")`, a part of the interface that the README shows, and `number(0.1)` in words.
PUBLIC = {"number": ["bayestouch/output/text.py", "bayestouch/paper/published.py"]}


def test_a_class_name_has_one_meaning() -> None:
    assert _twice(ast.ClassDef) == {}


def test_a_function_name_has_one_meaning() -> None:
    twice = _twice(ast.FunctionDef)
    for verb in COMMANDS:
        places = twice.pop(verb, [])
        assert len(places) <= 2, places
        assert not places or f"bayestouch/commands/{verb}.py" in places, places
    assert twice == PUBLIC


def _twice(kind: type[ast.ClassDef] | type[ast.FunctionDef]) -> dict[str, list[str]]:
    """Files by the public names at the top of modules that several of them define."""
    found = defaultdict(list)
    for path in sorted(PACKAGE.rglob("*.py")):
        for node in ast.parse(path.read_text("utf-8")).body:
            if isinstance(node, kind) and not node.name.startswith("_"):
                found[node.name].append(path.relative_to(ROOT).as_posix())
    return {name: files for name, files in found.items() if len(set(map(_whatever_the_body, files))) > 1}


def _whatever_the_body(file: str) -> str:
    """The file that a finger and a pad have both: what each does in its own way has one name and one meaning."""
    path = Path(file)
    parts = ["body" if part in ("finger", "pad") else part for part in path.with_suffix("").parts]
    return "/".join(parts)
