"""What a finger cannot be calibrated from is said, and the check goes on."""

from __future__ import annotations

from dataclasses import replace

from known_fingers import dataset, known_touches

import bayestouch


def test_a_finger_with_all_touches_at_one_place_cannot_be_divided() -> None:
    """Without a calibration table the touches are divided by place into those that calibrate and the others."""
    whole = known_touches(1, step=3.0)
    one = whole.select(whole.angle_deg == whole.angle_deg[0])
    advice = bayestouch.check(replace(dataset(one), calibration=None)).facts["advice"]
    assert (
        "cannot be calibrated: all touches are in one cell: nothing is left to be held out (give calibration.csv)"
        in advice
    )
    assert "cannot be calibrated" not in " ".join(
        bayestouch.check(replace(dataset(whole), calibration=None)).facts["advice"]
    )
