"""Which test files are run against a change to a module, and in which order."""

from __future__ import annotations

import ast
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
PARTS = Path(__file__).parent / "mutants" / "parts.toml"


@dataclass(frozen=True)
class Part:
    """A part of the core: its modules, and the patterns of the test files that go with it."""

    name: str
    modules: tuple[Path, ...]
    tests: tuple[str, ...]


def parts() -> tuple[tuple[Part, ...], tuple[str, ...]]:
    """The parts, each module in one, and the tests that go with every part."""
    read = tomllib.loads(PARTS.read_text("utf-8"))
    package, found = ROOT / "bayestouch", []
    for part in read["part"]:
        left_out = {path for pattern in part.get("without", ()) for path in package.glob(pattern)}
        modules = {path for pattern in part["modules"] for path in package.glob(pattern)} - left_out
        if not modules:
            raise LookupError(f"{PARTS.name}: no module of the part {part['name']!r} is there")
        paths = tuple(sorted(path.relative_to(ROOT) for path in modules))
        found.append(Part(part["name"], paths, tuple(part["tests"])))
    return tuple(found), tuple(read["every"])


def imported_modules(test: Path) -> frozenset[str]:
    """Dotted names that a file imports, and that of each name it takes from a module, which may be one too."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(test.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            names |= {each.name for each in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module, *(f"{node.module}.{each.name}" for each in node.names)}
    return frozenset(names)


@dataclass(frozen=True)
class Tests:
    """Test files for each module: those that import it, those of its part, those for every part."""

    imports: Mapping[Path, frozenset[str]]
    every: tuple[str, ...]

    @classmethod
    def read(cls, every: tuple[str, ...]) -> Tests:
        folder = ROOT / "tests"
        return cls({path.relative_to(ROOT): imported_modules(path) for path in folder.rglob("test_*.py")}, every)

    def candidates(self, module: Path, part: Part) -> tuple[frozenset[Path], frozenset[Path]]:
        """Files that import the module, and the others that may be run against a change to it."""
        dotted = ".".join(module.with_suffix("").parts).removesuffix(".__init__")
        direct = frozenset(path for path, names in self.imports.items() if dotted in names)
        patterns = (*part.tests, *self.every)
        others = {path for path in self.imports if any(path.match(pattern) for pattern in patterns)}
        return direct, frozenset(others) - direct

    def chosen(self, module: Path, part: Part, seconds: Mapping[Path, float], budget: float) -> list[Path]:
        """Files in the order in which they run: importers, then the others, each the quickest first.

        `seconds` holds what each file takes unchanged; one that is not in it cannot be run. A file that would bring
        the sum above `budget` seconds is left out.
        """
        files, spent = [], 0.0
        for group in self.candidates(module, part):
            for path in sorted(group & seconds.keys(), key=lambda each: (seconds[each], each)):
                if spent + seconds[path] <= budget:
                    files.append(path)
                    spent += seconds[path]
        return files
