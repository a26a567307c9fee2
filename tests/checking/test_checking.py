"""The check of tables that lack what most tables have: contact, a load, a place, a reading."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from known_fingers import dataset, known_touches
from matplotlib.axes import Axes

import bayestouch
from bayestouch.checking.tables import touches_by_indenter
from bayestouch.commands.cli import main
from bayestouch.data.remarks import Tally, remarks
from bayestouch.data.touches import Touches, touches_from
from bayestouch.model.split_data import joined_tables


@pytest.fixture(scope="module")
def whole() -> Touches:
    return known_touches(1, step=3.0)


def drawn(axes: Axes) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Points of each entry of the legend."""
    return {str(each.get_label()): tuple(np.asarray(each.get_offsets()).T) for each in axes.collections}


def test_a_table_without_contact_is_described(
    whole: Touches, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made = dataset(whole.with_(load=np.zeros(whole.n_rows)))
    facts = bayestouch.check(made).facts
    assert [row["peak"] for row in facts["elements"]] == [None] * 7
    assert [table["touches"] for table in facts["tables"]] == [0, 0]
    assert any(line.startswith("cannot be calibrated: ") for line in facts["advice"])
    bayestouch.save_dataset(made, tmp_path / "finger")
    assert main(["check", str(tmp_path / "finger"), "--plot", str(tmp_path / "check.png")]) == 0
    assert "cannot be calibrated" in capsys.readouterr().out


def test_a_table_without_rows_is_said_to_have_none(whole: Touches) -> None:
    """Nothing is said of places or repeats, which no row could have."""
    empty, sensor = whole.select([]), dataset(whole).sensor
    advice = bayestouch.check(bayestouch.DataSet(sensor, None, empty)).facts["advice"]
    assert advice[1:] == ["no rows in touches: the sensor cannot be calibrated"]
    advice = bayestouch.check(bayestouch.DataSet(sensor, whole, empty)).facts["advice"]
    assert advice[-1] == "no rows in touches: there is nothing to read"
    assert not any("errors of" in line for line in advice)


def test_what_is_drawn_of_two_tables_is_the_same_quantity(whole: Touches) -> None:
    """The calibration has loads and places; the touches lack the one, the other or both."""
    means = whole.averaged()
    largest = np.abs(means.readings).max(axis=1)
    flat = np.isinf(means.indenter_radius_mm)
    nothing = np.full(whole.n_rows, np.nan)
    for load, angle, y, count in (
        (whole.load, whole.angle_deg, means.load, 2),
        (nothing, whole.angle_deg, largest, 2),
        (whole.load, None, means.load, 1),
        (nothing, None, means.load, 1),
    ):
        touches = whole.with_(load=load, angle_deg=angle)
        axes = bayestouch.check(bayestouch.DataSet(dataset(whole).sensor, whole, touches)).plot_touches()
        flats = {name: points for name, points in drawn(axes).items() if name.startswith("flat")}
        assert len(flats) == count
        for points in flats.values():
            np.testing.assert_allclose(points, [means.angle_deg[flat], y[flat]])  # type: ignore[index]
        assert axes.get_ylabel() == ("largest reading" if y is largest else "load (N/m)")
        assert axes.get_xlabel() == "reference location θ (degree)"


def test_a_touch_without_readings_draws_no_warning(whole: Touches) -> None:
    readings = whole.readings.copy()
    readings[whole.touch == whole.touch[0]] = np.nan
    without = whole.with_(readings=readings, load=np.full(whole.n_rows, np.nan))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        points = drawn(bayestouch.check(dataset(without)).plot_touches())
    assert sum(np.isnan(y).sum() for _, y in points.values()) == 2  # one touch of each table


def test_the_indenter_of_a_touch_is_the_first_that_is_stated() -> None:
    nan = np.nan
    table = touches_from([1, 1, 2, 2, 3], np.ones((5, 1)), indenter_radius_mm=[nan, 3.9, 0, nan, nan])
    np.testing.assert_array_equal(table.averaged().indenter_radius_mm, [3.9, 0, nan])
    assert touches_by_indenter(None, table) == [
        {"indenter": name, "to_calibrate": 0, "to_be_read": 1} for name in ("knife edge", "3.9 mm", "unknown")
    ]


@pytest.mark.parametrize("name", ["check.pgf", "check.eps", "check.txt"])
def test_other_pictures_are_refused_in_one_line(whole: Touches, tmp_path: Path, name: str) -> None:
    with pytest.raises(bayestouch.InputError, match=rf"{name}: expected a name that ends in \.png, \.svg or \.pdf$"):
        bayestouch.check(dataset(whole)).save_plot(tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_the_rest_reading_is_that_of_the_calibration(whole: Touches) -> None:
    """As `infer` has it: an offset is no reading, and advice is on the table that calibrates."""
    offset = 30_000.0
    shifted = whole.with_(readings=whole.readings + offset)
    rest = shifted.with_(
        readings=np.full(whole.readings.shape, offset), load=np.zeros(whole.n_rows), touch=whole.touch + 10_000
    )
    with_rest, made = joined_tables(shifted, rest), dataset(whole)
    tables = (whole, whole), (with_rest, shifted)
    plain, both = (bayestouch.check(replace(made, calibration=one, touches=two)).facts for one, two in tables)
    peaks = [[row["peak"] for row in facts["elements"]] for facts in (plain, both)]
    np.testing.assert_allclose(peaks[1], peaks[0], rtol=1e-9)
    other = bayestouch.check(replace(made, calibration=shifted, touches=with_rest)).facts["advice"]
    assert any("touches has some: copy them" in line for line in other)
    assert not any("without contact" in line for line in both["advice"])


def test_samples_that_are_all_equal_are_no_repeats(whole: Touches) -> None:
    said = "the samples of each touch are all equal"
    first = whole.select(whole.sample == whole.sample.min())
    copies = first.select(np.repeat(np.arange(first.n_rows), 2))
    for table, noted in ((whole, False), (first, False), (copies, True)):
        facts = bayestouch.check(replace(dataset(whole), calibration=table, touches=table)).facts
        assert any(line.startswith(said) for line in facts["advice"]) == noted
        assert all(row["noise"] is None for row in facts["elements"]) == (table is not whole)


def test_rows_of_one_touch_at_two_places_are_remarked() -> None:
    """As where numbers of touches begin again; a turn of 360 degrees is the same place."""
    table = touches_from(
        np.array([0, 1, 2, 0, 1, 2]),
        np.ones((6, 3)),
        angle_deg=np.array([-5.0, 0.0, 5.0, 355.0, 0.5, 6.5]),
        load=np.ones(6),
        contact=1.0,
    )
    said = [line for line in remarks(Tally.of(table)) if "more than one place" in line]
    assert said == [
        "1 touch at more than one place: rows with one number are averaged, so give each touch a number of its own"
    ]


@pytest.mark.parametrize(("times", "said"), [(1.1, False), (0.9, True), (None, False)])
def test_loads_below_the_noise_of_the_force_sensor(whole: Touches, times: float | None, said: bool) -> None:
    """As loads in N/mm are, with a noise in N/m: half of them are smaller than it."""
    made = dataset(whole)
    middle = float(np.median(whole.averaged().load))
    sensor = replace(made.sensor, force_noise_sd=None if times is None else middle / times)
    advice = bayestouch.check(replace(made, sensor=sensor)).facts["advice"]
    line = f"load_N_per_m is {middle:.3g} N/m in the median, less than the noise of the force sensor"
    assert any(each.startswith(line) for each in advice) == said
