"""Pages answer the questions of `readers_test.toml`: words of a right answer are below the heading that it names."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
from committed import ROOT

QUESTIONS: dict[str, list[dict[str, Any]]] = tomllib.loads(
    (Path(__file__).parent / "readers_test.toml").read_text("utf-8")
)
CASES = [(page, question) for page, questions in QUESTIONS.items() for question in questions]
HEADING = re.compile(r"^(#{1,3}) (.+)$", re.MULTILINE)
CODE = re.compile(r"^(```|~~~).*?^\1$", re.MULTILINE | re.DOTALL)


def below(text: str, heading: str) -> str:
    """Text below a heading, up to the next heading of the same level or above; all of it without a heading."""
    if not heading:
        return text
    # a comment in a block of code is no heading
    plain = CODE.sub(lambda block: block[0].replace("#", "."), text)
    found = list(HEADING.finditer(plain))
    start = next((each for each in found if each[2] == heading), None)
    assert start is not None, f"no heading {heading!r}"
    later = (each.start() for each in found if each.start() > start.start() and len(each[1]) <= len(start[1]))
    return text[start.end() : next(later, len(text))]


@pytest.mark.parametrize(("page", "question"), CASES, ids=[f"{page}: {each['ask']}" for page, each in CASES])
def test_page_contains_the_answer(page: str, question: dict[str, Any]) -> None:
    text = " ".join(below((ROOT / page).read_text("utf-8"), question["under"]).split())
    missing = [words for words in question["words"] if " ".join(words.split()) not in text]
    assert not missing, question["ask"]


@pytest.mark.parametrize("page", QUESTIONS)
def test_each_page_has_ten_questions_of_three_kinds(page: str) -> None:
    questions = QUESTIONS[page]
    assert len(questions) == len({each["ask"] for each in questions}) == 10
    assert {each["kind"] for each in questions} == {"do", "number", "refused"}
    assert all(set(each) == {"kind", "ask", "under", "words"} and each["words"] for each in questions)


def test_the_number_of_pages_is_stated() -> None:
    assert f"for each of {len(QUESTIONS)} pages" in (ROOT / "docs" / "verified.md").read_text("utf-8")


def test_a_heading_ends_at_the_next_one() -> None:
    text = "# A\none\n## B\ntwo\n```\n# no heading\n```\n### C\nthree\n## D\nfour\n"
    assert "one" not in below(text, "B") and "three" in below(text, "B") and "four" not in below(text, "B")
    assert "no heading" in below(text, "B") and below(text, "") == text
    with pytest.raises(AssertionError, match="no heading 'E'"):
        below(text, "E")
