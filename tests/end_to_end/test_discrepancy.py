"""The option of `calibrate` that says what a finger's readings may miss the model by."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from place_cases import MAP, NOTHING, missed_data, missed_finger, touches

import bayestouch
from bayestouch.data.touches import touches_from
from bayestouch.errors import InputError
from bayestouch.results.objects import Calibration
from bayestouch.results.reading import load_calibration


@cache
def calibrated(missed: object, discrepancy: str | None) -> Calibration:
    return bayestouch.calibrate(missed_data(missed), discrepancy=discrepancy, draws=200, seed=1)


def test_the_default_is_that_of_a_touch_where_nothing_is_missed() -> None:
    one, other = calibrated(NOTHING, None), calibrated(NOTHING, "touch")
    assert one.notes == other.notes
    assert one.extra.keys() == other.extra.keys()
    np.testing.assert_array_equal(one.posterior["discrepancy_sd"], other.posterior["discrepancy_sd"])


def test_none_leaves_no_room_for_a_discrepancy() -> None:
    calibration = calibrated(NOTHING, "none")
    assert not calibration.noise.discrepancy_sd.any()
    assert "discrepancy_sd" not in calibration.posterior
    assert "discrepancy_sd" not in [parameter.name for parameter in calibration.parameters]


def test_functions_of_place_are_chosen_and_said() -> None:
    calibration, before = calibrated(MAP, None), calibrated(MAP, "touch")
    assert any("function of place" in note and "E map" in note for note in calibration.notes)
    assert not any("function of place" in note for note in before.notes)
    assert (calibration.noise.discrepancy_sd < 0.2 * before.noise.discrepancy_sd).all()
    # what the model lacks is still said, so that a cause is looked for
    assert calibration.statistics["lack_of_fit"] == before.statistics["lack_of_fit"] > 5
    assert calibration.statistics["lack_of_fit_of_place"] < 1.3


def test_touches_are_read_better_and_intervals_hold(tmp_path: Path) -> None:
    """Intervals of R hold as often as they should, and errors are those of the noise."""
    truth = touches(120)
    clean = missed_finger(MAP).predict(*truth)  # type: ignore[attr-defined]
    rng = np.random.default_rng(5)
    touch = np.repeat(np.arange(120), 4)
    readings = clean[touch] + 8.0 * rng.standard_normal((480, clean.shape[1]))
    table = touches_from(touch, readings, load=truth[2][touch] + rng.standard_normal(480), contact=1.0)
    calibrated(MAP, None).save(tmp_path / "calibration.nc")
    errors = {}
    for name, calibration in (
        ("after", load_calibration(tmp_path / "calibration.nc")),
        ("before", calibrated(MAP, "touch")),
    ):
        read = bayestouch.infer(table, calibration, check_sensor=False)
        errors[name] = np.sqrt(np.mean((read.mean("R") - truth[0]) ** 2))
        if name == "after":
            z = (read.mean("R") - truth[0]) / read.sd("R")
            low, high = read.interval("R", 0.9)
            # 120 touches: a standard error of 2.7 %, and of 0.065; functions are shared by neighbours
            assert 0.81 < np.mean((low <= truth[0]) & (truth[0] <= high)) < 0.98
            assert 0.8 < np.sqrt(np.mean(z**2)) < 1.25
    assert errors["after"] < 0.7 * errors["before"]


def test_groups_hold_the_functions() -> None:
    calibration = bayestouch.calibrate(
        missed_data(MAP), draws=200, seed=1, groups=["posterior_predictive", "log_likelihood"]
    )
    again = calibration.groups["posterior_predictive"]["reading"]
    z = (calibration.rows.observed - again.mean(axis=(0, 1))) / again.std(axis=(0, 1))
    # the readings took part in the fit, so that they are a little nearer than new ones would be
    assert 0.75 < np.sqrt(np.mean(z**2)) < 1.05
    by_touch = calibration.groups["log_likelihood"]["whole_touch"].mean(axis=(0, 1))
    m = again.shape[-1]
    expected = -0.5 * m * (1 + np.log(2 * np.pi * (8.0 / 2) ** 2))
    assert abs(by_touch.mean() - expected) < 0.1 * m


def test_with_effects_it_is_independent_from_touch_to_touch() -> None:
    model = bayestouch.effects.StatedModel(body="finger", contact="layer", effects=(("crosstalk", {}),))
    with pytest.raises(InputError, match="discrepancy"):
        bayestouch.calibrate(missed_data(NOTHING), model=model, discrepancy="place")


def test_functions_that_cannot_be_had_are_refused() -> None:
    """An identified E map has none; and so few places that none could be held out."""
    with pytest.raises(InputError, match="E map of the model"):
        bayestouch.calibrate(missed_data(MAP), discrepancy="place", e_map="empirical", draws=200)
    data = missed_data(MAP)
    assert data.calibration is not None
    few = data.calibration.select(np.isin(data.calibration.angle_deg, np.unique(data.calibration.angle_deg)[::4]))
    assert 4 < len(np.unique(few.angle_deg)) < 18
    with pytest.raises(InputError, match="18 places"):
        bayestouch.calibrate(replace(data, calibration=few), discrepancy="place", draws=200)


def test_its_density_is_that_which_was_drawn_from() -> None:
    """`log_density` at the draws differs from the log density of the chains by a constant."""
    calibration = calibrated(MAP, None)
    density = bayestouch.log_density(calibration, missed_data(MAP))
    draws = {name: values[0, :12] for name, values in calibration.posterior.items()}
    found = density(density.coordinates(draws)) - calibration.groups["sample_stats"]["lp"][0, :12]
    np.testing.assert_allclose(found, found.mean(), atol=1e-6)


def test_no_discrepancy_has_no_density_as_a_function() -> None:
    with pytest.raises(InputError, match="none"):
        bayestouch.log_density(calibrated(NOTHING, "none"), missed_data(NOTHING))
