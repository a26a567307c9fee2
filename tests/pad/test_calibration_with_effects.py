"""Notes of the calibration of a pad with effects."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from pad_simulation import line

import bayestouch
from bayestouch.data.touches import touches_from
from bayestouch.pad.calibration_with_effects import _notes
from bayestouch.pad.corrected import PadEffects
from bayestouch.pad.reading.reader import PadReader


@pytest.mark.parametrize(
    ("left", "said"),
    [
        ((), []),
        (
            ("tilt", "gain_map"),
            ["tilt and gain_map: left to the empirical map, as it goes with the location"],
        ),
    ],
)
def test_effects_that_are_left_to_the_map_are_named(left: tuple[str, ...], said: list[str]) -> None:
    effects: Any = SimpleNamespace(left_to_map=left, listed=SimpleNamespace(drifts=()))
    assert _notes(effects) == said


@pytest.mark.slow
def test_noise_of_the_force_sensor_is_one_of_the_load_as_read() -> None:
    """A channel whose response flattens: what a load of the calibration, and one that is read, is uncertain by."""
    rng, pad = np.random.default_rng(2), line()
    x, load = rng.uniform(6.0, 32.0, 240), rng.uniform(0.5, 6.0, 240)
    clean = pad.chain.predict(x[:, None], load / (1 + 0.4 * load))
    table = touches_from(np.arange(240), clean + 0.02 * rng.standard_normal(clean.shape), x_mm=x, load=load)
    dataset = replace(pad.dataset(table), sensor=replace(pad.sensor, force_noise_sd=0.02))
    made = bayestouch.diagnose(replace(dataset, calibration=None), kernel="gaussian").calibration_after
    effects = PadEffects.of(made)
    assert effects is not None and [e.name for e in effects.listed.effects] == ["load_nonlinearity"]
    reader = PadReader.from_calibration(made)
    step = 1e-3
    for read in (1.0, 5.5):
        up, down = effects.acting(np.array([read + step, read - step]))
        acting, slope = effects.acting(np.array([read])), (up - down) / (2 * step)
        assert reader.measured_load_sd(acting, np.ones(1)) == pytest.approx(0.02 * slope, rel=0.02)
