"""Diagnosis of poor data: a degraded run with a note, or one line that says what is missing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import bayestouch
from bayestouch.commands.cli import main
from bayestouch.data.dataset import DataSet, save_dataset
from bayestouch.data.touches import Touches
from bayestouch.model.split_data import SplitData
from bayestouch.simulation import FingerDesign, simulate

Change = Callable[[Touches], Touches]


@cache
def crossed() -> DataSet:
    """A finger of eight elements whose neighbours leak 6 %."""
    design = FingerDesign(n_elements=8, samples_per_touch=3, edge_step_deg=3.0, flat_step_deg=6.0, touch_step_deg=4.0)
    return simulate(design, effects={"crosstalk": 0.06}, seed=5).dataset


def changed(change: Change) -> DataSet:
    dataset = crossed()
    assert dataset.calibration is not None
    return replace(dataset, calibration=change(dataset.calibration), touches=change(dataset.touches))


def dead(table: Touches) -> Touches:
    readings = table.readings.copy()
    readings[:, 4] = 7.0
    return table.with_(readings=readings)


def once(table: Touches) -> Touches:
    return table.select(table.sample == 0)


def copied(table: Touches) -> Touches:
    """Every sample of a touch is a copy of its first one."""
    first = {touch: values for touch, values in zip(table.touch[::-1], table.readings[::-1], strict=True)}
    return table.with_(readings=np.array([first[touch] for touch in table.touch]))


def timeless(table: Touches) -> Touches:
    return table.with_(time_s=np.full(table.n_rows, np.nan))


def begun_again(table: Touches) -> Touches:
    """The clock begins again at the second half of the touches."""
    later = table.touch >= np.median(np.unique(table.touch))
    return table.with_(time_s=table.time_s - np.where(later, table.time_s[later].min() - table.time_s.min(), 0.0))


def without(column: str) -> Change:
    return lambda table: table.with_(**{column: np.full(table.n_rows, np.nan)})


def few(count: int) -> Change:
    return lambda table: table.select(np.isin(table.touch, np.unique(table.touch)[:: table.n_touches // count]))


@pytest.mark.parametrize(
    "change, note",
    [
        (dead, "e05: no readings"),
        (once, "no touch was read twice"),
        (copied, "the samples of each touch are all equal"),
        (timeless, "times are missing"),
        (begun_again, "touches overlap in time"),
        (few(12), "too few touches to hold any out"),
    ],
)
def test_what_is_missing_is_noted(change: Change, note: str) -> None:
    assert any(note in each for each in SplitData.of(changed(change)).notes)


def test_one_table_is_parted() -> None:
    """Every fourth touch is held out; no touch is in both parts, and the clock is that of the table."""
    dataset = replace(crossed(), touches=crossed().calibration, calibration=None)
    data = SplitData.of(dataset)
    seen, held = (set(data.table.touch[rows]) for rows in (data.training, data.held_out))
    assert not seen & held
    assert abs(len(held) - (len(seen) + len(held)) / 4) <= 1
    assert np.all(np.diff(data.time_s) >= 0)


@pytest.mark.slow
def test_dead_element_no_repeats_no_times() -> None:
    """All at once: the effect is found all the same, and what cannot be told is null."""
    diagnosis = bayestouch.diagnose(changed(lambda table: timeless(once(dead(table)))), sample=False, draws=64)
    numbers = diagnosis.to_dict()
    assert diagnosis.effects == ("crosstalk",)
    assert numbers["noise_floor_percent_peak"] is None
    assert numbers["before"]["R_rms_mm"] is None
    # Noise that no repeats tell is no yardstick: neither floor nor lack of fit is given, and the outcome says so.
    assert numbers["before"]["lack_of_fit"] is None and numbers["after"]["lack_of_fit"] is None
    assert diagnosis.verdict != "explained" or "not known from repeats" in str(diagnosis)
    assert numbers["after"]["prediction_error_percent_peak"] < numbers["before"]["prediction_error_percent_peak"]
    stages = {each["name"] for each in numbers["candidates"]}
    assert "outliers" not in stages and "creep" not in stages


@pytest.mark.slow
@pytest.mark.filterwarnings("error")
def test_copies_of_samples_are_no_noise() -> None:
    """Copies say nothing of the noise: no effect of it is invented, and no error is compared with it."""
    diagnosis = bayestouch.diagnose(changed(copied), sample=False, draws=64)
    numbers = diagnosis.to_dict()
    assert diagnosis.effects == ("crosstalk",)
    assert numbers["noise_from_repeats"] is False and numbers["noise_floor_percent_peak"] is None
    assert {"outliers", "common_mode_noise", "signal_dependent_noise"}.isdisjoint(
        each["name"] for each in numbers["candidates"]
    )


@pytest.mark.slow
def test_too_few_touches_to_tell() -> None:
    """Errors are null, rivals are named, and so is what to measure."""
    diagnosis = bayestouch.diagnose(changed(few(12)), sample=False, draws=64)
    numbers = diagnosis.to_dict()
    assert set(numbers["before"].values()) == {None}
    (effect,) = numbers["effects"]
    measure = numbers["measure"]
    assert effect["indistinguishable_from"] and set(measure["between"]) <= {
        effect["name"],
        *effect["indistinguishable_from"],
    }
    assert "more touches with" in measure["advice"] and measure["number"] > 0
    assert measure["advice"] in str(diagnosis)


@pytest.mark.parametrize(
    "change, complaint",
    [
        (without("load"), "no calibration touch has a measured load"),
        (without("angle_deg"), "no touch that presses has a known indenter, location and reading"),
        (without("indenter_radius_mm"), "no touch that presses has a known indenter, location and reading"),
        (few(3), "no calibration touch comes within"),
    ],
)
def test_what_cannot_be_diagnosed_is_one_line(
    change: Change, complaint: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    save_dataset(changed(change), tmp_path / "data")
    assert main(["diagnose", str(tmp_path / "data"), "-o", str(tmp_path / "out")]) == 2
    err = capsys.readouterr().err
    assert complaint in err and err.strip().count("\n") == 0
    assert err.startswith(f"bayestouch: {tmp_path / 'data'}")  # which data, where several are gone through
    assert not (tmp_path / "out").exists()


def test_output_that_is_a_file_is_refused_at_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "out").write_text("mine")
    assert main(["diagnose", str(tmp_path), "-o", str(tmp_path / "out")]) == 2
    assert "this is a file" in capsys.readouterr().err
    assert (tmp_path / "out").read_text() == "mine"
