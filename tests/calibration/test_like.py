"""What `like` writes into a calibration."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from known_fingers import dataset, known_touches

import bayestouch
from bayestouch.calibration.like import LikeEarlier


@pytest.fixture(scope="module")
def calibration() -> bayestouch.Calibration:
    return bayestouch.calibrate(dataset(known_touches(1)), draws=400)


def test_names_and_notes(calibration: bayestouch.Calibration) -> None:
    noted = LikeEarlier({}, ("a.nc", "b.nc"), ("What was learned.",)).noted(calibration)
    assert noted.settings["like"] == "a.nc, b.nc"
    assert noted.notes == (*calibration.notes, "What was learned.")
    assert LikeEarlier({}).noted(calibration) is calibration


def test_chains_that_disagree_are_noted(calibration: bayestouch.Calibration) -> None:
    """Touches against learned priors."""
    stuck = replace(calibration, statistics={**calibration.statistics, "rhat": 1.4})
    assert "R-hat is 1.40" in LikeEarlier({}, ("a.nc",)).noted(stuck).notes[-1]


@pytest.mark.parametrize("like", ["earlier.nc", Path("earlier.nc"), ["earlier.nc"], (Path("earlier.nc"),), "itself"])
def test_one_earlier_calibration_needs_no_list(
    like: Any, calibration: bayestouch.Calibration, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By its path or as an object."""
    seen: list[Any] = []

    def of(body: Any, options: Any, dataset: Any) -> Any:
        seen.extend(options["like"])
        raise bayestouch.InputError("seen")

    monkeypatch.setattr(LikeEarlier, "of", of)
    given = calibration if like == "itself" else like
    with pytest.raises(bayestouch.InputError, match="seen"):
        bayestouch.calibrate(dataset(known_touches(2)), like=given, draws=8)
    assert seen == [calibration] if like == "itself" else [str(each) for each in seen] == ["earlier.nc"]


def test_what_is_no_calibration_is_refused() -> None:
    with pytest.raises(bayestouch.InputError) as error:
        bayestouch.calibrate(dataset(known_touches(2)), like=[3], draws=8)  # type: ignore[list-item]
    assert str(error.value) == (
        "expected a list of calibrations or their paths, got int; bayestouch.load reads a calibration"
    )
