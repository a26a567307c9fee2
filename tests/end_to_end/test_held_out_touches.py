"""No touch is both fitted and held out, whatever the layout; and what is held out leaves no trace in a fit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import written_out as w
from calibrated_files import Calibrated
from pad_simulation import grid, line, square

import bayestouch.finger.beginning
import bayestouch.pad.beginning
import bayestouch.reporting.gather as gathering
from bayestouch.data.dataset import DataSet
from bayestouch.data.splits import with_calibration
from bayestouch.data.touches import Touches, touches_from
from bayestouch.diagnosis import diagnose
from bayestouch.diagnosis.comparison import FOLDS, folds
from bayestouch.effects.random import BaselineDrift
from bayestouch.finger.start import base_fit
from bayestouch.model.fitting import fit
from bayestouch.model.predictive import held_out_density
from bayestouch.model.split_data import SplitData

M = w.ELEMENTS


def edges(seed: int, n: int, *, known: bool = True, rest: bool = False, samples: int = 2) -> Touches:
    """n edge touches all around in any order, every reading its own number; the first of them at rest if asked."""
    rng = np.random.default_rng(seed)
    angle = np.radians(rng.permutation(np.linspace(-30, 30, n)))
    pressed = w.Pressed(np.zeros(n), angle, rng.uniform(160, 240, n))
    table = w.recorded(w.true_finger(), pressed, rng, samples=samples)
    if not known:
        table = table.with_(indenter_radius_mm=np.full(table.n_rows, np.nan))
    return table.with_(load=np.where(table.touch == 0, 0.0, table.load)) if rest else table


def pads(n: int, dimensions: int) -> DataSet:
    """One table of touches on a pad."""
    pad, rng = (line(), square())[dimensions - 1], np.random.default_rng(n)
    place = np.linspace(6, 34, n)[:, None] if dimensions == 1 else grid(3, 19, int(np.sqrt(n)), 2)
    return replace(pad.dataset(pad.touch(place, rng, samples=3)), calibration=None)


def two(calibration: int, read: int, **changes: bool) -> DataSet:
    """Two tables whose touches have the same numbers."""
    return w.dataset(edges(1, calibration), edges(2, read, **changes))


def shuffled(dataset: DataSet) -> DataSet:
    """Touches in another order under scattered numbers."""
    rng = np.random.default_rng(0)

    def other(table: Touches) -> Touches:
        order = rng.permutation(np.unique(table.touch))
        rows = np.concatenate([np.flatnonzero(table.touch == one) for one in order])
        return table.select(rows).with_(touch=(1000 - 7 * table.touch)[rows])

    calibration = None if dataset.calibration is None else other(dataset.calibration)
    return replace(dataset, calibration=calibration, touches=other(dataset.touches))


#: Data sets by layout, and how many touches of each are held out.
LAYOUTS: dict[str, tuple[Callable[[], DataSet], int]] = {
    "two tables": (lambda: two(60, 50), 25),
    "two tables, some at rest": (lambda: two(60, 51, rest=True), 25),
    "two tables, few to be read": (lambda: two(60, 12), 15),
    "two tables, none known to be read": (lambda: two(60, 50, known=False), 15),
    "two tables, few of each": (lambda: two(30, 12), 0),
    "one table": (lambda: w.dataset(None, edges(3, 80)), 20),
    "one table, few": (lambda: w.dataset(None, edges(3, 30)), 0),
    "shuffled": (lambda: shuffled(two(60, 50)), 25),
    "one table, shuffled": (lambda: shuffled(w.dataset(None, edges(3, 80))), 20),
    "a line": (lambda: pads(80, 1), 20),
    "a plane": (lambda: pads(400, 2), 100),
    "a plane, few": (lambda: pads(25, 2), 0),
    "a plane in two tables": (lambda: with_calibration(pads(400, 2)), 100),
}


def marks(table: Touches, rows: np.ndarray) -> set[bytes]:
    """Rows in contact by what they read: noise makes every reading one of its own."""
    return {row.tobytes() for row in np.round(table.readings[rows & table.in_contact], 9)}


@pytest.mark.parametrize("layout", LAYOUTS)
def test_no_touch_is_fitted_and_held_out(layout: str) -> None:
    make, count = LAYOUTS[layout]
    data = SplitData.of(make())
    fitted, held = (set(data.table.touch[rows]) for rows in (data.training, data.held_out))
    assert fitted and not fitted & held
    assert not marks(data.table, data.training) & marks(data.table, data.held_out)
    # whole touches, on one side each
    for rows, ids in ((data.training, fitted), (data.held_out, held)):
        np.testing.assert_array_equal(rows, np.isin(data.table.touch, list(ids)))
    assert data.n_held_out == len(held) == pytest.approx(count, abs=2 if count else 0)
    observed = data.observations(data.training)
    assert not marks(data.table, data.held_out) & marks(observed.table, np.ones(observed.table.n_rows, bool))
    assert set(observed.means.touch) == set(np.unique(data.table.touch[data.training & data.table.in_contact]))
    if held:
        assert set(data.observations(data.held_out).means.touch) == held


@pytest.mark.parametrize("layout", ["one table", "one table, shuffled", "a line", "a plane"])
def test_tables_that_a_diagnosis_parts_share_no_touch(layout: str) -> None:
    """What the data set of a diagnosis calls its calibration is none of its touches to be read."""
    data = SplitData.of(LAYOUTS[layout][0]())
    assert data.dataset.calibration is not None
    assert not set(data.dataset.calibration.touch) & set(data.dataset.touches.touch)


def test_calibration_touches_alone_hold_out_none_and_see_no_other() -> None:
    data = SplitData.of_calibration(two(60, 50))
    assert data.n_held_out == 0
    np.testing.assert_array_equal(data.table.readings, two(60, 50).calibration.readings)


@pytest.mark.parametrize("make", [lambda: pads(400, 2), lambda: w.dataset(None, edges(3, 80))])
def test_a_split_table_calibrates_with_touches_that_it_does_not_read(make: Callable[[], DataSet]) -> None:
    """The split that `calibrate` and `report` make of one table."""
    parted = with_calibration(make())
    assert parted.calibration is not None
    touched = [set(table.touch[table.in_contact]) for table in (parted.calibration, parted.touches)]
    assert not touched[0] & touched[1]
    both = [marks(table, np.ones(table.n_rows, bool)) for table in (parted.calibration, parted.touches)]
    assert not both[0] & both[1]


def test_thinned_training_stays_apart() -> None:
    """In a pad of too many touches the search uses some of its training touches and no other; calibrations use all."""
    data = SplitData.of(pads(400, 2))
    thin = data.thinned(50, 3)
    fitted = set(thin.table.touch[thin.searched])
    assert len(fitted) == 50
    assert fitted <= set(data.table.touch[data.training])
    np.testing.assert_array_equal(thin.training, data.training)
    np.testing.assert_array_equal(thin.held_out, data.held_out)
    assert data.thinned(None, 3) is data and data.thinned(400, 3) is data


@pytest.mark.parametrize("make", [lambda: pads(400, 2), lambda: w.dataset(None, edges(3, 80))])
def test_the_four_splits_of_one_table_hold_out_each_touch_once(make: Callable[[], DataSet]) -> None:
    splits = [SplitData.of(make(), fold) for fold in range(4)]
    times = sum(each.held_out.astype(int) for each in splits)
    located = splits[0].training | splits[0].held_out
    np.testing.assert_array_equal(times, located.astype(int))


class Stop(Exception):
    """Enough was seen."""


def seen_by_fit(module: object, name: str, dataset: DataSet, monkeypatch: pytest.MonkeyPatch, **options: object):
    """Arguments of the first fit of a diagnosis, and what it holds out."""
    caught: dict[str, object] = {}

    def spy(*given: object, **named: object) -> None:
        caught["given"] = given
        raise Stop

    monkeypatch.setattr(module, name, spy)
    with pytest.raises(Stop):
        diagnose(dataset, draws=8, sample=False, seed=0, **options)
    return caught["given"]


@pytest.mark.parametrize("layout", ["two tables", "two tables, few to be read", "one table"])
def test_the_fit_of_a_diagnosed_finger_sees_no_held_out_reading(layout: str, monkeypatch: pytest.MonkeyPatch) -> None:
    dataset = LAYOUTS[layout][0]()
    observed = seen_by_fit(bayestouch.finger.beginning, "finger_start", dataset, monkeypatch, contact="layer")[0]
    held = SplitData.of(dataset)
    seen = marks(observed.table, np.ones(observed.table.n_rows, bool))
    assert seen == marks(held.table, held.training) and not seen & marks(held.table, held.held_out)


@pytest.mark.parametrize("layout", ["a line", "a plane"])
def test_the_fit_of_a_diagnosed_pad_sees_no_held_out_reading(layout: str, monkeypatch: pytest.MonkeyPatch) -> None:
    dataset = LAYOUTS[layout][0]()
    observed, table, *_ = seen_by_fit(bayestouch.pad.beginning, "pad_fit", dataset, monkeypatch, kernel=None)
    held = SplitData.of(dataset)
    for each in (observed.table, table):
        assert not marks(each, np.ones(each.n_rows, bool)) & marks(held.table, held.held_out)


def test_a_report_calibrates_with_touches_that_it_does_not_read(monkeypatch: pytest.MonkeyPatch) -> None:
    caught = {}

    def spy(dataset: DataSet, **options: object) -> None:
        caught["dataset"] = dataset
        raise Stop

    monkeypatch.setattr("bayestouch.calibration.calibrate", spy)
    with pytest.raises(Stop):
        gathering.gather(pads(400, 2), lambda evidence, _: evidence, seed=0, draws=64, plug_in=False)
    parted = caught["dataset"]
    assert not marks(parted.calibration, np.ones(parted.calibration.n_rows, bool)) & marks(
        parted.touches, np.ones(parted.touches.n_rows, bool)
    )


def test_held_out_readings_change_no_calibration(tmp_path: Path) -> None:
    """Held-out touches that read nonsense leave the first fit as it was, to the last bit."""
    dataset = two(40, 40)
    data = SplitData.of(dataset)
    second = data.session == 1
    wrong = np.where(data.held_out[second, None], 1234.5, dataset.touches.readings)
    spoilt = SplitData.of(replace(dataset, touches=dataset.touches.with_(readings=wrong)))
    np.testing.assert_array_equal(spoilt.held_out, data.held_out)
    one, other = (base_fit(each.observations(each.training), w.sensor(), "layer") for each in (data, spoilt))
    np.testing.assert_array_equal(one.vector, other.vector)
    np.testing.assert_array_equal(one.noise.sd, other.noise.sd)


@pytest.mark.parametrize("drifting", [False, True])
def test_folds_predict_from_the_other_folds_alone(drifting: bool, well_known: Calibrated) -> None:
    """Log predictive density of each touch against the joint normal of all readings, conditioned on other folds'.

    Each touch is in one fold, of blocks that follow each other in time.
    """
    data = SplitData.of_calibration(w.dataset(well_known.table, well_known.table))
    fitted = base_fit(data.observations(data.training), data.dataset.sensor, "layer")
    if drifting:
        drift = BaselineDrift.suited(data.setting("layer", fitted.model.reference_load))
        assert isinstance(drift, BaselineDrift)
        fitted = fit(fitted.model, fitted.vector, fitted.noise, ((drift, (0.02, 150.0)),))
    fold = folds(fitted)
    assert fold.shape == (50,) and set(fold) == set(range(FOLDS))
    # 50 touches in blocks of three, dealt out in turn: touches of a fold are never next to another fold's alone
    np.testing.assert_array_equal(fold, (np.arange(50) // 3) % 8)
    linear, t = fitted.linear, 50
    columns = linear.jacobian @ np.diag(linear.precision**-0.5)
    mean = linear.jacobian @ linear.pull
    if linear.functions is not None:
        raw = linear.functions.raw
        white = np.einsum("tij,ktj->tik", fitted.whitening.root, raw).reshape(t * M, -1)
        columns = np.concatenate([columns, white], axis=1)
    total = columns @ columns.T + np.eye(t * M)
    left = linear.residual.ravel() - mean
    found = held_out_density(linear, fold)
    for k in range(FOLDS):
        outside = np.repeat(fold != k, M)
        for touch in np.flatnonzero(fold == k):
            rows = np.arange(touch * M, (touch + 1) * M)
            gain = np.linalg.solve(total[np.ix_(outside, outside)], total[np.ix_(outside, rows)]).T
            error = left[rows] - gain @ left[outside]
            covariance = total[np.ix_(rows, rows)] - gain @ total[np.ix_(outside, rows)]
            _, volume = np.linalg.slogdet(covariance)
            expected = -0.5 * (error @ np.linalg.solve(covariance, error) + volume)
            assert found[touch, 0] == pytest.approx(expected, abs=1e-4 * max(1, abs(expected)))
            assert found[touch, 2] == pytest.approx(-0.5 * error @ error, abs=1e-4 * max(1, error @ error))


def test_touches_of_both_tables_are_numbered_apart() -> None:
    """Touch 3 of one table is not touch 3 of the other: a table joined of both keeps them apart."""
    data = SplitData.of(two(60, 50))
    assert len(np.unique(data.table.touch)) == 110
    both = touches_from(touch=[1, 1, 2], readings=np.arange(3.0)[:, None], x_mm=[0.0, 0.0, 1.0])
    assert both.n_touches == 2
