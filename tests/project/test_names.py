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
    assert {name: files for name, files in twice.items() if not _of_each_body(files)} == PUBLIC


def _of_each_body(files: list[str]) -> bool:
    """Whether a name stands in files that differ by the body alone: what finger and pad do each in its own way."""
    return len({file.replace("pad", "finger") for file in files}) == 1


def _twice(kind: type[ast.ClassDef] | type[ast.FunctionDef]) -> dict[str, list[str]]:
    """Files by the public names at the top of modules that several of them define."""
    found = defaultdict(list)
    for path in sorted(PACKAGE.rglob("*.py")):
        for node in ast.parse(path.read_text("utf-8")).body:
            if isinstance(node, kind) and not node.name.startswith("_"):
                found[node.name].append(path.relative_to(ROOT).as_posix())
    return {name: files for name, files in found.items() if len(files) > 1}
