"""Between which radii tips are distinguished from a knife edge and from a flat."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from bayestouch.reporting.finger.radii import _told_from_ends, radius_limits


def limits(edge: list[float | None], flat: list[float | None]) -> dict[str, Any]:
    tips = [1.0, 3.0, 9.0]
    return radius_limits(
        [
            {"r_c_mm": r, "told_from_edge_percent": a, "told_from_flat_percent": b}
            for r, a, b in zip([0.0, *tips, np.inf], [None, *edge, None], [None, *flat, None], strict=True)
        ]
    )


def test_radius_limits_hold_for_every_tip_beyond() -> None:
    found = limits([80.0, 96.0, 100.0], [100.0, 99.0, 40.0])
    assert (found["told_from_edge_r_c_mm"], found["told_from_flat_r_c_mm"]) == (3.0, 3.0)
    # A tip that fails between two that pass ends the range on its far side.
    assert limits([100.0, 90.0, 100.0], [100.0, 90.0, 100.0])["told_from_edge_r_c_mm"] == 9.0
    assert limits([100.0, 90.0, 100.0], [100.0, 90.0, 100.0])["told_from_flat_r_c_mm"] == 1.0
    nothing = limits([100.0, 100.0, 94.0], [0.0, 0.0, 0.0])
    assert nothing["told_from_edge_r_c_mm"] is None and nothing["told_from_edge_tried"]
    # What is said of a limit that there is not: whether any tip reaches it.
    assert nothing["told_from_edge_some"] and not nothing["told_from_flat_some"]
    assert not limits([None] * 3, [None] * 3)["told_from_flat_tried"]


def test_told_from_ends() -> None:
    radius = np.repeat([0.0, 3.0, np.inf], 100)
    mean = np.r_[np.linspace(0, 1, 100), np.linspace(0.9, 2.0, 100), np.linspace(11, 12, 100)]
    edge, flat = _told_from_ends(mean, radius)
    # The 95 % quantile of the edges is 0.95: of 0.9 … 2.0 in 100 steps, 95 lie above it.
    assert edge == {3.0: pytest.approx(95.0)}
    assert flat == {3.0: 100.0}
    assert _told_from_ends(mean[100:], radius[100:])[0] == {}
