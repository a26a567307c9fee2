"""When the choice of the kernel of a pad is uncertain."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayestouch.pad.choice import CLEARLY_BETTER
from bayestouch.pad.tied import note_on_tie


def model(reads: float, score: float, *, error: float = 1.0, has_map: bool = False, parameters: tuple = ("w",)) -> Any:
    """A pad of two elements that reads 1 times and 10 times as much, wherever it is touched."""
    return SimpleNamespace(
        has_map=has_map,
        kernel=SimpleNamespace(parameters=parameters),
        fit=SimpleNamespace(known=SimpleNamespace(location=np.array([[0.0, 1.0], [4.0, 3.0]]))),
        sensitivity=lambda points: reads * np.ones((len(points), 1)) * [1.0, 10.0],
        score=score,
        error_percent=error,
    )


@pytest.mark.parametrize("sign", [-1, 1])
def test_kernels_that_predict_as_well_and_differ_are_named(sign: int) -> None:
    """2.1 is 5 % from 2 for both elements, 2.02 is 1 %: no more than the error of the readings."""
    rivals = {
        "layer": model(2.0, 50.0),
        "gaussian": model(2.1, 50.0 + sign * 0.9 * CLEARLY_BETTER),
        "half-space": model(2.3, 50.0 + sign * 1.1 * CLEARLY_BETTER),
        "layer-line": model(2.0199, 50.0),
        "layer with map": model(2.4, 50.0, has_map=True),
        "map alone": model(2.4, 50.0, has_map=True, parameters=()),
    }
    note = note_on_tie("layer", rivals["layer"], rivals)
    assert "between the kernels layer and gaussian, which differ by up to 5.0 % of the peak" in note
    assert not note_on_tie("layer", model(2.0, 50.0, error=5.1), rivals)
    assert not note_on_tie("layer with map", rivals["layer with map"], rivals)
