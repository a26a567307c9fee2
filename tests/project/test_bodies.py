"""What differs between bodies is in the folders of the bodies: no code elsewhere asks which body it has."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "bayestouch"
KINDS = {"finger", "pad"}
CLASSES = {"Finger", "Pad", "FingerDesign", "PadDesign"}
# `finger_of` and `pad_of`, by which one body is refused, are the place where it is asked.
ASKED_HERE = {"data/sensor.py"}
# Tables of what is said or done of each body, which other code looks up by `body.kind`.
TABLES = {"data/geometry.py", "reporting/bodies.py", "simulation/__init__.py"}
# Files of each body that stand side by side under one name.
SIDE_BY_SIDE = {
    "{}": "beginning body calibration calibration_with_effects correction_basis fit geometry held_out known_touches "
    "lacking model noise planned priors quantities start touch_errors",
    "{}/reading": "reader touch_reader draws effects misfit live live_effects",
    "reporting/{}": "live numbers pages peaks pictures places sensor_picture sketch words",
}


def test_no_code_asks_which_body_it_has() -> None:
    found = {path.relative_to(PACKAGE).as_posix() for path in PACKAGE.rglob("*.py") if list(_branches(path))}
    assert found == ASKED_HERE


def test_bodies_are_listed_where_they_are_looked_up_alone() -> None:
    found = {path.relative_to(PACKAGE).as_posix() for path in PACKAGE.rglob("*.py") if list(_lists(path))}
    assert found == TABLES


def test_no_template_asks_which_body_it_has() -> None:
    templates = PACKAGE / "reporting" / "templates"
    for path in templates.glob("*.html"):
        text = path.read_text("utf-8")
        assert not any(f'"{kind}"' in text or f"if {kind}" in text for kind in KINDS), path.name
    assert {kind: sorted(path.name for path in (templates / kind).glob("*.html")) for kind in KINDS} == {
        "finger": [
            "apart.html",
            "as_paper.html",
            "as_tables_1_2.html",
            "estimates.html",
            "paper.html",
            "peaks.html",
            "words.html",
        ],
        "pad": ["estimates.html", "peaks.html", "words.html"],
    }


@pytest.mark.parametrize("folder", SIDE_BY_SIDE)
def test_bodies_have_files_of_the_same_names(folder: str) -> None:
    for name in SIDE_BY_SIDE[folder].split():
        for kind in KINDS:
            assert (PACKAGE / folder.format(kind) / f"{name}.py").is_file(), (folder, kind, name)


@pytest.mark.parametrize(
    "line",
    [
        "isinstance(body, Finger)",
        "isinstance(body, (Pad, Finger))",
        "body == 'finger'",
        "'pad' != kind",
        "body.kind == Finger.kind",
        "type(body) is Pad",
        "a.is_finger",
        "FingerDesign() if first else PadDesign()",
    ],
)
def test_a_question_is_found(tmp_path: Path, line: str) -> None:
    (tmp_path / "a.py").write_text(f"found = {line}\n")
    assert list(_branches(tmp_path / "a.py"))


def test_a_case_of_a_body_is_found(tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text("match kind:\n    case 'finger':\n        pass\n")
    assert list(_branches(tmp_path / "a.py"))


@pytest.mark.parametrize(
    "line",
    [
        "body not in ('finger', 'pad')",
        "click.Choice(['finger', 'pad'])",
        "{'finger': 1, 'pad': 2}[kind]",
        "{Finger.kind: 1, Pad.kind: 2}[kind]",
        "(FingerDesign, PadDesign)[second]",
    ],
)
def test_a_list_of_bodies_is_found(tmp_path: Path, line: str) -> None:
    (tmp_path / "a.py").write_text(f"found = {line}\n")
    assert list(_lists(tmp_path / "a.py"))


def _nodes(path: Path) -> Iterator[ast.AST]:
    """All code of a file; none of the folders of the bodies themselves, which may ask."""
    if not KINDS & set(path.parts[len(PACKAGE.parts) :]):
        yield from ast.walk(ast.parse(path.read_text("utf-8")))


def _named(*nodes: ast.AST) -> set[str]:
    """Bodies that are named, by a text or a class."""
    each = [inner for node in nodes for inner in ast.walk(node)]
    texts = {str(inner.value) for inner in each if isinstance(inner, ast.Constant)} & KINDS
    return texts | {inner.id for inner in each if isinstance(inner, ast.Name)} & CLASSES


def _branches(path: Path) -> Iterator[int]:
    """Lines that ask whether a body is a finger or a pad."""
    for node in _nodes(path):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "isinstance":
            asked = _named(node.args[1])
        elif isinstance(node, ast.Compare | ast.MatchValue | ast.MatchClass):
            asked = _named(node)
        elif isinstance(node, ast.IfExp):
            asked = _named(node.body) and _named(node.orelse)
        elif isinstance(node, ast.Attribute):
            asked = {node.attr} & {"is_finger", "is_pad"}
        else:
            continue
        if asked:
            yield node.lineno


def _lists(path: Path) -> Iterator[int]:
    """Lines that list both bodies, so that code could choose between them; not types, nor what a module exports."""
    for node in _nodes(path):
        if isinstance(node, ast.List | ast.Tuple | ast.Set | ast.Dict):
            several = node.keys if isinstance(node, ast.Dict) else node.elts
            if len([each for each in several if each is not None and _named(each)]) > 1:
                yield node.lineno
