"""What a finger cannot be calibrated from is said, and the check goes on."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from known_fingers import dataset, known_touches

import bayestouch
from bayestouch.data.finger import Finger
from bayestouch.data.touches import Touches
from bayestouch.finger.lacking import FROM_PRIOR, PRIOR_ENOUGH, _units, shear_modulus_from_prior

NOTE = "The touches say little of the shear modulus"


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


def only_two_of_e03(table: Touches) -> Touches:
    """The third element, at -8.8°, was read in the touches at -9° alone: those with the edge and the flat."""
    absent = (np.arange(7) == 2) & (table.angle_deg != -9)[:, None]
    return table.with_(readings=np.where(absent, np.nan, table.readings))


@pytest.mark.parametrize(
    ("some", "why"),
    [
        (
            lambda table: table.select(table.angle_deg <= 0),
            "no calibration touch comes within 15 degrees of element e06",
        ),
        (
            lambda table: table.select(table.angle_deg == 0),
            "no calibration touch comes within 15 degrees of element e01",
        ),
        (only_two_of_e03, "fewer than 3 calibration touches were read by element e03"),
    ],
)
def test_the_check_says_what_the_calibration_will_say(some: Callable[[Touches], Touches], why: str) -> None:
    """Touches on one half of seven elements at -26.4°, -17.6° … 26.4°, at one place, or too few of an element."""
    data = dataset(some(known_touches(1, step=3.0)))
    told = [line for line in bayestouch.check(data).facts["advice"] if line.startswith("cannot be calibrated")]
    assert len(told) == 1 and told[0].startswith(f"cannot be calibrated: {why}")
    with pytest.raises(bayestouch.InputError, match=re.escape(told[0].removeprefix("cannot be calibrated: "))):
        bayestouch.calibrate(data)


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


@pytest.mark.parametrize("flats", [False, True])
def test_edges_alone_leave_the_shear_modulus_to_its_prior(flats: bool) -> None:
    """Readings depend on R and mu by P R/mu, and an edge has R = 0."""
    touches = known_touches(1, step=6.0)
    data = dataset(touches if flats else touches.select(touches.indenter_radius_mm == 0))
    calibration = bayestouch.calibrate(data, discrepancy="touch", draws=400, seed=1)
    said = [note for note in calibration.notes if note.startswith(NOTE)]
    assert len(said) == (not flats)
    # The logarithm of the prior, which is log-normal within a factor of 1.35, has the sd 0.3.
    assert flats or f"{100 * np.log(calibration.posterior['mu']).std():.0f} %" in said[0]
    advice = " ".join(bayestouch.check(data).facts["advice"])
    assert (
        "no flat to calibrate with: it determines the shear modulus, and so the scale of all radii" in advice
    ) != flats


def test_the_limits_of_the_note_on_the_shear_modulus() -> None:
    draws = np.array([-1.0, 1.0])
    assert not list(shear_modulus_from_prior(0.2 * (FROM_PRIOR - 0.01) * draws, 0.2))
    assert list(shear_modulus_from_prior(0.2 * (FROM_PRIOR + 0.01) * draws, 0.2))
    assert not list(shear_modulus_from_prior(0.99 * PRIOR_ENOUGH * draws, 0.99 * PRIOR_ENOUGH))
