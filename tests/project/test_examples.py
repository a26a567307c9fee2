"""Examples in the docstrings of public names give what they show."""

from __future__ import annotations

import doctest
import inspect

import pytest

import bayestouch

WITH_EXAMPLES = [name for name in bayestouch.__all__ if ">>>" in (inspect.getdoc(getattr(bayestouch, name)) or "")]


@pytest.mark.parametrize("name", WITH_EXAMPLES)
def test_example_gives_what_it_shows(name: str) -> None:
    text = inspect.getdoc(getattr(bayestouch, name)) or ""
    test = doctest.DocTestParser().get_doctest(text, {}, name, None, None)
    found = doctest.DocTestRunner().run(test)
    assert found.attempted >= 2 and found.failed == 0


def test_there_are_examples() -> None:
    assert len(WITH_EXAMPLES) >= 11
