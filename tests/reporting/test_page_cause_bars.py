"""Bars of the probabilities of causes: their text and their lengths are the numbers."""

from __future__ import annotations

import re
from typing import Any

import pytest
from jsonschema import Draft202012Validator
from report_cases import Page

from bayestouch.reporting.diagnosis_file import SCHEMA
from bayestouch.reporting.page import new_environment

CAUSES = [
    {"names": ["crosstalk"], "probability": 0.7},
    {"names": ["crosstalk", "something in place"], "probability": 0.25},
    {"names": ["<b>"], "probability": 0.05},
]


def page(**diagnosis: Any) -> str:
    diagnosis = {"verdict": "explained", **diagnosis}
    return new_environment({"diagnosis": diagnosis}, ()).get_template("causes.html").render()


def test_bars_are_the_numbers() -> None:
    made = page(causes=CAUSES)
    parts = Page(made)
    assert len(parts.all("dl")) == 1 and len(parts.all("dt")) == len(parts.all("dd")) == 3
    rows = [re.sub("<.*?>", "", each).split("  ") for each in re.findall("<dt>(.*?)</dd>", made)]
    assert [" ".join(row).split() for row in rows] == [
        ["crosstalk", "70", "%"],
        ["crosstalk", "and", "something", "in", "place", "25", "%"],
        ["&lt;b&gt;", "5", "%"],
    ]
    lengths = [float(re.findall(r"width: ([\d.]+)%", str(each["style"]))[0]) for each in parts.all("span")]
    assert lengths == [42.0, 15.0, 3.0]


def test_no_bars_without_probabilities() -> None:
    """Files of version 0.1 have none."""
    assert page(effects=[]).strip() == ""


@pytest.mark.parametrize(
    "wrong", [{"names": "a", "probability": 0.5}, {"names": [], "probability": 1.5}, {"names": []}]
)
def test_other_causes_are_refused(wrong: Any) -> None:
    checker = Draft202012Validator(SCHEMA["properties"]["causes"])
    assert checker.is_valid(CAUSES) and not checker.is_valid([wrong])
