"""Which contacts an effect of the contact suits."""

from __future__ import annotations

import pytest

from bayestouch.effects.contact import BluntEdge
from bayestouch.effects.effect import Setting


@pytest.mark.parametrize(
    ("finger", "has_edges", "suits"),
    [(True, True, True), (True, False, False), (False, True, False), (False, False, False)],
)
def test_blunt_edges_are_for_fingers_that_edges_touched(finger: bool, has_edges: bool, suits: bool) -> None:
    setting = Setting(finger, 0, (), (), 1.0, "N/m", "hertz", has_edges, 0.0, 0.0, 0.0)
    assert (BluntEdge.suited(setting) is not None) == suits
