"""Simulation-based calibration: the propagated posterior passes, and what is wrong is caught."""

from __future__ import annotations

import numpy as np
import pytest
from test_finger_calibration import dataset, known_touches

import bayestouch
from bayestouch.errors import InputError
from bayestouch.simulation_checks import BINS, RANKED, rank_statistics

SIMULATIONS = 1000


@pytest.fixture(scope="module")
def calibration() -> bayestouch.Calibration:
    return bayestouch.calibrate(dataset(known_touches(1)), draws=400)


@pytest.mark.parametrize("method", ["emcee", "importance"])
def test_ranks_are_uniform(calibration: bayestouch.Calibration, method: str) -> None:
    """Touches read with an inferred calibration, its uncertainty propagated: 1 % level over three parameters."""
    result = bayestouch.sbc(calibration, simulations=SIMULATIONS, method=method, seed=2)
    assert result.passes(0.01)
    # a share of 0.9 of 1000 touches scatters by 0.0095; four of these
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
