"""Errors of held-out touches that regressions read."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from report_cases import LINE

from bayestouch.baselines import HeldOutBaseline, Regression, RegressionPosteriors, RegressionTouches, baselines
from bayestouch.baselines.reading import _of_location
from bayestouch.model.split_data import SplitData
from bayestouch.simulation import simulate


def test_errors_are_those_of_the_posteriors() -> None:
    location = np.array([[1.0, 2.0], [5.0, 6.0]])
    residual = np.array([[0.03, np.nan], [0.04, 0.01]])
    read = RegressionPosteriors(
        residual=residual,
        location=location + np.array([[3.0, 4.0], [0.0, 0.0]]),
        location_sd=np.ones((2, 2)),
        location_inside=np.array([False, True]),
        load=np.array([1.3, 2.4]),
        load_sd=np.ones(2),
        load_interval=np.array([[0.9, 1.1], [2.1, 2.5]]),
    )
    held = RegressionTouches(location, np.array([1.0, 2.0]), np.zeros((2, 2)))
    errors = HeldOutBaseline(Regression("none", (), 0.0), held, read, 2 * residual).errors
    assert errors == pytest.approx(
        {
            # The rms of 3 and 4 % in one element, 1 % in the other.
            "touch_error_percent_peak": (np.sqrt(12.5) + 1) / 2,
            "prediction_error_percent_peak": np.sqrt(12.5) + 1,
            "location_median_mm": 2.5,
            "location_rms_mm": np.sqrt(12.5),
            "coverage_90": 0.5,
            "P_rms_N": np.sqrt((0.09 + 0.16) / 2),
            "P_coverage_90": 0.5,
        }
    )


@pytest.mark.parametrize("loads", ["measured", "the same", "not all measured"])
def test_loads_are_used_where_they_were_measured_and_differ(loads: str) -> None:
    pytest.importorskip("sklearn", reason="needs the extra `baselines`")
    dataset = simulate(replace(LINE, n_touches=40), seed=7).dataset
    assert dataset.calibration is not None
    calibration, touches = dataset.calibration, dataset.touches
    if loads == "the same":
        tables = [each.with_(load=np.where(np.isfinite(each.load), 1.0, np.nan)) for each in (calibration, touches)]
        calibration, touches = tables
    if loads == "not all measured":
        # Every other touch is held out, the second one among them.
        touches = touches.with_(load=np.where(touches.touch == np.unique(touches.touch)[1], np.nan, touches.load))
    data = SplitData.of(replace(dataset, calibration=calibration, touches=touches))
    held_out = data.observations(data.held_out)
    found = baselines(data, held_out, np.nanmax(data.table.readings, axis=0))
    assert [each.regression.name for each in found] == ["Gaussian process", "polynomial"]
    for each in found:
        errors = each.errors
        assert np.isfinite([errors["location_rms_mm"], errors["prediction_error_percent_peak"]]).all()
        assert np.isfinite([errors["P_rms_N"], errors["P_coverage_90"]]).all() == (loads == "measured")
        assert len(each.samples) == 2 * len(each.read.residual)


def test_a_place_beyond_those_of_the_prior_is_in_no_region() -> None:
    """All of the posterior is at the last place, 20 mm; the touches were at 20 and 30 mm."""
    axis = np.linspace(0.0, 20.0, 21)
    log_density = np.full((2, 21), -1e3)
    log_density[:, -1] = 0.0
    mean, _, inside = _of_location(log_density, np.zeros(2), axis[:, None], [axis], np.array([[20.0], [30.0]]))
    assert mean.ravel().tolist() == [20.0, 20.0] and inside.tolist() == [True, False]
