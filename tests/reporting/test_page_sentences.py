"""Sentences of single parts of the page: of each body, of one touch or many, and where nothing was held out."""

from __future__ import annotations

from typing import Any

import pytest
from report_cases import Page

from bayestouch.reporting.page import new_environment


def words(template: str, numbers: dict[str, Any]) -> str:
    """Text of a part of the page, with single spaces."""
    environment = new_environment(numbers, ())
    whole = f'{{% import "macros.html" as show with context %}}{{% include "{template}" %}}'
    return " ".join(" ".join(Page(environment.from_string(whole).render()).text).split())


@pytest.mark.parametrize(("body", "offered"), [("finger", True), ("pad", False)])
def test_only_a_finger_has_another_prior_of_the_radius(body: str, offered: bool) -> None:
    """`bayestouch infer --indenter` refuses pads."""
    found = {"noticeable": 0.05, "parameters": []}
    numbers = {"checks": {"predictive": None, "prior_sensitivity": found}, "data": {"body": body}}
    said = words("checks.html", numbers)
    assert "Touches have uniform priors, which no power changes" in said
    assert ("--indenter" in said) == offered
