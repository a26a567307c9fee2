"""Settings of the chains that sample a finger's calibration."""

from __future__ import annotations

from bayestouch.finger.sampling import THIN
from bayestouch.sampling.attempts import CHAINS


def test_steps_for_each_draw_that_is_kept() -> None:
    """Four chains, longer each time: four times as many steps, then three; other numbers give other draws."""
    assert CHAINS == 4
    assert THIN == (4, 4 * 4, 3 * 4 * 4)
