"""What a finger cannot be calibrated from is said, and the check goes on."""

from __future__ import annotations

from dataclasses import replace

import pytest
from known_fingers import dataset, known_touches

import bayestouch
from bayestouch.data.finger import Finger
from bayestouch.finger.lacking import _units


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


@pytest.mark.parametrize(
    ("scale", "turn", "said"),
    [
        (1.0, 1.0, []),
        (1e-3, 1.0, ["outer_radius_mm is 0.0115: is it in metres?; state all lengths in mm"]),
        (
            1.0,
            0.0174533,
            ["all element_angles_deg are within ±1.15: are they in radians?; state all angles in degrees"],
        ),
        # Pitches of 0.3 mm on rubber of 3.5 mm, within less than six degrees, are fine.
        (1.0, 0.045, []),
    ],
)
def test_units_with_which_no_finger_is_built(scale: float, turn: float, said: list[str]) -> None:
    angles = tuple(turn * angle for angle in (-66.0, -33.0, 0.0, 33.0, 66.0))
    assert list(_units(Finger(8.0 * scale, 11.5 * scale, 8.6 * scale, element_angles_deg=angles))) == said
