"""A sample of small changes to the package's code, each made by an operator of cosmic-ray.

A place is a number, an operator or a word of the code that some operator can change. Places are ordered by a hash of
what stands there, and the first are taken: every place has the same chance, and a change of other lines leaves the
sample as it is.
"""

from __future__ import annotations

import ast
import hashlib
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import permutations
from pathlib import Path

from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.ast.ast_query import ASTQuery
from cosmic_ray.mutating import mutate_code
from cosmic_ray.plugins import get_operator
from cosmic_ray.work_item import MutationSpec, WorkItem

# Left out is what cannot but end in an error (shifts of floats, a missing decorator), and `|`, which here joins types.
OPERATORS = (
    *(f"ReplaceBinaryOperator_{a}_{b}" for a, b in permutations(("Add", "Sub", "Mul", "Div"), 2)),
    "ReplaceBinaryOperator_Pow_Mul",
    *(f"ReplaceComparisonOperator_{a}_{b}" for a, b in permutations(("Lt", "LtE", "Gt", "GtE"), 2)),
    *(f"ReplaceComparisonOperator_{a}_{b}" for a, b in permutations(("Eq", "NotEq"), 2)),
    *(f"ReplaceComparisonOperator_{a}_{b}" for a, b in permutations(("Is", "IsNot"), 2)),
    *(f"ReplaceUnaryOperator_Delete_{a}" for a in ("USub", "Invert", "Not")),
    "AddNot",
    "ReplaceTrueWithFalse",
    "ReplaceFalseWithTrue",
    "ReplaceAndWithOr",
    "ReplaceOrWithAnd",
    "ReplaceBreakWithContinue",
    "ReplaceContinueWithBreak",
    "ExceptionReplacer",
    "NumberReplacer",
    "ZeroIterationForLoop",
)


@dataclass(frozen=True)
class Mutant:
    """One change: where it is, by which operator, and the line before and after."""

    spec: MutationSpec
    before: str
    after: str

    @property
    def name(self) -> str:
        return f"{self.spec.module_path.as_posix()}:{self.spec.start_pos[0]}"

    def item(self) -> WorkItem:
        """The change as cosmic-ray stores it; its number says what it is, so that results are found again."""
        told = (self.spec.module_path.as_posix(), self.spec.operator_name, str(self.spec.occurrence))
        return WorkItem.single(hashlib.sha256("\0".join(told).encode()).hexdigest(), self.spec)


def _specs(module: Path, code: str) -> Iterator[MutationSpec]:
    """Every change to a module, in one walk through it."""
    operators = {f"core/{name}": get_operator(f"core/{name}")() for name in OPERATORS}
    seen: Counter[str] = Counter()
    for node in ast_nodes(get_ast(code)):
        # `*` and `/` among parameters are marks, no operators
        mark = getattr(node, "value", None) in ("*", "/") and node.parent.type in ("parameters", "lambdef")
        for name, operator in operators.items():
            for start, end in operator.mutation_positions(node):
                if not mark:
                    where = ASTQuery(node).get_definition_name()
                    yield MutationSpec(module, name, seen[name], start, end, definition_name=where)
                seen[name] += 1


def _changed(code: str, spec: MutationSpec) -> str | None:
    """The module with the change, or None where that is no Python, or the same program in other words."""
    changed = mutate_code(code, get_operator(spec.operator_name)(), spec.occurrence)
    if changed is None:
        return None
    try:
        same = ast.dump(ast.parse(changed)) == ast.dump(ast.parse(code))
    except SyntaxError:
        return None
    return None if same else changed


def _digest(*told: object) -> str:
    return hashlib.sha256("\0".join(map(str, told)).encode()).hexdigest()


def sample(modules: Iterable[Path], number: int, seed: int, root: Path) -> tuple[list[Mutant], int]:
    """`number` changes, one a place, and how many places there are. Module paths are relative to `root`."""
    codes = {module: (root / module).read_text("utf-8") for module in modules}
    places: dict[tuple[Path, tuple[int, int]], list[MutationSpec]] = defaultdict(list)
    for module, code in codes.items():
        for spec in _specs(module, code):
            places[module, spec.start_pos].append(spec)

    twins: Counter[tuple[object, ...]] = Counter()
    ordered = []
    for (module, (row, column)), specs in places.items():
        line = codes[module].splitlines()[row - 1]
        told = (module.as_posix(), specs[0].definition_name, line.strip(), column - len(line) + len(line.lstrip()))
        ordered.append((_digest(seed, *told, twins[told]), (module, (row, column))))
        twins[told] += 1
    chosen: list[Mutant] = []
    for digest, (module, place) in sorted(ordered):
        if len(chosen) == number:
            break
        for spec in sorted(places[module, place], key=lambda s: _digest(digest, s.operator_name, s.occurrence)):
            changed = _changed(codes[module], spec)
            if changed is not None:
                row = place[0] - 1
                before, after = (text.splitlines()[row].strip() for text in (codes[module], changed))
                chosen.append(Mutant(spec, before, after))
                break
    return chosen, len(places)


def fingerprint(paths: Sequence[Path], *settings: object) -> str:
    """A short name for the content of files and for settings: results belong to these alone."""
    told = hashlib.sha256(repr(settings).encode())
    for path in sorted(paths):
        told.update(path.as_posix().encode() + b"\0" + path.read_bytes())
    return told.hexdigest()[:12]
