"""Touches simulated with an effect at a known value, read by a calibration that was fitted with it, are not biased.

What a calibration with effects does when the touches are unknown: the inverse of what it does when they are known.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from finger_cases import CASES, Case, recovered

import bayestouch
from bayestouch.results.objects import Calibration

#: By how many of their sds touches would be off, on average or as root mean square, if the effect were left out.
BIASED = {"prober_eccentricity": "theta_c", "load_offset": "P", "load_misalignment": "P"}

#: Read in the suite that must be quick: one sign of those that change the pose, the load or go with time.
QUICK = ("prober_eccentricity", "load_offset", "load_misalignment", "gain_nonlinearity", "creep", "memory")
#: One sign of each; values of both signs are in `test_recovered_values.py`.
FIRST = {case.name: case for case in reversed(CASES)}
READ = [
    case if case is FIRST[case.name] and case.name in QUICK else pytest.param(case, marks=pytest.mark.slow)
    for case in FIRST.values()
]


def scores(case: Case, folder: Path, calibration: Calibration | None = None) -> dict[str, np.ndarray]:
    """(mean - truth) over sd of the location and the load of every touch to be read."""
    found = recovered(case, 1, folder)
    recording = found.simulated.recording
    rows = slice(recording.parts[0], recording.parts[0] + recording.parts[1])
    # A force sensor that reads well would hide what an effect does to loads that are told from the readings.
    of_the_load = case.name.startswith("load_")
    read = bayestouch.infer(
        found.data.touches, calibration or found.calibration, use_load=of_the_load, draws=128, workers=1
    )
    truth = {"theta_c": recording.press.angle[rows], "P": recording.press.load[rows]}
    return {name: (read.mean(name) - true) / read.sd(name) for name, true in truth.items()}


@pytest.mark.slow
@pytest.mark.parametrize("case", READ, ids=lambda case: case.key)
def test_touches_are_read_without_bias(case: Case, workers_folder: Path) -> None:
    for name, z in scores(case, workers_folder).items():
        # The calibration's error is one for all touches: their mean is one standard normal variable, or less.
        assert abs(z.mean()) < 4, (name, z.mean())
        # What scatters beside it has at most the stated sd; that of 105 touches is known to 7 %, of draws to 6 %.
        assert z.std() < 1 + 4 * np.hypot(0.07, 0.06 / np.sqrt(105)), (name, z.std())


@pytest.mark.slow
@pytest.mark.parametrize("case", [each for each in CASES if each.name in BIASED], ids=lambda case: case.key)
def test_left_out_the_same_effects_bias_them(case: Case, workers_folder: Path) -> None:
    """So that the test above would see a wrong sign, which doubles this."""
    found = recovered(case, 1, workers_folder)
    plain = bayestouch.calibrate(found.data, draws=64)
    z = scores(case, workers_folder, plain)[BIASED[case.name]]
    # An error with mean zero over the elements hardly changes the mean. Touches read with the effect have at most 1.3.
    assert np.sqrt(np.mean(z**2)) > 4
