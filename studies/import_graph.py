"""What imports what at the first level of the package, and how often a call of `infer` goes up, in two versions.

    python studies/import_graph.py [--before CHECKOUT] [--no-calls] [--docs]

CHECKOUT is a checkout of another version (`git worktree add CHECKOUT COMMIT`; version 0.1.0 is the commit 3fd6f46).
`--no-calls` leaves out the calls, which take a minute. `--docs` writes the table of `docs/contributing.md`.

A node is a module or a package directly under `bayestouch`. An arrow is a node that imports another one; imports inside
functions and for type checkers count. Nodes that import each other, directly or through others, are a circle, and
count as one node for the layers: the layers are the longest chain of arrows.

A call goes up if the called file is in a node above that of the calling file, or in another node of the same circle.
Each pair of a calling function and a called file counts once.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Mapping
from graphlib import TopologicalSorter
from pathlib import Path
from typing import NamedTuple

from _page import DOCS, markdown_table, put_into_page

ROOT = Path(__file__).resolve().parents[1]

# Run with the code of either version: the functions of the package that call one another while touches are read.
TRACED = """
import json, os, sys, bayestouch
root = os.path.dirname(bayestouch.__file__) + os.sep
design = bayestouch.FingerDesign(n_elements=4, edge_step_deg=6.0, flat_step_deg=12.0, touch_step_deg=10.0)
dataset = bayestouch.simulate(design, seed=3).dataset
calibration = bayestouch.calibrate(dataset, draws=100, seed=1)
calls = set()
def called(frame, event, _):
    if event != "call" or not frame.f_code.co_filename.startswith(root) or frame.f_code.co_name == "<module>":
        return
    above = frame.f_back
    while above is not None and not above.f_code.co_filename.startswith(root):
        above = above.f_back
    if above is not None:
        caller = above.f_code
        calls.add((caller.co_filename[len(root):], caller.co_qualname, frame.f_code.co_filename[len(root):]))
sys.setprofile(called)
bayestouch.infer(dataset.touches, calibration, draws=128, seed=2)
sys.setprofile(None)
print(json.dumps(sorted(calls)))
"""


class House(NamedTuple):
    """The first level of one version: what each node imports, its layer from below, and its circle."""

    imports: Mapping[str, frozenset[str]]
    layer: Mapping[str, int]
    circles: list[frozenset[str]]

    @property
    def facts(self) -> dict[str, int]:
        """Sizes of the graph, by what they are."""
        return {
            "nodes": len(self.imports),
            "layers": max(self.layer.values()) + 1,
            "arrows": sum(len(each) for each in self.imports.values()),
            "circles": len(self.circles),
            "nodes in circles": sum(len(each) for each in self.circles),
        }

    def goes_up(self, caller: str, called: str) -> bool:
        """Whether a call from one file to another goes up."""
        low, high = (path.split("/")[0].removesuffix(".py") for path in (caller, called))
        if low == high or not {low, high} <= self.layer.keys():
            return False
        return self.layer[high] > self.layer[low] or any({low, high} <= each for each in self.circles)


def house(imports: Mapping[str, frozenset[str]]) -> House:
    """Layers and circles of a graph."""
    reached = {node: _reached(node, imports) for node in imports}
    # What reaches itself is in a circle, with all that it reaches and that reaches it.
    both = {node: frozenset(other for other in reached[node] if node in reached[other]) for node in imports}
    circles = set(filter(None, both.values()))
    whole = {node: next((each for each in circles if node in each), frozenset({node})) for node in imports}
    merged = {of: {whole[other] for node in of for other in imports[node]} - {of} for of in whole.values()}
    height: dict[frozenset[str], int] = {}
    for each in TopologicalSorter(merged).static_order():
        height[each] = 1 + max((height[below] for below in merged[each]), default=-1)
    return House(imports, {node: height[of] for node, of in whole.items()}, sorted(circles, key=sorted))


def _reached(node: str, imports: Mapping[str, frozenset[str]]) -> set[str]:
    found: set[str] = set()
    ahead = set(imports[node])
    while ahead:
        found |= ahead
        ahead = {other for each in ahead for other in imports[each]} - found
    return found


def first_level(checkout: Path) -> House:
    """The first level of the package in a checkout; `bayestouch` itself and its `__main__` are left out."""
    code = "import grimp, json; g = grimp.build_graph('bayestouch', cache_dir=None)\n"
    code += "print(json.dumps({m: sorted(g.find_modules_directly_imported_by(m)) for m in g.modules}))"
    files = json.loads(_output(code, checkout))
    imports: dict[str, set[str]] = {}
    for file, found in files.items():
        node = _node(file)
        if node:
            imports.setdefault(node, set()).update(filter(None, map(_node, found)))
    return house({node: frozenset(found - {node}) for node, found in imports.items()})


def _node(module: str) -> str:
    name = (module + ".").split(".")[1]
    return "" if name == "__main__" else name


def _output(code: str, checkout: Path) -> str:
    environment = {**os.environ, "PYTHONPATH": str(checkout.resolve())}
    done = subprocess.run([sys.executable, "-c", code], env=environment, cwd=checkout, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(done.stderr)
    return done.stdout.splitlines()[-1]


def facts(checkout: Path, *, calls: bool) -> dict[str, int]:
    """Sizes of the graph of a checkout, and the calls of `infer` if they are wanted."""
    graph = first_level(checkout)
    found = dict(graph.facts)
    if calls:
        traced = [tuple(each) for each in json.loads(_output(TRACED, checkout))]
        found["files entered by `infer`"] = len({called for _, _, called in traced})
        found["calls that go up"] = len({each for each in traced if graph.goes_up(each[0], each[2])})
    return found


def main(arguments: list[str] | None = None) -> None:
    """Print the table, and write it into the page if that is wanted."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--before", type=Path, help="checkout of another version")
    parser.add_argument("--no-calls", action="store_true", help="only the imports")
    parser.add_argument("--docs", action="store_true", help="write the table of docs/contributing.md")
    chosen = parser.parse_args(arguments)
    versions = ([("before", chosen.before)] if chosen.before else []) + [("now", ROOT)]
    columns = {name: facts(checkout, calls=not chosen.no_calls) for name, checkout in versions}
    rows = [(what, *(str(each[what]) for each in columns.values())) for what in columns["now"]]
    table = markdown_table(("first level of the package", *columns), rows)
    print(table, end="")
    if chosen.docs:
        put_into_page("import_graph.py", table, DOCS / "contributing.md")


if __name__ == "__main__":
    main()
