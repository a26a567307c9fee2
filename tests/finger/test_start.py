"""A calibration has one posterior, whichever verb asks for it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import bayestouch
from bayestouch.effects import StatedModel
from bayestouch.finger.beginning import begin
from bayestouch.finger.model import finger_model
from bayestouch.finger.start import finger_start
from bayestouch.model.split_data import SplitData
from bayestouch.priors.parameters import Normal, Prior
from bayestouch.results.objects import Calibration
from bayestouch.simulation import FingerDesign, simulate

DESIGN = FingerDesign(n_elements=5, samples_per_touch=3, edge_step_deg=5.0, flat_step_deg=10.0, touch_step_deg=10.0)


def assert_same(one: Calibration, other: Calibration) -> None:
    """To the bit, but for notes and for how the touches are numbered."""
    assert set(one.posterior) == set(other.posterior)
    for name in one.posterior:
        np.testing.assert_array_equal(one.posterior[name], other.posterior[name])
        np.testing.assert_array_equal(one.mode[name], other.mode[name])
    np.testing.assert_array_equal(one.covariance, other.covariance)
    np.testing.assert_array_equal(one.noise.discrepancy_sd, other.noise.discrepancy_sd)
    np.testing.assert_array_equal(one.rows.predicted, other.rows.predicted)
    assert one.settings == other.settings and one.statistics == other.statistics


@pytest.mark.parametrize("stated", [{}, {"sigma": Normal(0.45, 0.004)}], ids=["default priors", "a stated prior"])
def test_the_calibration_before_a_diagnosis_is_that_of_calibrate(stated: dict[str, Prior]) -> None:
    """For the touches that the diagnosis does not hold out, draw by draw."""
    dataset = simulate(DESIGN, effects={"crosstalk": 0.05}, seed=2).dataset
    data = SplitData.of(dataset)
    begun = begin(data, contact="layer", draws=200, seed=4, priors=stated)
    before = begun.evaluation.calibration(begun.fitted, (), None)
    training = data.table.select(data.training & data.table.in_contact)
    same = bayestouch.calibrate(replace(dataset, calibration=training), draws=200, seed=4, priors=stated)
    assert_same(before, same)
    assert before.statistics["ess_bulk"] > 80  # four chains of emcee, not a normal approximation


def test_a_stated_model_without_effects_is_a_calibration_without_model() -> None:
    dataset = simulate(DESIGN, seed=2).dataset
    plain = bayestouch.calibrate(dataset, draws=64, seed=4, contact="hertz")
    stated = bayestouch.calibrate(dataset, model=StatedModel("finger", "hertz", ()), draws=64, seed=4)
    assert_same(plain, stated)
    assert plain.notes == stated.notes
    other = bayestouch.calibrate(dataset, model=StatedModel("finger", "hertz", ()), contact="layer", draws=64, seed=4)
    assert other.settings["contact"] == "layer"


def test_loads_that_were_not_measured_are_those_of_the_fit_before() -> None:
    """Loads of 60 to 340 N/m, half of them not measured, do not add to the lack of fit of the calibration.

    At the mean load contacts are too wide or too narrow, which added a fifth.
    """
    dataset = simulate(replace(DESIGN, load_range=(60.0, 340.0)), seed=2).dataset
    table = dataset.calibration
    assert table is not None
    blank = replace(dataset, calibration=table.with_(load=np.where(table.touch % 2 == 0, np.nan, table.load)))
    split = SplitData.of_calibration(blank)
    start = finger_start(split.observations(split.training), blank.sensor, "layer")
    model = finger_model(start.fitted.model)
    np.testing.assert_array_equal(model.load, start.calibrated.likelihood.known.load)
    measured = np.isfinite(model.observed.load)
    assert 0 < measured.sum() < measured.size
    np.testing.assert_array_equal(model.load[measured], model.observed.load[measured])
    # Both fits have the noise of repeats, and the same touches.
    ratio = start.fitted.chi_square() / (start.fitted.n_readings - model.n_base)
    assert ratio == pytest.approx(start.calibrated.lack_of_fit, rel=1e-3)
    # Other touches have loads of their own.
    other = model.observing(model.observed)
    np.testing.assert_allclose(other.load[~measured], model.observed.load[measured].mean())
