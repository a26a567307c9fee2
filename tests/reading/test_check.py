"""Faulty pads: what is broken is named, left out or put right, and the others go on."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from study_modules import study

import bayestouch
from bayestouch.data.touches import Touches
from bayestouch.pad.effect_changes import CorrectedMeans
from bayestouch.pad.reading.touch_reader import PadTouchReader
from bayestouch.reading import check as check_of_sensor
from bayestouch.reading.check import check_sensor
from bayestouch.reading.faults import SensorCheck
from bayestouch.reading.options import Options
from bayestouch.results.objects import Calibration, TouchPosteriors
from bayestouch.simulation import FingerDesign, PadDesign, simulate

ELEMENT = 2
FloatArray = np.ndarray


@pytest.fixture(scope="module")
def sound() -> tuple[Calibration, Touches]:
    data = simulate(PadDesign(calibration_step_mm=2.25, n_touches=60), seed=1).dataset
    return bayestouch.calibrate(data, draws=100), data.touches


def read(sound: tuple[Calibration, Touches], touches: Touches, **options: bool) -> TouchPosteriors:
    return bayestouch.infer(touches, sound[0], draws=128, seed=1, **options)


def broken(touches: Touches, change: Callable[[FloatArray], FloatArray]) -> Touches:
    readings = touches.readings.copy()
    readings[:, ELEMENT] = change(readings[:, ELEMENT])
    return touches.with_(readings=readings)


def said(result: TouchPosteriors) -> list[str]:
    return [note for note in result.notes if note.startswith("sensor check")]


def test_a_sound_pad_is_read_as_without_the_check(sound: tuple[Calibration, Touches]) -> None:
    checked, plain = read(sound, sound[1]), read(sound, sound[1], check_sensor=False)
    assert said(checked) == []
    assert checked.settings["touches_checked"] == 60
    for name, draws in plain.posterior.items():
        np.testing.assert_array_equal(checked.posterior[name], draws)


@pytest.mark.parametrize(
    ("change", "word"),
    [
        (lambda y: np.random.default_rng(1).normal(0.0, 10.0, len(y)), "(dead)"),
        (lambda y: np.full(len(y), y[7]), "e03 reads the same at every touch (stuck) and"),
        (lambda y: 0.8 * y, "(its gain has changed)"),
        (lambda y: 1.3 * y, "(its gain has changed)"),
        (lambda y: y + 150.0, "(its zero has moved)"),
    ],
)
def test_a_faulty_element_is_named_and_left_out(
    sound: tuple[Calibration, Touches], change: Callable[[FloatArray], FloatArray], word: str
) -> None:
    result = read(sound, broken(sound[1], change))
    assert len(said(result)) == 1
    assert "e03" in said(result)[0] and word in said(result)[0]
    assert result.settings["elements_left_out"] == "e03"
    assert np.isnan(result.rows.observed[:, ELEMENT]).all()


@pytest.mark.parametrize(
    ("elements", "loads", "unknowns", "checked"),
    [(3, 0, 3, 0), (3, 20, 3, 0), (4, 0, 3, 0), (4, 7, 3, 0), (4, 12, 3, 12), (5, 0, 3, 20), (3, 20, 2, 20)],
)
def test_touches_with_two_readings_more_than_unknowns_are_checked(
    elements: int, loads: int, unknowns: int, checked: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without one of n readings, n - 1 are to be more than the unknowns; of 20 touches, the first few have loads."""

    def fitted(_touches: Any, _block: Any, some: np.ndarray, _rest_variance: Any = None) -> Any:
        load = np.where(np.arange(20) < loads, 1.0, np.nan)
        return SimpleNamespace(columns=np.column_stack([np.ones((20, elements)), load])[some])

    def found(fits: Any) -> SensorCheck:
        return SensorCheck((), np.arange(elements), 1.0, len(fits.columns))

    monkeypatch.setattr(check_of_sensor, "find_faults", found)
    reader: Any = SimpleNamespace(parameters=(None,) * unknowns, fitted=fitted, drifts_are_estimated=False)
    touches = SimpleNamespace(means=SimpleNamespace(time_s=np.full(20, np.nan)))
    assert check_sensor(reader, touches, SimpleNamespace(n_touches=20), elements).touches == checked


@pytest.mark.slow
def test_a_finger_of_three_elements_is_read_as_without_the_check() -> None:
    """Of a sound one the check said that its wires are swapped and the model is wrong by 28 times the noise."""
    design = FingerDesign(
        n_elements=3,
        pitch_deg=20.0,
        samples_per_touch=5,
        noise_percent_peak=0.3,
        edge_step_deg=2.0,
        flat_step_deg=12.0,
        calibration_span_deg=30.0,
        touch_radii_mm=(0.0, 2.0, 9.3),
        touch_span_deg=22.0,
        touch_step_deg=2.0,
    )
    data = simulate(design, seed=0).dataset
    calibration = bayestouch.calibrate(data, draws=50, seed=0)
    checked, plain = (
        bayestouch.infer(data.touches, calibration, draws=64, use_load=False, check_sensor=each)
        for each in (True, False)
    )
    notes = [note for note in checked.notes if "check" in note]
    assert len(notes) == 1 and notes[0].startswith("the sensor is not checked: that needs at least 8 touches")
    assert not {"elements_left_out", "element_order", "noise_widened"} & set(checked.settings)
    for name, draws in plain.posterior.items():
        np.testing.assert_array_equal(checked.posterior[name], draws)


@pytest.mark.slow
def test_swapped_wires_are_put_right(sound: tuple[Calibration, Touches]) -> None:
    touches = sound[1]
    swapped = touches.with_(readings=touches.readings[:, [0, 1, 3, 2, 4, 5, 6, 7]])
    result, right = read(sound, swapped), read(sound, touches)
    assert result.settings["element_order"] == "e01 e02 e04 e03 e05 e06 e07 e08"
    for name, draws in right.posterior.items():
        np.testing.assert_array_equal(result.posterior[name], draws)


def test_swapped_wires_of_elements_with_effects_are_put_right(tmp_path: Path) -> None:
    """Gains differ by half, and readings are bent by 40 % at the peak: each element is corrected with its own peak.

    All results are those of the right wires to the bit, also what the uncertainty of the effect changes.
    """
    design = PadDesign(calibration_step_mm=2.25, n_touches=60, gain_spread=0.5, noise_percent_peak=0.3)
    data = simulate(design, effects={"gain_nonlinearity": -0.4}, seed=1).dataset
    path = tmp_path / "model.toml"
    path.write_text('body = "pad"\n[[effect]]\nname = "gain_nonlinearity"\n', encoding="utf-8")
    calibration = bayestouch.calibrate(data, model=path, kernel="gaussian", e_map="model", draws=32)
    order = np.array([0, 6, 2, 3, 4, 5, 1, 7])
    swapped = data.touches.with_(readings=data.touches.readings[:, order])
    result, right = (bayestouch.infer(each, calibration, draws=64, seed=1) for each in (swapped, data.touches))
    assert said(right) == []
    assert result.settings["element_order"] == "e01 e07 e03 e04 e05 e06 e02 e08"
    for name, draws in right.posterior.items():
        np.testing.assert_array_equal(result.posterior[name], draws)
    reader = PadTouchReader.from_calibration(calibration, Options())
    touches = [reader.average(each.baseline_corrected(calibration.rest_reading)) for each in (swapped, data.touches)]
    means, wanted = reader.without(SensorCheck((), order, 1.0, 60)).ready(touches[0]), reader.ready(touches[1])
    assert isinstance(means, CorrectedMeans) and isinstance(wanted, CorrectedMeans) and wanted.changes is not None
    np.testing.assert_array_equal(means.changes, wanted.changes)


def test_a_force_sensor_off_by_a_factor_is_left_out(sound: tuple[Calibration, Touches]) -> None:
    touches = sound[1]
    result = read(sound, touches.with_(load=1.2 * touches.load))
    assert result.settings["force_sensor"] == "left out"
    assert "elements_left_out" not in result.settings
    low, high = result.interval("P")
    # 60 touches, each inside with 90 %: four binomial standard errors, and loads that the whole pad shares beside
    assert np.mean((low <= touches.averaged().load) & (touches.averaged().load <= high)) > 0.9 - 4 * np.sqrt(0.09 / 60)


@pytest.mark.slow
def test_a_few_odd_touches_are_named_and_the_others_read_as_ever(sound: tuple[Calibration, Touches]) -> None:
    """Three touches of sixty, with elements that are off by the peak, had widened the noise of all touches."""
    touches = sound[1]
    readings, peak = touches.readings.copy(), np.abs(touches.readings).max()
    for touch, element in ((5, 0), (17, 3), (40, 7)):
        readings[touches.touch == touch, element] += peak
    result = read(sound, touches.with_(readings=readings))
    (note,) = said(result)
    assert "3 touches (5, 17, 40) differ from the calibrated model by more than 3 times" in note
    others = ~np.isin(result.rows.touch, (5, 17, 40))
    plain = read(sound, touches)
    for name in ("x", "y", "P"):
        np.testing.assert_array_equal(result.sd(name)[others], plain.sd(name)[others])


@pytest.mark.slow
def test_study_of_faults_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    """One pad and a fault: found, and coverage comes back."""
    module = study("faulty_pads")
    monkeypatch.setattr(module, "TABLES", 2)
    wanted = ("force x 1.4",)
    monkeypatch.setattr(module, "OURS", tuple(fault for fault in module.OURS if fault.name in wanted))
    rows = module.main(1)
    for name in wanted:
        assert rows[name]["named"] == 1
        # 60 touches: two standard errors are 8 per cent
        assert rows[name]["after"].min() > 80
        assert rows[name]["before"].min() < rows[name]["after"].min() - 5


@pytest.mark.parametrize("name", ["neighbours swapped", "wires swapped"])
def test_the_study_of_faults_swaps_wires_of_neighbours(name: str) -> None:
    """Neighbours of the pad's two columns of four are 6.75 mm apart, opposite corners 21.3 mm."""
    module, rng = study("faulty_pads"), np.random.default_rng(0)
    (fault,) = (each for each in module.OURS if each.name == name)
    places = [(column * 6.75, row * 6.75) for column in range(2) for row in range(4)]
    table = SimpleNamespace(readings=np.arange(8.0)[None], with_=lambda readings: readings[0])
    for _ in range(50):
        (one, other) = np.flatnonzero(fault.apply(table, module.element_of(fault, rng), rng) != np.arange(8))
        assert np.hypot(*np.subtract(places[one], places[other])) == 6.75
