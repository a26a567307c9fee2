"""Pads with effects: their elements are checked before touches are read, and several processes read them."""

from __future__ import annotations

import numpy as np
import pytest

import bayestouch
from bayestouch.effects.stated import StatedModel

CREEP = StatedModel("pad", "", (("creep", {}),))


@pytest.fixture(scope="module")
def simulated() -> bayestouch.DataSet:
    design = bayestouch.PadDesign(samples_per_touch=6, n_touches=600)
    return bayestouch.simulate(design, effects={"creep": 0.2}, seed=6).dataset


@pytest.fixture(scope="module")
def calibration(simulated: bayestouch.DataSet) -> bayestouch.Calibration:
    return bayestouch.calibrate(simulated, model=CREEP, draws=64, seed=1)


@pytest.mark.slow
def test_a_dead_element_of_a_pad_with_effects_is_found(
    simulated: bayestouch.DataSet, calibration: bayestouch.Calibration
) -> None:
    """Element 3 reads noise alone: the touches are read without it, and their errors stay what they say."""
    some = simulated.touches.select(simulated.touches.touch < 120)
    readings = some.readings.copy()
    readings[:, 2] = np.random.default_rng(1).normal(0.0, 10.0, len(readings))
    read = bayestouch.infer(some.with_(readings=readings), calibration, draws=256, seed=1)
    assert any("e03" in note for note in read.notes)
    error = np.concatenate([(read.mean(axis) - read.reference[axis]) / read.sd(axis) for axis in ("x", "y")])
    # mean square of 240 errors that are normal: 1 ± 0.09, four times; near the dead element they are less normal
    assert np.mean(error**2) < 1.5
    sound = bayestouch.infer(some, calibration, draws=256, seed=1)
    assert not any("e03" in note for note in sound.notes)


@pytest.mark.slow
def test_the_number_of_processes_changes_nothing(
    simulated: bayestouch.DataSet, calibration: bayestouch.Calibration
) -> None:
    """600 touches are three windows: one process draws them one after the other, two side by side."""
    one, two = (
        bayestouch.infer(simulated.touches, calibration, draws=64, seed=1, workers=workers) for workers in (1, 2)
    )
    for name in ("x", "y", "P"):
        np.testing.assert_array_equal(one.posterior[name], two.posterior[name])
    for name, values in one.sample_stats.items():
        np.testing.assert_array_equal(values, two.sample_stats[name])
