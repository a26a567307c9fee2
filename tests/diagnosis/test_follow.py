"""From the rounds of a search to held-out residuals in their order."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from independent.dataset import EFFECTS, simulate, write
from independent.finger import SMALL

import bayestouch
from bayestouch.data.touches import Touches
from bayestouch.diagnosis.follow import _steps


def test_held_out_residuals_at_the_beginning_of_each_round() -> None:
    """Before, at each round between, and with all that was found."""
    evaluate: Any = SimpleNamespace(held_out=lambda fitted, correction: f"held {fitted}")
    before: Any = "first"
    after: Any = "last"
    rounds = tuple(SimpleNamespace(before=k) for k in range(4))
    for n, wanted in ((1, ("first",)), (2, ("first", "last")), (4, ("first", "held 1", "held 2", "last"))):
        assert _steps(rounds[:n], evaluate, before, after) == wanted  # type: ignore[arg-type]
    assert _steps(rounds[:2], evaluate, None, None) == ()  # type: ignore[arg-type]


def test_noise_alone_is_what_an_explained_finger_has(tmp_path: Path) -> None:
    """A soft spot, and loads stated once a touch with a noise of 1 N/m, of which the first fit makes 11.

    With the effect the noise of the loads is near the true one, so that error, noise alone and lack of fit agree.
    """
    simulated = simulate(SMALL, [(EFFECTS["soft_spot: raised cosine"], 2.0)], 1)
    data = bayestouch.load_dataset(write(simulated, tmp_path / "finger"))

    def once(table: Touches) -> Touches:
        first = np.unique(table.touch, return_index=True, return_inverse=True)
        return table.with_(load=table.load[first[1]][first[2]])

    assert data.calibration is not None
    data = replace(data, calibration=once(data.calibration), touches=once(data.touches))
    found = bayestouch.diagnose(data, draws=8, sample=False)
    floor, after = found.numbers["noise_floor_percent_peak"], found.numbers["after"]
    # 80 touches of 8 elements: a standard error of 6 % of each.
    assert 0.85 < after["prediction_error_percent_peak"] / floor < 1.15
    assert found.verdict == "explained" and 0.85 < after["lack_of_fit"] < 1.15
