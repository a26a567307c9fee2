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
# Where it is still asked; this list only gets shorter.
LEFT = {
    "commands/simulate.py",
    "effects/stated.py",
}
# Files of each body that stand side by side under one name.
SIDE_BY_SIDE = {
    "{}": "beginning body calibration calibration_with_effects correction_basis fit held_out known_touches lacking "
    "model noise priors quantities start touch_errors",
    "{}/reading": "reader touch_reader draws effects misfit",
    "reporting/{}": "live numbers pages peaks pictures places sensor_picture words",
}


def test_no_code_asks_which_body_it_has() -> None:
    found = {path.relative_to(PACKAGE).as_posix() for path in PACKAGE.rglob("*.py") if list(_branches(path))}
    assert found - ASKED_HERE <= LEFT


def test_no_template_asks_which_body_it_has() -> None:
    templates = PACKAGE / "reporting" / "templates"
    for path in templates.glob("*.html"):
        text = path.read_text("utf-8")
        assert not any(f'"{kind}"' in text or f"if {kind}" in text for kind in KINDS), path.name
    assert {kind: sorted(path.name for path in (templates / kind).glob("*.html")) for kind in KINDS} == {
        "finger": ["apart.html", "estimates.html", "paper.html", "peaks.html", "words.html"],
        "pad": ["estimates.html", "peaks.html", "words.html"],
    }


@pytest.mark.parametrize("folder", SIDE_BY_SIDE)
def test_bodies_have_files_of_the_same_names(folder: str) -> None:
    for name in SIDE_BY_SIDE[folder].split():
        for kind in KINDS:
            assert (PACKAGE / folder.format(kind) / f"{name}.py").is_file(), (folder, kind, name)


@pytest.mark.parametrize(
    "line",
    ["isinstance(body, Finger)", "isinstance(body, (Pad, Finger))", "body == 'finger'", "'pad' != kind", "a.is_finger"],
)
def test_a_question_is_found(tmp_path: Path, line: str) -> None:
    (tmp_path / "a.py").write_text(f"found = {line}\n")
    assert list(_branches(tmp_path / "a.py"))


def _branches(path: Path) -> Iterator[int]:
    """Lines that ask whether a body is a finger or a pad; code of the bodies themselves may."""
    if KINDS & set(path.parts[len(PACKAGE.parts) :]):
        return
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "isinstance":
            asked = {each.id for each in ast.walk(node.args[1]) if isinstance(each, ast.Name)} & CLASSES
        elif isinstance(node, ast.Compare):
            sides = (node.left, *node.comparators)
            asked = {str(each.value) for each in sides if isinstance(each, ast.Constant)} & KINDS
        elif isinstance(node, ast.Attribute):
            asked = {node.attr} & {"is_finger", "is_pad"}
        else:
            continue
        if asked:
            yield node.lineno
