"""Which touches of a table a diagnosis can use, and what it says of them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from bayestouch.data.dataset import DataSet
from bayestouch.data.touches import Touches, touches_from
from bayestouch.effects import catalogue
from bayestouch.errors import InputError
from bayestouch.model import split_data as data
from bayestouch.simulation import FingerDesign, PadDesign, simulate

NAN = np.nan


def test_settings() -> None:
    assert (data.ENOUGH_READ, data.ENOUGH_CALIBRATION, data.BLOCKS) == (20, 40, 40)


def test_nothing_is_known_without_a_location() -> None:
    simulated = simulate(FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=10.0), seed=3).dataset
    bare = simulated.touches.with_(angle_deg=None)
    for split in (data.SplitData.of, data.SplitData.of_calibration):
        with pytest.raises(InputError, match="no touch that presses has a known indenter, location and reading"):
            split(replace(simulated, calibration=bare, touches=bare))
    with pytest.raises(InputError, match="no touch that presses has a known indenter, location and reading"):
        data.SplitData.of(DataSet(simulated.sensor, None, bare))


def test_a_note_counts_calibration_touches_without_references() -> None:
    """54 calibration touches: without any angle the 45 others are the whole fit; without 5 angles 49 are in it."""
    simulated = simulate(FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=10.0), seed=3).dataset
    calibration = simulated.calibration
    assert calibration is not None and calibration.angle_deg is not None
    some = np.unique(calibration.touch)[:5]
    angle_deg = np.where(np.isin(calibration.touch, some), NAN, calibration.angle_deg)
    held = "every other touch to be read that has references is held out; the rest is fitted"
    for made, fitted, notes in (
        (calibration, 54 + 45, {f"{held} with the calibration"}),
        (
            calibration.with_(angle_deg=angle_deg),
            49 + 45,
            {
                f"{held} with the calibration",
                "5 of 54 calibration touches are without angle_deg: they are not used",
            },
        ),
        (
            calibration.with_(angle_deg=None),
            45,
            {held, "54 of 54 calibration touches are without angle_deg: they are not used"},
        ),
    ):
        split = data.SplitData.of(replace(simulated, calibration=made))
        assert len(np.unique(split.table.touch[split.training])) + split.n_held_out == fitted
        assert {note for note in split.notes if "held out" in note or "not used" in note} == notes


def test_a_search_may_use_a_part_of_the_touches_that_calibrations_use() -> None:
    """Two rows a touch; none of them is held out, and the same seed chooses the same touches."""
    rng = np.random.default_rng(0)
    x, sensor = rng.uniform(0, 30, 100), simulate(PadDesign(), seed=0).dataset.sensor
    n = sensor.n_elements
    touches = touches_from(
        np.repeat(np.arange(100), 2), rng.normal(size=(200, n)), x_mm=np.repeat(x, 2), y_mm=np.repeat(x, 2)
    )
    split = data.SplitData.of(DataSet(sensor, None, touches))
    part = split.thinned(30, seed=4)
    assert len(np.unique(part.table.touch[part.searched])) == 30 and part.searched.sum() == 60
    np.testing.assert_array_equal(part.training, split.training)
    assert not (part.searched & ~part.training).any() and not (part.searched & part.held_out).any()
    np.testing.assert_array_equal(part.searched, split.thinned(30, seed=4).searched)
    # 12 blocks of two are held out
    assert "the search uses 30 of 76 touches" in part.notes[-1]
    assert split.thinned(76, seed=4) is split.thinned(None, seed=4) is split
    np.testing.assert_array_equal(split.searched, split.training)


def test_blocks_of_a_scan_follow_the_time_in_any_order_of_the_table() -> None:
    """A table in any order has the same touches held out: blocks of two, number 2 of every four."""
    rng = np.random.default_rng(0)
    x, sensor = rng.uniform(0, 30, 90), simulate(PadDesign(), seed=0).dataset.sensor
    touches = touches_from(
        np.arange(90), rng.normal(size=(90, sensor.n_elements)), x_mm=x, y_mm=x, time_s=10.0 * np.arange(90)
    )
    held = [4, 5, 12, 13, 20, 21, 28, 29, 36, 37, 44, 45, 52, 53, 60, 61, 68, 69, 76, 77, 84, 85]
    for order in (np.arange(90), np.argsort(x), rng.permutation(90)):
        split = data.SplitData.of(DataSet(sensor, None, touches.select(order)))
        assert sorted(touches.touch[order][split.held_out].tolist()) == held


@pytest.mark.parametrize(("count", "held"), [(39, 0), (40, 10)])
def test_few_touches_of_one_table_are_all_fitted(count: int, held: int) -> None:
    """Below forty none is held out, and none is lost."""
    sensor = simulate(FingerDesign(n_elements=4, calibration_span_deg=20, touch_step_deg=10), seed=0).dataset.sensor
    rng = np.random.default_rng(0)
    touches = touches_from(
        np.arange(count), rng.normal(size=(count, 4)), angle_deg=np.zeros(count), indenter_radius_mm=np.ones(count)
    )
    split = data.SplitData.of(DataSet(sensor, None, touches))
    assert (split.training.sum(), split.held_out.sum()) == (count - held, held)
    assert (data.TOO_FEW in split.notes) == (held == 0)


@pytest.mark.parametrize("known", [0, 1])
def test_touches_without_references_are_not_called_too_few(known: int) -> None:
    """None can be held out; but of touches with references there are too few only if there is one."""
    made = simulate(FingerDesign(n_elements=4, calibration_span_deg=20, touch_step_deg=10), seed=0).dataset
    assert made.calibration is not None
    names = {name: getattr(made.touches, name).copy() for name in ("indenter_radius_mm", "angle_deg")}
    for values in names.values():
        values[made.touches.touch >= made.touches.touch.min() + known] = NAN
    few = made.calibration.select(made.calibration.touch % 2 == 0)
    found = data.SplitData.of(DataSet(made.sensor, few, made.touches.with_(**names)))
    assert found.n_held_out == 0
    assert found.unreferenced == (known == 0)
    lacking = (
        "no touch to be read has references (indenter_radius_mm and angle_deg), and too few calibration touches have "
        "them to hold any out: errors are not estimated"
    )
    assert (lacking in found.notes, data.TOO_FEW in found.notes) == (known == 0, known == 1)


def test_touches_of_a_pad_without_a_load_are_left_out_where_others_have_one() -> None:
    """With the mean load in its place, every third touch without one made gains 20 % too small."""
    made = simulate(PadDesign(element_x_mm=(0.0, 5.0, 10.0), element_y_mm=None, n_touches=60), seed=1).dataset
    assert made.calibration is not None
    some = made.calibration.touch % 3 == 0
    lacking = made.calibration.with_(load=np.where(some, np.nan, made.calibration.load))
    found = data.SplitData.of_calibration(DataSet(made.sensor, lacking, made.touches))
    without = np.unique(found.table.touch[np.isnan(found.table.load)])
    assert not np.isin(found.table.touch[found.training], without).any()
    assert f"{len(without)} touches without a load above zero: left out of the fit" in found.notes
    # Where no load is measured, all touches stay.
    unmeasured = lacking.with_(load=np.full(lacking.n_rows, NAN))
    assert data.SplitData.of_calibration(DataSet(made.sensor, unmeasured, made.touches)).training.all()


def test_touches_to_be_read_without_a_load_are_not_called_calibration_touches() -> None:
    """All calibration touches have loads; the touches to be read that join their fit have none."""
    made = simulate(PadDesign(element_x_mm=(0.0, 5.0, 10.0), element_y_mm=None, n_touches=60), seed=1).dataset
    assert made.calibration is not None
    assert (made.calibration.load[made.calibration.in_contact] > 0).all()
    unmeasured = made.touches.with_(load=np.full(made.touches.n_rows, NAN))
    found = data.SplitData.of(DataSet(made.sensor, made.calibration, unmeasured))
    count = len(np.unique(made.touches.touch)) // 2
    (note,) = [note for note in found.notes if "load above zero" in note]
    assert note == f"{count} touches without a load above zero: left out of the fit"


@pytest.mark.parametrize(("load_range", "looked_for"), [((200.0, 200.0), False), ((160.0, 240.0), True)])
def test_an_offset_of_the_load_is_looked_for_where_loads_differ(
    load_range: tuple[float, float], looked_for: bool
) -> None:
    """With equal loads on a finger it acts as another shear modulus."""
    design = FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=10.0, load_range=load_range)
    setting = data.SplitData.of(simulate(design, seed=3).dataset).setting("hertz", 200.0)
    assert ("load_offset" in {each.name for each in catalogue(setting)}) == looked_for


def test_effects_that_a_rest_reading_of_each_touch_subtracts_are_not_looked_for() -> None:
    """What remains of earlier touches and a drift of the zero are in the rest reading, too; one touch lacks its own."""
    made = simulate(PadDesign(samples_per_touch=2), seed=1).dataset
    assert made.calibration is not None
    for missing in (0, 1):
        tables = [_with_rest_rows(each, missing) for each in (made.calibration, made.touches)]
        split = data.SplitData.of(DataSet(made.sensor, *tables))
        setting = split.setting("", 1.0)
        assert setting.own_rest == (missing == 0)
        names = {each.name for each in catalogue(setting)}
        assert "gain_drift" in names
        assert ({"baseline_drift", "memory"} <= names) == (missing == 1)
        assert missing == 1 or not {"baseline_drift", "memory"} & names


def _with_rest_rows(table: Touches, missing: int) -> Touches:
    """The table after a row at rest in each touch but the first `missing` ones."""
    _, first = np.unique(table.touch, return_index=True)
    one = table.select(np.sort(first)[missing:])
    rest = one.with_(contact=np.zeros(one.n_rows), readings=0.1 + 0 * one.readings, sample=np.full(one.n_rows, 99))
    both = data.joined_tables(rest, table)
    return both.with_(touch=np.concatenate([rest.touch, table.touch]))


def test_tables_that_were_recorded_in_turn_are_one_session() -> None:
    """Every third touch of a recording is to be read; or the touches to be read were all made before the others."""
    made = simulate(PadDesign(element_x_mm=(0.0, 5.0, 10.0), element_y_mm=None, n_touches=60), seed=1).dataset
    whole = made.touches
    third, early = whole.touch % 3 == 0, whole.touch < 20
    for later, sessions in ((third, 1), (early, 2)):
        split = data.SplitData.of(DataSet(made.sensor, whole.select(~later), whole.select(later)))
        time = np.concatenate([whole.time_s[~later], whole.time_s[later]])
        np.testing.assert_array_equal(split.time_s, time - time.min())
        assert not any("overlap" in note for note in split.notes)
        found = split.observations(split.training).sessions
        spans = [(time.min(), time.max())]
        if sessions == 2:
            spans = [(whole.time_s[early].min(), whole.time_s[early].max())]
            spans += [(whole.time_s[~early].min(), whole.time_s[~early].max())]
        np.testing.assert_array_equal(found, np.array(spans) - time.min())


@pytest.mark.parametrize("tips", [(0.0,), (0.0, 3.0), (0.0, 3.0, np.inf), (0.0, 3.0, 6.0, np.inf)])
def test_every_tip_is_fitted_and_held_out(tips: tuple[float, ...]) -> None:
    """Tips in turn (one, then the next), and all touches of a tip after each other: then every second of the table."""
    design = FingerDesign(n_elements=4, calibration_span_deg=20, touch_step_deg=10)
    sensor, rng, count = simulate(design, seed=0).dataset.sensor, np.random.default_rng(0), 20 * len(tips) + 1

    def touches(radius: Any) -> Touches:
        readings = rng.normal(size=(count, 4))
        return touches_from(np.arange(count), readings, angle_deg=np.zeros(count), indenter_radius_mm=radius)

    in_turn, after_each_other = np.resize(tips, count), np.sort(np.resize(tips, count))
    few = touches(0.0).select(np.arange(10))
    layouts: tuple[tuple[Touches | None, bool], ...] = ((touches(0.0), True), (None, True), (few, False))
    for radius in (in_turn, after_each_other):
        for other, read in layouts:
            if read:
                split = data.SplitData.of(DataSet(sensor, other, touches(radius)))
                mine = split.held_out[-count:]
            else:
                split = data.SplitData.of(DataSet(sensor, touches(radius), few))
                mine = split.held_out[:count]
            if not mine.any():
                assert count < data.ENOUGH_CALIBRATION
                continue
            every = 2 if other is not None and read else 4
            for tip in tips:
                n = (radius == tip).sum()
                assert abs(mine[radius == tip].sum() - n / every) < 1
            if radius is after_each_other:
                np.testing.assert_array_equal(mine, np.arange(count) % every == every // 2)
            assert not (split.training & split.held_out).any()


def test_folds_of_tips_in_turn_hold_out_each_touch_once() -> None:
    """Two tips in turn: number 2 of every four touches of the table is always the first tip."""
    design = FingerDesign(n_elements=4, calibration_span_deg=20, touch_step_deg=10)
    sensor, rng = simulate(design, seed=0).dataset.sensor, np.random.default_rng(0)
    radius = np.resize([2.0, 5.0], 48)
    table = touches_from(np.arange(48), rng.normal(size=(48, 4)), angle_deg=np.zeros(48), indenter_radius_mm=radius)
    held = np.array([data.SplitData.of(DataSet(sensor, None, table), fold).held_out for fold in range(4)])
    np.testing.assert_array_equal(held.sum(axis=0), 1)
    np.testing.assert_array_equal(held[:, radius == 2.0].sum(axis=1), 6)
    np.testing.assert_array_equal(held[:, radius == 5.0].sum(axis=1), 6)
