"""Which samples of a touch on a pad count."""

from __future__ import annotations

import numpy as np
import pytest

from bayestouch.data.touches import touches_from
from bayestouch.pad.known_touches import choose_samples


@pytest.mark.parametrize("silent", [0.0, np.nan])
def test_an_element_without_a_signal_hides_no_creep(silent: float) -> None:
    """Two elements gain 5 % from the first sample to the last: 0.05/1.025 of their mean signal, 4.88 %."""
    creeping = np.repeat(np.linspace(100, 200, 10), 2) * np.tile([1.0, 1.05], 10)
    readings = np.stack([creeping, 2 * creeping, np.full(20, silent)], axis=1)
    touch, sample = np.repeat(np.arange(10), 2), np.tile([0, 1], 10)
    touches = touches_from(touch, readings, sample=sample, x_mm=np.repeat(np.arange(10.0), 2), load=1.0)
    samples, why = choose_samples(touches)
    assert samples == "first"
    assert "+4.88%" in why and "nan" not in why
