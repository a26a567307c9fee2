"""Simulation-based calibration: the propagated posterior passes, and what is wrong is caught."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_finger_calibration import ANGLES, dataset, known_touches, sensor

import bayestouch
from bayestouch.calibration_checks import CalibrationDesign, check_calibration
from bayestouch.dataset import DataSet
from bayestouch.errors import InputError
from bayestouch.parameters import LogNormal
from bayestouch.ranks import BINS, RANKED, rank_statistics
from bayestouch.sensor import Finger

SIMULATIONS = 500


@pytest.fixture(scope="module")
def calibration() -> bayestouch.Calibration:
    return bayestouch.calibrate(dataset(known_touches(1)), draws=400)


@pytest.mark.parametrize("method", ["emcee", "importance"])
def test_ranks_are_uniform(calibration: bayestouch.Calibration, method: str) -> None:
    """Touches read with an inferred calibration, its uncertainty propagated: 1 % level over three parameters."""
    result = bayestouch.sbc(calibration, simulations=SIMULATIONS, method=method, seed=2)
    assert result.passes(0.01)
    # a share of 0.9 of 500 touches scatters by 0.0134; four of these
    assert all(abs(share - 0.9) < 4 * np.sqrt(0.09 / SIMULATIONS) for share in result.coverage_90.values())


def test_plugging_the_calibration_in_is_caught(calibration: bayestouch.Calibration) -> None:
    """Averages of twenty samples are so exact that the calibration's error shows: intervals of R cover too little."""
    honest = bayestouch.sbc(calibration, simulations=SIMULATIONS, samples=20, seed=3)
    plugged = bayestouch.sbc(calibration, simulations=SIMULATIONS, samples=20, plug_in=True, seed=3)
    assert honest.passes(0.001)
    assert not plugged.passes(0.001)
    assert plugged.coverage_90["R"] < honest.coverage_90["R"] - 0.05


def test_statistic_on_known_ranks() -> None:
    rng = np.random.default_rng(0)
    truth = rng.standard_normal(4000)
    right = rng.standard_normal((4, 250, 4000))
    result = rank_statistics({"x": right, "narrow": 0.7 * right}, {"x": truth, "narrow": truth})
    assert result.p_value["x"] > 1e-3
    assert result.p_value["narrow"] < 1e-6
    assert result.ranks["x"].min() >= 0
    assert result.ranks["x"].max() <= RANKED
    assert (RANKED + 1) % BINS == 0, "bins would not be equally likely"
    figure = result.plot()
    assert len(figure.axes) == 2
    assert all(axis.get_xlabel() for axis in figure.axes)


def test_too_few_simulations_are_refused(calibration: bayestouch.Calibration) -> None:
    with pytest.raises(InputError, match="at least"):
        bayestouch.sbc(calibration, simulations=10)


def small_finger(span: float, step: float, elements: slice) -> DataSet:
    """A finger of a few elements with touches around them, four samples each."""
    touches = known_touches(11, step=step)
    touches = touches.select(np.abs(touches.angle_deg) < span)
    part = touches.with_(readings=touches.readings[:, elements])
    few = replace(sensor(), body=Finger(9.4, 12.7, 9.9, ANGLES[elements]))
    return DataSet(few, part, part, None, ())


def test_a_calibration_that_takes_the_model_to_be_perfect_is_caught() -> None:
    """Three elements, by Hertz, whose contacts are quick. That a right one passes: `studies/sbc_calibration.py`."""
    design = CalibrationDesign.of(small_finger(30.0, 5.0, slice(2, 5)), {}, "hertz", 200, 5)
    perfect = replace(design, priors=replace(design.priors, discrepancy=LogNormal(1e-3, 0.1)))
    often = replace(
        perfect, prior=replace(design.priors, discrepancy=LogNormal(2.0, 0.1)).flat(design.finger, design.known)
    )
    wrong = check_calibration(often, 40, None)
    assert not wrong.passes(0.001), wrong.table()
    assert min(wrong.mean_square[f"response e{e:02d}"] for e in (1, 2, 3)) > 1.5


def test_options_of_the_other_posterior_are_refused(calibration: bayestouch.Calibration) -> None:
    with pytest.raises(InputError, match="options of a calibration's touches"):
        bayestouch.sbc(small_finger(30.0, 5.0, slice(2, 5)), plug_in=True)
    with pytest.raises(InputError, match="options of a data set's calibration"):
        bayestouch.sbc(calibration, priors={"mu": LogNormal(0.1, 0.1)})
