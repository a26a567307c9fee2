"""Diagnosis of pads: simulated ones, with effects that the tool is not told of."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pad_simulation import SimulatedPad, line, uneven

import bayestouch
from bayestouch.data.touches import Touches
from bayestouch.effects import Setting, effect_classes
from bayestouch.errors import InputError
from bayestouch.model.effect_list import EffectList
from bayestouch.model.fitting import Fitted
from bayestouch.model.split_data import SplitData, joined_tables
from bayestouch.pad.corrected import STEPS, PadEffects
from bayestouch.pad.model import PadModel
from bayestouch.pad.start import pad_fit
from bayestouch.results.reading import load_calibration


def pressed(pad: SimulatedPad, *, touches: int = 120, seed: int = 0, **how: object) -> Touches:
    """Touches in random order along the line, so that neither time nor load goes with the location."""
    rng = np.random.default_rng(seed)
    return pad.touch(rng.uniform(6.0, 32.0, (touches, 1)), rng, **how)


def diagnosed(pad: SimulatedPad, table: Touches, **options: object) -> bayestouch.Diagnosis:
    """Diagnosis of one table, split by the tool."""
    return bayestouch.diagnose(replace(pad.dataset(table), calibration=None), kernel="gaussian", **options)


@pytest.fixture(scope="module")
def fitted() -> tuple[SplitData, Fitted]:
    pad = line()
    data = SplitData.of(replace(pad.dataset(pressed(pad, samples=3)), calibration=None))
    table = data.table.select(data.training)
    return data, pad_fit(data.observations(data.training), table, data.dataset, kernel="gaussian", empirical=True)[0]


def test_a_pad_that_is_as_its_model_is_adequate() -> None:
    pad = line(share=0.0)
    found = diagnosed(pad, pressed(pad, samples=4), sample=False)
    assert found.verdict == "adequate"
    assert found.effects == ()


@pytest.mark.slow
@pytest.mark.parametrize("seed", [2, 6])
def test_a_sound_pad_of_unequal_elements_is_adequate(seed: int) -> None:
    """Its map needs many functions: what too few of them leave out is no cause, and no unknown one."""
    found = bayestouch.diagnose(uneven(seed), sample=False)
    assert found.verdict == "adequate"
    assert found.effects == ()


def test_creep_is_found_and_taken_out_of_readings() -> None:
    pad = line(share=0.0, load_spread=0.0)
    found = diagnosed(pad, pressed(pad, samples=4, creep=0.1))
    assert found.effects[0] == "creep"
    before, after = found.numbers["before"], found.numbers["after"]
    assert after["prediction_error_percent_peak"] < 0.5 * before["prediction_error_percent_peak"]
    # Of touch means, written out: the mean of the samples' residuals of each touch.
    held = found.traced.before.held_out
    rows = held.observed.row_touch
    means = np.stack([np.bincount(rows, weights=column) / np.bincount(rows) for column in held.samples.T], axis=1)
    expected = 100 * np.mean(np.sqrt((means**2).mean(axis=0)))
    assert before["touch_error_percent_peak"] == pytest.approx(expected, rel=1e-9)
    assert expected < 0.5 * before["prediction_error_percent_peak"]
    # What is left is noise: 0.05 of peaks between 10 and 16.
    assert after["prediction_error_percent_peak"] < 1.1 * 100 * np.mean(0.05 / pad.chain.gain)
    # Every touch has four samples, of which one is used.
    for calibration in (found.calibration_before, found.calibration_after):
        assert any(note.startswith("the first sample of each touch is used, as") for note in calibration.notes)
        assert not any("read twice" in note for note in calibration.notes)


def test_a_rest_reading_that_touches_share_is_not_said_to_be_missing() -> None:
    """A touch without contact before the others; with it subtracted, none is left in the table that calibrates."""
    pad = line(share=0.0, load_spread=0.0)
    table = pressed(pad, samples=2, touches=60)
    rest = table.select(np.arange(20)).with_(touch=np.full(20, -1), readings=np.zeros((20, 4)), load=np.zeros(20))
    for tables, missing in (((rest, table), False), ((table,), True)):
        found = diagnosed(pad, joined_tables(*tables), sample=False)
        assert (
            "no reading without contact: readings are taken as they are" in found.calibration_before.notes
        ) == missing


@pytest.fixture(scope="module")
def bent() -> tuple[SimulatedPad, Touches, bayestouch.Diagnosis]:
    pad = line(share=0.0, floor=0.02)
    rng = np.random.default_rng(5)
    table = pressed(pad, load=rng.uniform(1.0, 8.0, 120), measured=True, exponent=0.5)
    return pad, table, diagnosed(pad, table)


@pytest.mark.slow
def test_a_response_that_flattens_with_the_load_is_found(
    bent: tuple[SimulatedPad, Touches, bayestouch.Diagnosis],
) -> None:
    _, _, found = bent
    assert found.effects[0] == "load_nonlinearity"
    before, after = found.numbers["before"], found.numbers["after"]
    assert after["prediction_error_percent_peak"] < 0.2 * before["prediction_error_percent_peak"]
    assert after["location_rms_mm"] < 0.5 * before["location_rms_mm"]
    assert after["P_rms_N"] < 0.5 * before["P_rms_N"]
    # One sample a touch: there is no pure error to hold a residual against.
    assert before["lack_of_fit"] is None
    assert found.numbers["noise_floor_percent_peak"] is None


def test_a_calibration_with_effects_reads_the_same_from_its_file(
    bent: tuple[SimulatedPad, Touches, bayestouch.Diagnosis], tmp_path: Path
) -> None:
    _, table, found = bent
    found.save(tmp_path / "diagnosis")
    again = load_calibration(tmp_path / "diagnosis" / "calibration_after.nc")
    touches = table.select(np.arange(12))
    one = bayestouch.infer(touches, found.calibration_after, draws=200)
    two = bayestouch.infer(touches, again, draws=200)
    for name in ("x", "P"):
        np.testing.assert_allclose(one.mean(name), two.mean(name), rtol=1e-12)
    # The load is the true one, not the one that acts on a linear pad; it is known to 0.5 % here.
    assert np.abs(one.mean("P") / table.load[:12] - 1).max() < 0.05


def test_readings_are_freed_of_effects_as_they_came_by_them(fitted: tuple[SplitData, Fitted]) -> None:
    data, fit = fitted
    model = fit.model
    assert isinstance(model, PadModel)
    setting = replace(data.setting("", 1.0), loads_vary=True)
    values = {
        "crosstalk": (0.05,),
        "gain_nonlinearity": (-0.2, 1.4),
        "creep": (-0.1, 0.1),
        "memory": (0.02, 2.0, 0.5),
        "load_nonlinearity": (0.5, 0.1),
    }
    effects = tuple(effect_classes()[name].suited(setting) for name in values)
    assert all(effect is not None for effect in effects)
    affected = model.with_effects(effects)  # type: ignore[arg-type]
    vector = fit.vector
    for count, effect in enumerate(effects, start=1):
        vector = model.with_effects(effects[:count]).extended(vector, values[effect.name])  # type: ignore[arg-type, union-attr]
    # Readings as the model makes them, of the same history as the table has.
    observed = model.known
    predicted = affected.predict(vector)
    assert predicted.samples is not None
    readings = predicted.touches[observed.row_touch] + predicted.samples
    known = PadEffects(
        EffectList(setting, effects, {}),  # type: ignore[arg-type]
        values,
        model.peak,
        model.chain(vector).offset,
        model.element_place,
    )
    recording = replace(
        known._recording(np.ones(len(readings)), readings, (np.full(len(readings), np.nan),)),
        time_s=observed.time_s,
        held_s=observed.held_s,
        history=observed.history.above(known.zero),
    )
    read = readings - known.zero
    signal = known._signal_behind(recording, read, read, STEPS)
    np.testing.assert_allclose(signal, affected.signal(vector).signal[observed.row_touch], atol=1e-9)
    load = np.linspace(0.5, 3.0, 7)
    # Tabulated in steps of a hundredth of the reference load.
    np.testing.assert_allclose(known.as_read(known.acting(load)), load, rtol=1e-4)


def test_derivatives_are_those_of_the_prediction(fitted: tuple[SplitData, Fitted]) -> None:
    data, fit = fitted
    setting: Setting = data.setting("", 1.0)
    effects = tuple(effect_classes()[name].suited(setting) for name in ("crosstalk", "creep"))
    vector = fit.vector
    for count, values in enumerate(((0.05,), (-0.1, 0.1)), start=1):
        model = fit.model.with_effects(effects[:count])  # type: ignore[arg-type]
        vector = model.extended(vector, values)
    touches, samples = model.derivatives(vector)
    assert samples is not None
    rng = np.random.default_rng(0)
    for place in rng.choice(len(vector), 12, replace=False):
        # Central differences are off by the third derivative times the square of the step: far below the tolerance.
        step = 1e-4 * max(1.0, abs(vector[place]))
        up, down = vector.copy(), vector.copy()
        up[place], down[place] = vector[place] + step, vector[place] - step
        high, low = model.predict(up), model.predict(down)
        scale = np.abs(touches[place]).max() + 1e-9
        np.testing.assert_allclose(touches[place], (high.touches - low.touches) / (2 * step), atol=1e-3 * scale)
        np.testing.assert_allclose(samples[place], (high.samples - low.samples) / (2 * step), atol=1e-3 * scale)


def test_options_of_another_body_are_refused() -> None:
    pad = line()
    with pytest.raises(InputError, match="contact is an option of fingers"):
        bayestouch.diagnose(pad.dataset(pressed(pad)), contact="hertz")
