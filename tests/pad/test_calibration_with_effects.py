"""Notes of the calibration of a pad with effects."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from bayestouch.pad.calibration_with_effects import _notes


@pytest.mark.parametrize(
    ("left", "said"),
    [
        ((), []),
        (
            ("tilt", "gain_map"),
            ["tilt and gain_map: left to the empirical map, as it goes with the location"],
        ),
    ],
)
def test_effects_that_are_left_to_the_map_are_named(left: tuple[str, ...], said: list[str]) -> None:
    effects: Any = SimpleNamespace(left_to_map=left, listed=SimpleNamespace(drifts=()))
    assert _notes(effects) == said
