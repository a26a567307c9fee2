"""Nodes, layers and circles at the first level of the package."""

from __future__ import annotations

from typing import Any

import pytest
from study_modules import study

pytest.importorskip("grimp", reason="import-linter, which brings grimp, is not installed (extra dev)")
import_graph = study("import_graph")


def graph(**imports: str) -> Any:
    return import_graph.house({node: frozenset(found.split()) for node, found in imports.items()})


def test_layers_are_the_longest_chain_and_circles_are_found() -> None:
    plain = graph(a="b c", b="c", c="", d="")
    assert plain.facts == {"nodes": 4, "layers": 3, "arrows": 3, "circles": 0, "nodes in circles": 0}
    assert plain.layer == {"a": 2, "b": 1, "c": 0, "d": 0}
    circle = graph(a="b", b="c", c="b d", d="", e="f", f="e")
    assert circle.facts == {"nodes": 6, "layers": 3, "arrows": 6, "circles": 2, "nodes in circles": 4}
    assert circle.circles == [frozenset("bc"), frozenset("ef")]


def test_a_call_goes_up_against_the_arrows() -> None:
    made = graph(a="b", b="c d", c="b", d="")
    assert not made.goes_up("a/x.py", "b.py")
    assert made.goes_up("b.py", "a/x.py")
    assert made.goes_up("b.py", "c/y.py")
    assert made.goes_up("c/y.py", "b.py")
    assert not made.goes_up("a/x.py", "a/y.py")
    assert not made.goes_up("d.py", "__init__.py")


def test_the_package_is_within_its_limits() -> None:
    """At most 30 nodes and 12 layers, so that the whole can be seen at once; no circle."""
    found = import_graph.facts(import_graph.ROOT, calls=False)
    assert found["nodes"] <= 30
    assert found["layers"] <= 12
    assert found["circles"] == 0
