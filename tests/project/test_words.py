"""Pages, messages, docstrings and comments have none of the words of `docs/style/words.toml`."""

from __future__ import annotations

import ast
import io
import json
import re
import tokenize
import tomllib
from collections.abc import Iterator

import pytest
from committed import ROOT
from proselint.checks import __register__
from proselint.config import load_from
from proselint.registry import CheckRegistry
from proselint.tools import LintFile

RULES = tomllib.loads((ROOT / "docs" / "style" / "words.toml").read_text("utf-8"))["rule"]
PAGES = [
    ROOT / "README.md",
    *sorted((ROOT / "docs").glob("*.md")),
    *sorted((ROOT / "docs" / "notebooks").glob("*.ipynb")),
]
#: Blocks of code, indented commands, code in a line, formulas, and addresses.
CODE = re.compile(
    r"^(```|~~~).*?^\1|^    \S.*?$|`[^`\n]+`|\$\$.*?\$\$|\$[^$\n]+\$|\]\([^)]*\)|\]\[[^]]*\]", re.MULTILINE | re.DOTALL
)

TABLE = re.compile(r"^\|.*$", re.MULTILINE)


def prose(name: str, text: str) -> str:
    """Text of a page with code blanked, so that lines keep their numbers; of a notebook its cells of text."""
    if name.endswith(".ipynb"):
        cells = json.loads(text)["cells"]
        text = "\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "markdown")
    return CODE.sub(lambda match: re.sub(r"[^\n]", " ", match[0]), text)


def found(name: str, text: str) -> Iterator[str]:
    """A line for each use of a word that is in the rules."""
    text = prose(name, text)
    for rule in RULES:
        allowed = [match.span() for each in rule.get("but", ()) for match in re.finditer(each, text, re.IGNORECASE)]
        for match in re.finditer(rule["words"], text, re.IGNORECASE):
            if not any(low <= match.start() < high for low, high in allowed):
                line = text[: match.start()].count("\n") + 1
                yield f"{name}:{line}: {match[0]!r}: write {rule['instead']}"


def test_pages_have_none_of_these_words() -> None:
    lines = [line for page in PAGES for line in found(page.name, page.read_text("utf-8"))]
    assert not lines, f"{len(lines)} words of docs/style/words.toml:\n" + "\n".join(lines)


def texts(source: str) -> Iterator[str]:
    """Texts of a module that a user may see: strings of more than one word that are no docstrings, values left out."""
    tree = ast.parse(source)
    inside = {id(part) for each in ast.walk(tree) if isinstance(each, ast.JoinedStr) for part in each.values}
    docstrings = {id(each.value) for each in ast.walk(tree) if isinstance(each, ast.Expr)}
    for each in ast.walk(tree):
        if isinstance(each, ast.JoinedStr):
            yield "".join(str(part.value) if isinstance(part, ast.Constant) else "0" for part in each.values)
        elif isinstance(each, ast.Constant) and isinstance(each.value, str) and id(each) not in inside | docstrings:
            yield each.value


def test_messages_and_reports_have_none_of_these_words() -> None:
    lines = [
        line
        for path in sorted((ROOT / "bayestouch").rglob("*.py"))
        for text in texts(path.read_text("utf-8"))
        if " " in text.strip()
        for line in found(path.name, text)
    ]
    for path in sorted((ROOT / "bayestouch").rglob("*.html")):
        lines += found(path.name, re.sub(r"<[^>]+>", " ", path.read_text("utf-8")))
    assert not lines, f"{len(lines)} words of docs/style/words.toml:\n" + "\n".join(lines)


#: Names in double backquotes, which are code.
NAMES = re.compile(r"``[^`]+``")


def remarks(source: str) -> str:
    """Docstrings and comments of a module, each in its line, with all code blanked."""
    lines = [""] * (source.count("\n") + 1)
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            first, last = node.value.lineno - 1, node.value.end_lineno
            lines[first:last] = source.split("\n")[first:last]
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            lines[token.start[0] - 1] += token.string
    # The indentation of a docstring is not that of a block of code.
    return NAMES.sub("", "\n".join(line.strip() for line in lines))


def test_docstrings_and_comments_have_none_of_these_words() -> None:
    lines = [
        line
        for path in sorted((ROOT / "bayestouch").rglob("*.py"))
        for line in found(path.relative_to(ROOT).as_posix(), remarks(path.read_text("utf-8")))
    ]
    assert not lines, f"{len(lines)} words of docs/style/words.toml:\n" + "\n".join(lines)


def test_remarks_of_a_module_are_its_docstrings_and_comments() -> None:
    source = 'def f():\n    """It\n\n    stands."""\n    return "alike"  # Alike, ``alike``.\n'
    assert [line.split(": ")[0] for line in found("a.py", remarks(source))] == ["a.py:4", "a.py:5"]


def test_texts_of_a_module_are_its_messages() -> None:
    source = '"""It stands."""\nx = f"{y} is told"\n\ndef f():\n    """Stands."""\n    return "a b"\n'
    assert sorted(texts(source)) == ["0 is told", "a b"]


def linted(name: str, text: str) -> Iterator[str]:
    """A line for each finding of proselint, but words that a heading, a paragraph's end or code stands between."""
    if not CheckRegistry().checks:
        CheckRegistry().register_many(__register__)
    text = TABLE.sub("", prose(name, text))
    for each in LintFile(name, text).lint(load_from(ROOT / "docs" / "style" / "proselint.json")):
        low, high = (edge - 1 for edge in each.check_result.span)  # proselint adds a line before the text
        if each.check_result.check_path != "lexical_illusions" or not re.search(r"\s\s|\n#", text[low:high]):
            yield f"{name}:{text[:low].count(chr(10)) + 1}: {each.check_result.message}"


def test_a_prose_linter_finds_nothing() -> None:
    lines = [line for page in PAGES for line in linted(page.name, page.read_text("utf-8"))]
    assert not lines, f"{len(lines)} findings of proselint:\n" + "\n".join(lines)


def test_the_prose_linter_is_asked() -> None:
    lines = list(linted("a.md", "# The the\n\nA touch is is read.\n\nAt the end of the day it is irregardless.\n"))
    assert [line.split(": ")[0] for line in lines] == ["a.md:1", "a.md:3", "a.md:5", "a.md:5", "a.md:5"]
    assert not list(linted("a.md", "# A touch\n\nA touch is read: `is is`.\n\n| 2 | 2 |\n"))


@pytest.mark.parametrize(
    ("text", "count"),
    [
        ("An edge is told from a flat.", 2),
        ("What the model misses stands here.", 2),
        ("What it misses at high loads.", 1),
        ("A touch that missed its target.", 0),
        ("Drawn by hand.", 0),
        ("The command hands out the blocks.", 1),
        ("`stands` and\n```python\nalike = 1\n```\n", 0),
        ("The readings tell nothing, held against\nthe table.", 2),
        ("It is distinguished from an edge.", 0),
    ],
)
def test_the_rules_find_words_and_leave_code_alone(text: str, count: int) -> None:
    assert len(list(found("a.md", text))) == count
    cell = json.dumps({"cells": [{"cell_type": "markdown", "source": [text]}, {"cell_type": "code", "source": [text]}]})
    assert len(list(found("a.ipynb", cell))) == count


def test_each_rule_is_used_by_a_reader() -> None:
    assert all(set(rule) <= {"words", "instead", "but"} and rule["instead"] for rule in RULES)
