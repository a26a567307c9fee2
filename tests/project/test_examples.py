"""Docstrings of public names are complete, and their examples give what they show."""

from __future__ import annotations

import dataclasses
import doctest
import inspect
import re
from pathlib import Path

import pytest

import bayestouch

PARAMETER = re.compile(r"^(?:\*\*)?(\w[\w, ]*?)(?: : .+)?$", re.MULTILINE)
#: A check reports what is wrong with a data set, it does not refuse it.
RAISES_NOTHING = {"check"}
FUNCTIONS = [name for name in bayestouch.__all__ if inspect.isfunction(getattr(bayestouch, name))]
DATA = [name for name in bayestouch.__all__ if dataclasses.is_dataclass(getattr(bayestouch, name))]


def sections(name: str) -> dict[str, str]:
    """Text of each section of the docstring of a public name, by its title."""
    text = inspect.getdoc(getattr(bayestouch, name)) or ""
    parts = re.split(r"^(\w+)\n-+\n", text, flags=re.MULTILINE)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


def listed(section: str) -> set[str]:
    """Names that a section of parameters or attributes explains; ``a, b : float`` are two."""
    return {name for line in PARAMETER.findall(section) for name in line.split(", ")}


@pytest.mark.parametrize("name", bayestouch.__all__)
def test_example_gives_what_it_shows(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("Agg")
    monkeypatch.chdir(tmp_path)  # examples write files
    test = doctest.DocTestParser().get_doctest(sections(name).get("Examples", ""), {}, name, None, None)
    found = doctest.DocTestRunner().run(test)
    pyplot.close("all")
    assert found.attempted >= 2 and found.failed == 0
    assert any(example.want for example in test.examples), "no output is compared"
    assert any(re.search(rf"\b{name}\b", example.source) for example in test.examples) or name in MADE_BY_A_VERB


#: Objects that a user does not make: the verb whose example shows each.
MADE_BY_A_VERB = {
    "Calibration": "calibrate",
    "Comparison": "compare",
    "DataCheck": "check",
    "DataSet": "simulate",
    "Diagnosis": "diagnose",
    "LiveTouch": "Reader",
    "LogDensity": "log_density",
    "NextTouches": "next_touches",
    "RankStatistics": "sbc",
    "Report": "report",
    "SimulatedDataSet": "simulate",
    "TouchPosteriors": "infer",
    "Touches": "simulate",
}


@pytest.mark.parametrize(("name", "verb"), MADE_BY_A_VERB.items())
def test_example_of_a_result_shows_the_verb_that_makes_it(name: str, verb: str) -> None:
    assert f"bayestouch.{verb}(" in sections(name)["Examples"]


@pytest.mark.parametrize("name", FUNCTIONS)
def test_function_explains_arguments_result_and_errors(name: str) -> None:
    signature = inspect.signature(getattr(bayestouch, name))
    found = sections(name)
    assert listed(found["Parameters"]) == set(signature.parameters)
    assert ("Returns" in found) == (signature.return_annotation not in (None, "None"))
    assert ("Raises" in found) == (name not in RAISES_NOTHING)


@pytest.mark.parametrize("name", DATA)
def test_class_explains_its_fields(name: str) -> None:
    found = sections(name)
    fields = {field.name for field in dataclasses.fields(getattr(bayestouch, name))}
    assert fields <= listed(found.get("Parameters", "") + found.get("Attributes", ""))


def test_sections_and_their_names_are_found() -> None:
    assert {"Parameters", "Returns", "Raises", "Examples"} <= set(sections("simulate"))
    assert listed("first, second : DataSet\n    Two, of a kind.\nseed, draws\n    As in x.\n") == {
        *("first", "second", "seed", "draws")
    }
