"""The object that a diagnosis returns."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from bayestouch.diagnosis.result import Diagnosis


def test_a_diagnosis_can_be_a_key() -> None:
    """It holds mappings and arrays, which have no hash: it counts as itself, whatever another one contains."""
    part: Any = SimpleNamespace()
    one, other = (Diagnosis({"verdict": "adequate"}, part, part, {}, part) for _ in range(2))
    assert {one: 1, other: 2}[one] == 1


def test_causes_by_name() -> None:
    part: Any = SimpleNamespace()
    causes = [{"names": ["a", "b"], "probability": 0.75}, {"names": ["nothing"], "probability": 0.25}]
    assert Diagnosis({"causes": causes}, part, part, {}, part).causes == {("a", "b"): 0.75, ("nothing",): 0.25}
