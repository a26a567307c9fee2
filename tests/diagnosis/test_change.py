"""What each touch contributes to the errors of a diagnosis, by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayestouch.diagnosis.change import _of_lack, standard_errors
from bayestouch.effects.random import GainDrift


@pytest.mark.parametrize(("freedom", "expected"), [(4.0, [5 * 3 / 4, 9 * 3 / 4, 0.0]), (0.5, [np.nan] * 3)])
def test_contributions_of_touches_to_the_lack_of_fit(freedom: float, expected: list[float]) -> None:
    """Squares of three touches over the freedom, so that their mean is the lack of fit: 14/4; unknown with none."""
    whitened = np.array([[1.0, 2.0], [3.0, 0.0], [0.0, 0.0]])
    held: Any = SimpleNamespace(observed=SimpleNamespace(n_touches=3), whitened=whitened, freedom=freedom)
    np.testing.assert_allclose(_of_lack(held), expected)


@pytest.mark.parametrize(("time", "blocks"), [(400.0, 1), (30.0, 8)])
def test_loads_that_share_a_drift_have_the_standard_error_of_its_draws(time: float, blocks: int) -> None:
    """One draw is as uncertain as it is large, so that no change is beyond two of them; eight have a mean."""
    rng = np.random.default_rng(5)
    first, last = (size + rng.normal(0.0, 0.5, 64) for size in (3.0, 7.0))

    def model(error: np.ndarray, own: float) -> Any:
        observed = SimpleNamespace(touch_time_s=np.linspace(0.0, 480.0, 64, endpoint=False))
        read = SimpleNamespace(by_touch={"P_rms_N_per_m": error})
        fitted = SimpleNamespace(drifts=((GainDrift(()), (0.05, time, own)),))
        return SimpleNamespace(held_out=SimpleNamespace(observed=observed), held_stated=None, read=read, fitted=fitted)

    change = [each**2 / (2 * np.sqrt(np.mean(each**2))) for each in (first, last)]
    difference = change[1] - change[0]
    found = standard_errors(model(first, 0.0), model(last, 0.0))["P_rms_N_per_m"]
    means = difference.reshape(blocks, -1).mean(axis=1)
    change_of_rms = np.sqrt(np.mean(last**2)) - np.sqrt(np.mean(first**2))
    expected = change_of_rms if blocks == 1 else means.std(ddof=1) / np.sqrt(blocks)
    assert found == pytest.approx(expected)
    each_own = standard_errors(model(first, 1.0), model(last, 1.0))["P_rms_N_per_m"]
    assert each_own == pytest.approx(difference.std(ddof=1) / 8)
