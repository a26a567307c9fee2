"""Files of a diagnosis: the model that later calibrations use."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from bayestouch.diagnosis.writing import model_text
from bayestouch.effects.stated import StatedModel


def traced(used: tuple[str, ...], correction: object) -> Any:
    """Creep and memory were found, and a correction was fitted; the model that is returned has what is used."""

    def added(name: str, value: float) -> SimpleNamespace:
        parameter = SimpleNamespace(name=f"{name}_time")
        return SimpleNamespace(effect=SimpleNamespace(name=name, parameters=(parameter,)), values=(value,))

    return SimpleNamespace(
        data=SimpleNamespace(dataset=SimpleNamespace(sensor=SimpleNamespace(body=SimpleNamespace(kind="finger")))),
        added=(added("creep", 2.5), added("memory", 7.0)),
        after=SimpleNamespace(fitted=SimpleNamespace(names=used), correction=correction),
        corrected=SimpleNamespace(),
    )


@pytest.mark.parametrize("correction", [None, SimpleNamespace()])
def test_the_model_is_that_of_the_calibration_that_is_returned(correction: object) -> None:
    text = model_text(traced(("creep",), correction), "layer")
    found = StatedModel.from_toml(text)
    assert found.effects == (("creep", {"creep_time": 2.5}),)
    assert found.correction == (correction is not None)
    assert text.endswith("\n# Found too, and not used for reading, see not_used in diagnosis.json: memory.\n")


def test_nothing_is_said_where_all_that_was_found_is_used() -> None:
    text = model_text(traced(("creep", "memory"), None), "layer")
    assert [name for name, _ in StatedModel.from_toml(text).effects] == ["creep", "memory"]
    assert "Found too" not in text
    none = model_text(traced((), None), "layer")
    assert StatedModel.from_toml(none) == StatedModel("finger", "layer", ())
    assert none.endswith("diagnosis.json: creep, memory.\n")
