"""The touch table in memory: contact, selection, means per touch, baseline."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from same_touches import same_touches

from bayestouch.data.baseline import Baseline, RestTally, shared_rest_reads
from bayestouch.data.grouping import grouped_mean, groups
from bayestouch.data.touches import Touches, numbered, touches_from
from bayestouch.errors import InputError

# Their squares do not underflow: a standard deviation of equal readings is zero, and of no others.
READINGS = st.floats(-1e3, 1e3).map(lambda value: round(value, 9))


def finger_touches(**changes: object) -> Touches:
    columns: dict[str, object] = {
        "touch": [7, 7, 7, 3, 3],
        "readings": [[0.0, 1.0], [10.0, np.nan], [12.0, 5.0], [20.0, 7.0], [26.0, np.nan]],
        "angle_deg": [1.0, 1.0, 1.0, -2.0, -2.0],
        "load": [0.0, 100.0, 102.0, 200.0, np.nan],
        "indenter_radius_mm": [np.nan, np.inf, np.inf, 0.0, 0.0],
        "time_s": [0.0, 1.0, 2.0, 3.0, 4.0],
    } | changes
    return touches_from(**columns)  # type: ignore[arg-type]


def test_what_is_absent_is_unknown() -> None:
    touches = touches_from([5, 5, 6], [[1.0], [2.0], [3.0]])
    assert touches.sample.tolist() == [0, 1, 0]
    for column in (
        touches.time_s,
        touches.indenter_radius_mm,
        touches.load,
        touches.depth_mm,
        touches.contact,
    ):
        assert np.isnan(column).all() and column.shape == (3,)
    assert touches.angle_deg is touches.x_mm is touches.y_mm is touches.readings_sd is touches.reads is None
    assert (touches.n_rows, touches.n_touches, touches.n_elements) == (3, 2, 1)
    assert touches.in_contact.all()


def test_one_number_stands_for_every_row() -> None:
    assert touches_from([1, 2], [[1.0], [2.0]], load=3).load.tolist() == [3.0, 3.0]


@pytest.mark.parametrize("dtype", [np.float64, np.float32, np.int64])
def test_masked_values_are_missing(dtype: type) -> None:
    """What lies under a mask, here a fill value, is no reading."""
    readings = np.ma.masked_equal(np.array([[1, 9999], [3, 4]], dtype=dtype), 9999)
    touches = touches_from([1, 2], readings, load=np.ma.array([5, 6], mask=[False, True], dtype=dtype))
    np.testing.assert_array_equal(touches.readings, [[1.0, np.nan], [3.0, 4.0]])
    np.testing.assert_array_equal(touches.load, [5.0, np.nan])
    np.testing.assert_array_equal(touches.with_(readings=readings).readings, touches.readings)


def test_missing_values_of_pandas_are_missing() -> None:
    table = pd.DataFrame({"e01": [1, None], "e02": [2.5, 3.5], "load": [None, 6]}).convert_dtypes()
    assert table.dtypes.astype(str).tolist() == ["Int64", "Float64", "Int64"]
    touches = touches_from(pd.Series([1, 2], dtype="Int64"), table[["e01", "e02"]], load=table["load"])
    np.testing.assert_array_equal(touches.readings, [[1.0, 2.5], [np.nan, 3.5]])
    np.testing.assert_array_equal(touches.load, [np.nan, 6.0])
    np.testing.assert_array_equal(touches.with_(readings=table.iloc[:, 1::-1]).readings, touches.readings[:, ::-1])


def test_a_column_with_another_name_is_refused_with_those_that_are_known() -> None:
    with pytest.raises(InputError, match=r"unknown column of touches 'angle'.*did you mean angle_deg"):
        touches_from([1, 2], [[1.0], [2.0]], angle=3.0)


def test_a_column_that_is_none_is_unknown() -> None:
    made = touches_from([1, 2], [[1.0], [2.0]], load=None, angle_deg=None, reads=None)
    assert np.isnan(made.load).all() and made.angle_deg is None and made.reads is None


def test_contact_is_lost_by_contact_depth_or_load_of_zero() -> None:
    touches = touches_from(
        range(7),
        np.ones((7, 1)),
        contact=[0, 1, np.nan, 1, np.nan, np.nan, 1],
        depth_mm=[1, 0, np.nan, 1, 2, np.nan, 1],
        load=[1, 1, 0, 1, np.nan, np.nan, -0.5],
    )
    assert touches.in_contact.tolist() == [False, False, False, True, True, True, True]


def test_arrays_are_read_only_and_leave_the_callers_alone() -> None:
    mine, ids, notes = np.ones((2, 1)), np.array([1, 2]), np.array(["a", "b"], dtype=object)
    touches = touches_from(ids, mine, load=mine[:, 0], extra={"note": notes})
    with pytest.raises(ValueError, match="read-only"):
        touches.readings[0, 0] = 3.0
    mine[0, 0], ids[0], notes[0] = 2.0, 5, "c"  # still the caller's to write, without an effect on the table
    assert (touches.readings[0, 0], touches.load[0], touches.touch[0], touches.extra["note"][0]) == (1.0, 1.0, 1, "a")
    assert touches.with_(load=mine[:, 0]).readings.base is touches.readings.base  # what is read-only is not copied
    assert touches.select([0]).readings.base is not touches.readings.base


def test_wires_in_another_order_take_all_that_belongs_to_an_element_with_them() -> None:
    readings = np.array([[1.0, 2.0, 3.0]])
    touches = touches_from([4], readings, readings_sd=readings / 10, rest_reads=readings + 7, load=5.0)
    moved = touches.with_wires(np.array([2, 0, 1]))
    np.testing.assert_array_equal(moved.readings, [[3.0, 1.0, 2.0]])
    assert moved.readings_sd is not None and moved.rest_reads is not None
    np.testing.assert_array_equal(moved.readings_sd, np.array([[3.0, 1.0, 2.0]]) / 10)
    np.testing.assert_array_equal(moved.rest_reads, [[10.0, 8.0, 9.0]])
    assert (moved.load, moved.touch) == ([5.0], [4])
    assert touches_from([4], readings).with_wires(np.array([2, 0, 1])).rest_reads is None


def test_select_by_mask_index_and_slice() -> None:
    touches = finger_touches(extra={"note": ["a", "b", "c", "d", "e"]}, reads=[1, 1, 2, 1, 1])
    mask = touches.select(touches.touch == 3)
    assert same_touches(mask, touches.select([3, 4])) and same_touches(mask, touches.select(slice(3, None)))
    assert mask.touch.tolist() == [3, 3] and mask.extra["note"].tolist() == ["d", "e"]
    assert mask.angle_deg is not None and mask.angle_deg.tolist() == [-2.0, -2.0]
    assert mask.y_mm is None
    assert touches.select([]).n_rows == 0
    with pytest.raises(InputError, match=r"expected a mask of 5 rows, got shape \(4,\)"):
        touches.select(np.ones(4, dtype=bool))
    with pytest.raises(InputError, match=r"^expected a mask of the rows, their indices or a slice, got 3$"):
        touches.select(3)


def test_same_as_sees_every_difference() -> None:
    touches = finger_touches(extra={"note": list("abcde")})
    assert same_touches(touches, touches.with_(notes=("a note",)))
    assert not same_touches(touches, touches.with_(load=np.where(touches.load == 0, -0.0, touches.load)))
    assert not same_touches(touches, touches.with_(load=np.nan_to_num(touches.load)))
    assert not same_touches(touches, touches.with_(angle_deg=None))
    assert not same_touches(touches, touches.with_(extra={"note": list("abcdf")}))
    assert not same_touches(touches, touches.with_(extra={}))
    assert not same_touches(touches, touches.select([0, 1]))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"load": [1.0, 2.0]}, r"column load: expected an array of shape \(5,\), got \(2,\)"),
        ({"touch": [1.5, 2, 3, 4, 5]}, "column touch: expected integers below 2"),
        ({"touch": [2**60, 2, 3, 4, 5]}, "column touch: expected integers below 2"),
        ({"readings": [1.0, 2.0, 3.0, 4.0, 5.0]}, r"column readings: expected an array of shape \(5, 5\)"),
        (
            {"readings_sd": np.ones((5, 3))},
            r"column readings_sd: expected an array of shape \(5, 2\), got \(5, 3\)",
        ),
        ({"time_s": ["a"] * 5}, r"column time_s: expected numbers, got \['a'"),
        (
            {"time_s": np.datetime64("2026-01-01") + np.arange(5).astype("m8[ms]")},
            r"^column time_s: expected seconds as numbers, got datetime64: give seconds since the first row, "
            r"as \(t - t\[0\]\) / np.timedelta64\(1, 's'\)$",
        ),
        ({"load": np.arange(5).astype("m8[s]")}, "column load: .* got timedelta64: .*, as t / np.timedelta64"),
        ({"time_s": np.ma.array(np.arange(5).astype("m8[s]"), mask=True)}, "column time_s: .* got timedelta64"),
        ({"time_s": pd.Series(pd.date_range("2026", periods=5, tz="UTC"))}, "column time_s: .* got datetime64"),
        ({"time_s": np.datetime64("2026-01-01")}, "column time_s: .* got datetime64"),
        ({"touch": np.ma.array([1, 2, 3, 4, 5], mask=[1, 0, 0, 0, 0])}, "column touch: expected integers below 2"),
        ({"extra": ["a"]}, r"^extra: expected columns by their names, got \['a'\]$"),
        ({"extra": {"note": ["a"]}}, r"column note: expected an array of shape \(5,\), got \(1,\)"),
    ],
)
def test_arrays_that_do_not_fit(changes: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        finger_touches(**changes)


def test_means_of_samples_in_contact() -> None:
    means = finger_touches().averaged()
    # The first row of touch 7 has a load of 0, so its readings 10, 12 and 5 remain.
    assert means.touch.tolist() == [7, 3]  # in the order of the rows
    np.testing.assert_array_equal(means.readings, [[11.0, 5.0], [23.0, 7.0]])
    np.testing.assert_array_equal(means.counts, [[2, 1], [2, 1]])
    # Element 1: Σ(y-ȳ)² = 2 + 18 on 2 degrees of freedom; element 2 was never read twice.
    np.testing.assert_array_equal(means.pure_error_variance, [10.0, np.nan])
    np.testing.assert_array_equal(means.pure_error_dof, [2.0, 0.0])
    np.testing.assert_array_equal(means.load, [101.0, 200.0])
    np.testing.assert_array_equal(means.angle_deg, [1.0, -2.0])
    np.testing.assert_array_equal(means.indenter_radius_mm, [np.inf, 0.0])
    np.testing.assert_array_equal(means.time_s, [1.5, 3.5])
    assert (means.n_touches, means.n_elements) == (2, 2)
    assert means.x_mm is None and means.y_mm is None


def test_touches_without_any_row_in_contact_have_no_mean() -> None:
    none = finger_touches(contact=[0.0] * 5).averaged()
    assert none.readings.shape == (0, 2) and np.isnan(none.pure_error_variance).all()


def test_angles_are_averaged_around_the_circle() -> None:
    touches = touches_from([1, 1, 2, 2], np.ones((4, 1)), angle_deg=[179.0, -179.0, 10.0, 14.0])
    np.testing.assert_allclose(touches.averaged().angle_deg, [180.0, 12.0], rtol=1e-15)  # round-off


def test_two_indenters_in_one_touch_are_refused() -> None:
    touches = touches_from([4, 4], np.ones((2, 1)), indenter_radius_mm=[1.0, 2.0])
    with pytest.raises(InputError, match="touch 4 is made with two indenters, 1 and 2 mm"):
        touches.averaged()


@given(
    reads=st.lists(st.lists(READINGS, min_size=2, max_size=5), min_size=2, max_size=6),
    touch=st.lists(st.integers(0, 2), min_size=6, max_size=6),
)
@settings(max_examples=100, deadline=None)
def test_averaged_rows_give_what_their_raw_reads_give(reads: list[list[float]], touch: list[int]) -> None:
    ids = touch[: len(reads)]
    raw = touches_from(np.repeat(ids, [len(r) for r in reads]), np.concatenate(reads)[:, None])
    rows = touches_from(
        ids,
        [[np.mean(r)] for r in reads],
        readings_sd=[[np.std(r, ddof=1)] for r in reads],
        reads=[len(r) for r in reads],
    )
    a, b = raw.averaged(), rows.averaged()
    assert a.touch.tolist() == b.touch.tolist()
    np.testing.assert_array_equal(a.counts, b.counts)
    np.testing.assert_array_equal(a.pure_error_dof, b.pure_error_dof)
    # Round-off in sums of a few numbers up to 1e3, and of their squares.
    np.testing.assert_allclose(a.readings, b.readings, rtol=0, atol=1e-11)
    np.testing.assert_allclose(a.pure_error_variance, b.pure_error_variance, rtol=1e-10, atol=1e-8)


def test_pure_error_of_averaged_rows_is_that_of_one_read() -> None:
    generator = np.random.default_rng(1)
    sigma, n, r = 3.0, 4000, 10
    raw = generator.normal(100.0, sigma, (n, r))
    touches = touches_from(
        np.arange(n) // 2, raw.mean(axis=1)[:, None], readings_sd=raw.std(axis=1, ddof=1)[:, None], reads=r
    )
    means = touches.averaged()
    assert means.pure_error_dof[0] == n * (r - 1) + n / 2
    # Relative sd of a variance on ν degrees of freedom is √(2/ν) = 0.0073; five of these.
    assert abs(means.pure_error_variance[0] / sigma**2 - 1) < 5 * np.sqrt(2 / means.pure_error_dof[0])


def test_sd_without_number_of_reads_counts_one_degree_of_freedom() -> None:
    means = touches_from([1, 2], [[5.0], [6.0]], readings_sd=[[3.0], [4.0]]).averaged()
    assert means.pure_error_dof.tolist() == [2.0]
    assert means.pure_error_variance.tolist() == [12.5]
    assert means.counts.tolist() == [[1], [1]]


@given(st.lists(st.integers(-3, 3), max_size=30))
@settings(deadline=None)
def test_groups_number_touches_in_order_of_appearance(ids: list[int]) -> None:
    touch = np.array(ids, dtype=np.int64)
    distinct, group = groups(touch)
    assert distinct.tolist() == list(dict.fromkeys(ids))
    assert distinct[group].tolist() == ids
    seen: dict[int, int] = {}
    for identity, sample in zip(ids, numbered(touch).tolist(), strict=True):
        assert sample == seen.get(identity, 0)
        seen[identity] = sample + 1


@given(st.floats(allow_nan=False, min_value=-1e300, max_value=1e300), st.integers(1, 9))
@settings(deadline=None)
def test_the_mean_of_equal_values_is_that_value(value: float, n: int) -> None:
    assert grouped_mean(np.full(n, value), np.zeros(n, dtype=np.int64), 1)[0] == value


def test_baseline_of_a_touchs_own() -> None:
    touches = touches_from(
        [1, 1, 1, 2, 2],
        [[10.0, 1.0], [12.0, np.nan], [111.0, 5.0], [20.0, 2.0], [125.0, 6.0]],
        contact=[0, 0, 1, 0, 1],
    )
    corrected = touches.baseline_corrected()
    np.testing.assert_array_equal(
        corrected.readings, [[-1.0, 0.0], [1.0, np.nan], [100.0, 4.0], [0.0, 0.0], [105.0, 4.0]]
    )
    assert corrected.notes == ("each touch's own mean no-contact reading was subtracted",)
    np.testing.assert_array_equal(touches.rest_reading(), [14.0, 1.5])


def test_baseline_of_the_table_where_a_touch_has_none() -> None:
    touches = touches_from([1, 2, 2, 3], [[10.0], [20.0], [120.0], [115.0]], contact=[0, 0, 1, 1])
    corrected = touches.baseline_corrected()
    np.testing.assert_array_equal(corrected.readings, [[0.0], [0.0], [100.0], [100.0]])
    assert corrected.notes == (
        "the mean no-contact reading was subtracted: its own in 1 of 2 touches, "
        "that of all no-contact rows in the others",
    )
    only_apart = touches.select([0, 3]).baseline_corrected()
    assert only_apart.readings.tolist() == [[0.0], [105.0]]
    assert only_apart.notes == ("the mean of all 1 no-contact rows was subtracted",)


def test_reads_behind_a_rest_reading_count_in_the_noise_of_a_mean() -> None:
    """Touch 1 has two rest rows of its own (one of element 2), touch 2 none: n reads minus k count as n k/(n + k)."""
    touches = touches_from(
        [1, 1, 1, 1, 2],
        [[10.0, 1.0], [12.0, np.nan], [111.0, 5.0], [113.0, 5.0], [125.0, 6.0]],
        contact=[0, 0, 1, 1, 1],
    )
    corrected = touches.baseline_corrected()
    nan = np.nan
    np.testing.assert_array_equal(corrected.rest_reads, [*[[2.0, 1.0]] * 4, [nan, nan]])
    np.testing.assert_allclose(corrected.averaged().counts, [[1.0, 2 / 3], [1.0, 1.0]])
    # Read one by one, touches have the whole noise of the mean that they share, here of 2 rows (and 1 of element 2);
    # the offsets of the calibration have that of its own rest reading, here of 4 rows and of none.
    tally = RestTally.none(2).after(touches)
    alone = Baseline.of(tally, each=True).subtracted(touches)
    np.testing.assert_allclose(alone.averaged().counts, [[1.0, 2 / 3], [2 / 3, 1 / 2]])
    both = Baseline.of(tally, each=True, before=np.array([4.0, nan])).subtracted(touches)
    np.testing.assert_allclose(both.averaged().counts, [[1 / (1 / 2 + 1 / 2 + 1 / 4), 2 / 3], [1 / 1.75, 1 / 2]])
    # Touches share the error of the mean if one of them needs it, and that of the calibration's rest reading.
    shared = Baseline.of(tally, each=True, before=np.array([4.0, nan])).shared_variance
    np.testing.assert_allclose(shared, [1 / 2 + 1 / 4, 1.0])
    each_own = Baseline.of(RestTally.none(2).after(touches.select([0, 1, 2])), each=True, before=np.array([4.0, nan]))
    np.testing.assert_allclose(each_own.shared_variance, [1 / 4, 0.0])
    assert Baseline.of(tally).shared_variance is None
    given = touches.select(touches.in_contact).baseline_corrected([1.0, 2.0])
    assert given.rest_reads is None
    assert shared_rest_reads(touches.select([0, 1, 2])) is None
    np.testing.assert_array_equal(shared_rest_reads(touches), [2.0, 1.0])


def test_readings_at_rest_that_scatter_less_than_those_in_contact_count_for_more() -> None:
    """Differences of rest rows with a tenth of the sd say so: each counts for less than a hundred reads in contact."""
    rng = np.random.default_rng(1)
    rows = np.stack([rng.standard_normal(400), 0.1 * rng.standard_normal(400), np.zeros(400)], axis=1)
    table = touches_from(np.arange(400), rows, contact=0)
    whole = RestTally.none(3).after(table)
    reads = whole.reads(np.ones(3))
    # 399 differences are worth 266 squares: their 5 % quantile is 0.86 of their mean, and scatters by 9 %.
    assert reads[0] == 1.0 and 100 * 0.65 < reads[1] < 100 and reads[2] == np.inf
    np.testing.assert_array_equal(whole.reads(np.full(3, np.nan)), 1.0)
    np.testing.assert_array_equal(RestTally.none(3).after(table.select([0])).reads(np.ones(3)), 1.0)
    assert RestTally.none(3).after(table.select(np.arange(4))).reads(np.ones(3))[0] == 1.0
    pieces = RestTally.none(3).after(table.select(np.arange(150))).after(table.select(np.arange(150, 400)))
    np.testing.assert_array_equal(pieces.reads(np.ones(3)), reads)


def test_no_baseline_leaves_the_readings_and_says_so() -> None:
    touches = finger_touches(load=[1.0] * 5)
    corrected = touches.baseline_corrected()
    assert same_touches(corrected, touches)
    assert corrected.notes == ("no reading without contact: readings are taken as they are",)
    assert touches.rest_reading() is None


def test_a_baseline_from_elsewhere() -> None:
    touches = touches_from([1, 2], [[5.0, 6.0], [7.0, 8.0]])
    corrected = touches.baseline_corrected(rest=[1.0, np.nan])
    assert corrected.readings.tolist() == [[4.0, 6.0], [6.0, 8.0]]
    assert corrected.notes == ("the rest reading given was subtracted (e02: no such reading, left as it is)",)
    with pytest.raises(InputError, match=r"expected a rest reading of 2 elements, got shape \(3,\)"):
        touches.baseline_corrected(rest=[1.0, 2.0, 3.0])


def test_averaged_no_contact_rows_weigh_by_their_reads() -> None:
    touches = touches_from([1, 2], [[0.0], [8.0]], contact=[0, 0], reads=[3, 1])
    assert touches.rest_reading().tolist() == [2.0]


def test_usable_elements() -> None:
    touches = touches_from(range(3), [[1, np.nan, 5, 1], [1, np.nan, np.nan, 2], [1, np.nan, np.nan, 3]])
    assert touches.usable_elements.tolist() == [False, False, True, True]
