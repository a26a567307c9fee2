"""The calibration after a diagnosis reads no quantity worse than that before: which model is returned, and why."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from independent.dataset import simulate, write
from independent.effects import Effect
from independent.finger import SMALL, Recording
from scipy import stats

import bayestouch
from bayestouch.diagnosis.harm import harmless, references_believed, worse_quantities_of
from bayestouch.diagnosis.outcome import sentences
from bayestouch.effects.random import GainDrift
from bayestouch.model.held_out import HeldOut

N, M = 60, 3


def held(residual: np.ndarray, design: np.ndarray, volume: float = 0.0, present: np.ndarray | None = None) -> HeldOut:
    """Whitened residuals (t, m) with their uncertainty (t m, q)."""
    made: Any = object.__new__(HeldOut)
    shown = np.full(residual.shape, True) if present is None else present
    fields = {"whitened": residual, "design": design, "log_volume": np.full(len(residual), volume), "present": shown}
    for name, value in fields.items():
        object.__setattr__(made, name, value)
    return made  # type: ignore[no-any-return]


def model(
    held_out: HeldOut | None,
    stated: dict[str, np.ndarray],
    corrected: dict[str, np.ndarray] | None = None,
    with_edge: np.ndarray | None = None,
) -> Any:
    read = SimpleNamespace(by_touch=stated, by_touch_corrected=corrected or stated, with_edge=with_edge)
    return SimpleNamespace(held_out=held_out, read=read if stated else None, fitted=SimpleNamespace(drifts=()))


def test_log_density_of_touches_is_the_normal_one() -> None:
    """Of readings with their covariance C = L Lᵀ of noise, and B Bᵀ of what the fit leaves open."""
    rng = np.random.default_rng(0)
    root = np.tril(rng.standard_normal((M, M)))
    root[np.diag_indices(M)] = np.abs(root.diagonal()) + 0.5
    open_ = rng.standard_normal((N * M, 4))
    residual = rng.standard_normal((N, M))
    white = np.linalg.inv(root)
    design = np.concatenate([white @ rows for rows in open_.reshape(N, M, -1)])
    found = held(residual @ white.T, design, float(np.log(np.diagonal(white)).sum())).log_density
    expected = [
        stats.multivariate_normal(np.zeros(M), root @ root.T + rows @ rows.T).logpdf(row)
        for row, rows in zip(residual, open_.reshape(N, M, -1), strict=True)
    ]
    np.testing.assert_allclose(found - 0.5 * M * np.log(2 * np.pi), expected)


@pytest.mark.parametrize(("standard_errors", "worse"), [(1.9, False), (2.1, True), (-5.0, False)])
def test_worse_is_a_larger_squared_error_touch_by_touch(standard_errors: float, worse: bool) -> None:
    """Paired: both scatter by far more than they differ."""
    rng = np.random.default_rng(1)
    before = rng.uniform(5.0, 50.0, N)
    change = rng.standard_normal(N)
    change = (change - change.mean()) / change.std(ddof=1)
    after = before + change + standard_errors / np.sqrt(N)
    one, two = (model(None, {"R_rms_mm": np.sqrt(each), "R_bias_mm": each}) for each in (before, after))
    found = worse_quantities_of(one, two, believed=True)
    assert [each.key for each in found] == (["R_rms_mm"] if worse else [])
    # Touches of which a quantity is not known count for nothing.
    unknown = np.append(np.sqrt(after), np.nan)
    two = model(None, {"R_rms_mm": unknown, "R_bias_mm": unknown})
    one = model(None, {"R_rms_mm": np.append(np.sqrt(before), 1.0), "R_bias_mm": unknown})
    assert bool(worse_quantities_of(one, two, believed=True)) == worse


@pytest.mark.parametrize(("standard_errors", "worse"), [(2.9, False), (3.1, True)])
def test_other_tips_than_edges_are_compared_alone(standard_errors: float, worse: bool) -> None:
    """Edges are read much better, and others worse; all touches together are read better."""
    rng = np.random.default_rng(4)
    edge = np.arange(N) < N // 2
    change = rng.standard_normal(N)
    change[~edge] = (change[~edge] - change[~edge].mean()) / change[~edge].std(ddof=1)
    change[~edge] += standard_errors / np.sqrt((~edge).sum())
    change[edge] -= 9.0
    before = rng.uniform(20.0, 50.0, N)
    one, two = (model(None, {"theta_rms_deg": np.sqrt(each)}, with_edge=edge) for each in (before, before + change))
    found = worse_quantities_of(one, two, believed=True)
    assert [(each.key, each.touches) for each in found] == ([("theta_rms_deg", "with other tips")] if worse else [])
    if worse:
        assert found[0].after > found[0].before == pytest.approx(np.sqrt(before[~edge].mean()))
    # an edge that is damaged is no reference for R; on a pad there are no edges
    for other in (~edge, None):
        one, two = (model(None, each.read.by_touch, with_edge=other) for each in (one, two))
        assert not worse_quantities_of(one, two, believed=True)


def test_one_large_error_does_not_hide_the_others() -> None:
    """All squared errors grow from 1 to 4; in one touch from 1 to 400: the mean is not clear, the ranks are."""
    after = np.full(N, 4.0) + 0.01 * np.arange(N)
    after[7] = 400.0
    change = after - 1
    assert change.mean() < 2 * change.std(ddof=1) / np.sqrt(N)
    one, two = (model(None, {"R_rms_mm": np.sqrt(each)}) for each in (np.ones(N), after))
    assert [each.key for each in worse_quantities_of(one, two, believed=True)] == ["R_rms_mm"]
    # Where the mean falls, small errors that grow do not count: large ones were mended.
    before = np.ones(N)
    before[:5] = 300.0
    one = model(None, {"R_rms_mm": np.sqrt(before)})
    two = model(None, {"R_rms_mm": np.sqrt(np.full(N, 4.0))})
    assert not worse_quantities_of(one, two, believed=True)


@pytest.mark.parametrize(
    ("time", "own", "key", "worse"),
    [
        # One block of two correlation times, eight of them, and five.
        (400.0, 0.0, "P_rms_N_per_m", False),
        (30.0, 0.0, "P_rms_N_per_m", True),
        (49.0, 0.0, "P_rms_N_per_m", False),
        (400.0, 1.0, "P_rms_N_per_m", True),
        (400.0, 0.0, "theta_rms_deg", True),
        (400.0, 0.0, "P_rms_N", True),  # of a pad, whose reader does not follow drifts
    ],
)
def test_loads_that_share_a_drift_are_one_comparison(time: float, own: float, key: str, worse: bool) -> None:
    """The load of each touch is 7 N/m off with the drift instead of 3, all in one direction."""
    rng = np.random.default_rng(5)
    one, two = (model(None, {key: size + rng.normal(0.0, 0.5, N)}) for size in (3.0, 7.0))
    drift = GainDrift(()), (0.05, time, own)
    observed = SimpleNamespace(touch_time_s=np.linspace(0.0, 480.0, N, endpoint=False))
    two.held_out, two.fitted = SimpleNamespace(observed=observed), SimpleNamespace(drifts=(drift,))
    assert [each.key for each in worse_quantities_of(one, two, believed=True)] == ([key] if worse else [])


def test_moved_references_count_where_they_are_believed() -> None:
    rng = np.random.default_rng(2)
    small, large = rng.normal(0, 0.1, N), rng.normal(1.0, 0.1, N)
    before, after = (
        model(None, {"theta_rms_deg": small}),
        model(None, {"theta_rms_deg": large}, {"theta_rms_deg": small}),
    )
    assert not worse_quantities_of(before, after, believed=True)
    (found,) = worse_quantities_of(before, after, believed=False)
    assert (found.key, found.before) == ("theta_rms_deg", pytest.approx(np.sqrt(np.mean(small**2))))
    assert found.after == pytest.approx(np.sqrt(np.mean(large**2)))


def test_worse_predictions_of_readings_are_refused_without_reading() -> None:
    """Of touches whose readings both models have: one takes a large residual for a wrong reading and leaves it out."""
    rng = np.random.default_rng(3)
    none = np.zeros((N * M, 0))
    good = rng.standard_normal((N, M))
    assert [
        each.key
        for each in worse_quantities_of(model(held(good, none), {}), model(held(2 * good, none), {}), believed=True)
    ] == ["log_density"]
    left_out = np.full((N, M), True)
    left_out[:50] = False
    # Where they differ nothing is compared; the ten that are left are the same.
    other = np.where(left_out, good, 100.0)
    assert not worse_quantities_of(
        model(held(good, none), {}), model(held(other, none, present=left_out), {}), believed=True
    )


def test_the_first_model_that_is_not_worse_is_returned() -> None:
    rng = np.random.default_rng(4)
    errors = rng.normal(0, 1, N)
    before, same, bad = (model(None, {"R_rms_mm": k * errors}) for k in (1.0, 0.9, 2.0))
    made: list[str] = []

    def make(name: str, each: Any) -> Any:
        made.append(name)
        return each

    after, refused = harmless(
        before,
        (lambda: make("none", None), lambda: make("bad", bad), lambda: make("same", same), lambda: make("last", bad)),
        believed=True,
    )
    assert after is same and [each.model for each in refused] == [bad]
    # A model that is not needed is not made.
    assert made == ["none", "bad", "same"]
    assert harmless(before, (lambda: bad,), believed=True)[0] is before


@pytest.mark.parametrize(
    ("rivals", "left", "believed"), [((), False, True), ((), True, False), (("crosstalk",), False, False)]
)
def test_references_are_believed_to_be_off_where_nothing_else_explains_it(
    rivals: tuple[str, ...], left: bool, believed: bool
) -> None:
    effect = SimpleNamespace(name="prober_eccentricity")
    rounds: Any = (
        SimpleNamespace(added=SimpleNamespace(effect=SimpleNamespace(name="creep"), indistinguishable=("memory",))),
        SimpleNamespace(added=SimpleNamespace(effect=effect, indistinguishable=rivals)),
        SimpleNamespace(added=None),
    )
    remaining: Any = SimpleNamespace(after=SimpleNamespace(there=left))
    assert references_believed(rounds, remaining, ("prober_eccentricity",)) == believed


def twice_around(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The reference angle is off by value · sin 2θ, which no effect of the catalogue is."""
    return replace(r, press=replace(r.press, angle=r.press.angle + value * np.sin(2 * np.radians(r.commanded))))


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "size", "used"), [(1, 1.0, False), (3, 2.0, True)])
def test_a_reference_angle_that_is_off_turns_no_finger(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, seed: int, size: float, used: bool
) -> None:
    """1° or 2° sin 2θ: touches are read no farther from where they really are than before, used or not.

    On one finger another effect explains the readings as well, so that references are left as they are stated; on the
    other none does, and the location of the whole finger stays where it was stated.
    """
    monkeypatch.setattr("independent.dataset.value_of_size", lambda plain, effect, wanted, seed, index: wanted)
    effect = Effect("twice around", "sine", "before", 1.0, 5.0, twice_around)
    simulated = simulate(SMALL, [(effect, size)], seed)
    path = write(simulated, tmp_path / "finger")
    (path / "truth.json").unlink()
    dataset = bayestouch.load_dataset(path)
    diagnosis = bayestouch.diagnose(dataset, draws=200, seed=0)
    assert diagnosis.effects == ("prober_eccentricity",)
    recording = simulated.recording
    errors = {}
    for when in ("before", "after"):
        read = bayestouch.infer(
            dataset.touches, getattr(diagnosis, f"calibration_{when}"), method="importance", draws=500, seed=3
        )
        true = recording.press.angle[recording.parts[0] : recording.parts[0] + recording.parts[1]][read.rows.touch]
        errors[when] = read.mean("theta_c") - true
    rms = {when: float(np.sqrt(np.mean(error**2))) for when, error in errors.items()}
    numbers = diagnosis.numbers
    assert diagnosis.calibration_after is (
        diagnosis.traced.explained.calibration if used else diagnosis.calibration_before
    )
    if used:
        # 0.81° before, and 0.10° after. The finger as a whole is not turned: by 0.18° where the cosine turns it, too.
        assert rms["after"] < 0.3 * rms["before"] and abs(errors["after"].mean()) < 0.02
        assert not numbers["not_used"] and diagnosis.verdict == "explained"
    else:
        assert rms["after"] == rms["before"] and numbers["after"] == numbers["before"]
        (refused,) = numbers["not_used"]
        assert refused["worse"]["theta_rms_deg"]["after"] > 3 * refused["worse"]["theta_rms_deg"]["before"]
        # The verdict is that of the numbers beside it: what is returned leaves the misfit.
        assert numbers["after"]["lack_of_fit"] > numbers["lack_of_fit_limits"]["after"]["high"]
        assert diagnosis.verdict == "partly explained"
        first = sentences(numbers)[0]
        assert "Not used for reading: prober_eccentricity" in first and "rms error of the location" in first
