"""Numbers of a report on posteriors of a few touches, worked out by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayestouch.chain.noise import Noise
from bayestouch.reporting import next_steps, peak_table, phrases, places, residuals, trust
from bayestouch.reporting.differences import (
    error_summary,
    estimate_errors,
    load_errors,
    load_summary,
    reference_composite_radius,
    three,
)
from bayestouch.reporting.pad import numbers as pad_numbers
from bayestouch.reporting.pad.locations import inside_array, pad_errors
from bayestouch.reporting.pad.numbers import _spacing

NAN = np.nan


def posteriors(draws: dict[str, list[list[float]]], **changes: Any) -> Any:
    """Posteriors of draws (n, t) in one chain."""
    made = {name: np.array(values)[None] for name, values in draws.items()}
    units = {"theta_c": "degree", "R": "mm", "P": "N/m", "x": "mm", "y": "mm"}
    values: dict[str, Any] = {
        "posterior": made,
        "parameters": [SimpleNamespace(name=name, unit=units[name]) for name in draws],
        "sample_stats": {},
        "settings": {},
        "reference": {},
        "rows": None,
        "mean": lambda name: made[name].mean(axis=(0, 1)),
        "sd": lambda name: made[name].std(axis=(0, 1)),
    }
    return SimpleNamespace(**(values | changes))


def test_errors_of_angles_go_around() -> None:
    made = posteriors({"theta_c": [[179.0], [181.0]], "R": [[1.0], [3.0]]})
    made.reference = {"theta_c": np.array([-179.0]), "R": np.array([5.0])}
    assert estimate_errors(made, "theta_c") == [-1.0] and estimate_errors(made, "R") == [-3.0]


def test_summaries() -> None:
    found = error_summary([1.0, -3.0, NAN, 2.0])
    assert (found["n"], found["bias"], found["median_abs"]) == (3, 0.0, 2.0)
    assert found["sd"] == pytest.approx(np.sqrt(14 / 2)) and found["rms"] == pytest.approx(np.sqrt(14 / 3))
    assert found["abs_90"] == pytest.approx(2.8) and error_summary([4.0])["sd"] is None
    assert error_summary([NAN]) == {"n": 0, "bias": None, "sd": None, "rms": None, "median_abs": None, "abs_90": None}
    assert three([2.0, NAN, 6.0, 1.0]) == {"minimum": 1.0, "average": 3.0, "maximum": 6.0}
    assert three([np.inf]) == {"minimum": None, "average": None, "maximum": None}
    # 1/R = 1/r_c + 1/r_b: an edge is 0, a flat the finger itself.
    np.testing.assert_allclose(reference_composite_radius([0.0, 6.0, np.inf, NAN], 12.0), [0, 4, 12, NAN])


def evidence(**changes: Any) -> Any:
    return SimpleNamespace(**({"without_load": None} | changes))


def test_errors_of_the_load() -> None:
    """Read without the force sensor, against it; a share of the mean load."""
    with_load = posteriors({"P": [[1.0, 1.0]]}, rows=SimpleNamespace(load=np.array([10.0, 30.0])))
    unseen = posteriors({"P": [[11.0, 28.0], [13.0, 30.0]]})
    made = evidence(posteriors=with_load, without_load=unseen)
    np.testing.assert_array_equal(load_errors(made), [2.0, -1.0])
    found = load_summary(made)
    assert found["unit"] == "N/m" and found["rms_percent"] == pytest.approx(100 * np.sqrt(2.5) / 20)
    without = evidence(posteriors=with_load)
    assert np.isnan(load_errors(without)).all() and load_summary(without)["rms_percent"] is None


def test_the_load_of_a_pad_is_in_the_unit_in_which_it_is_read(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without measured loads in the calibration it is a share, which has no unit."""
    monkeypatch.setattr(pad_numbers, "location_errors", lambda made: np.full((1, 1), NAN))
    monkeypatch.setattr(pad_numbers, "inside_array", lambda made: np.array([False]))
    share = posteriors({"x": [[1.0], [2.0]], "P": [[1.0], [1.2]]}, rows=SimpleNamespace(load=np.array([NAN])))
    share.parameters[1].unit = ""
    made = evidence(posteriors=share)
    # The first screen then has no load.
    assert [(each.name, each.unit) for each in pad_numbers.headline_quantities(made)] == [("location", "mm")]
    assert load_summary(made)["unit"] == ""
    share.parameters[1].unit = "N"
    assert [(each.name, each.unit) for each in pad_numbers.headline_quantities(made)] == [
        ("location", "mm"),
        ("load", "N"),
    ]


def test_convergence() -> None:
    """Limits themselves are passes; a proposal's grade may be missing, any other may not."""
    stats = {
        "ess_bulk": np.array([400.0, 399.0, NAN, 900.0]),
        "rhat": np.array([1.02, 1.0, 1.0, 1.03]),
        "pareto_k": np.array([0.5, 0.51, NAN, 0.1]),
        "round": np.array([1, 2, 1, 3]),
    }
    found = trust.convergence(posteriors({}, rows=SimpleNamespace(touch=np.arange(4)), sample_stats=stats))
    assert (found["touches"], found["missed"], found["second_round"]) == (4, 3, 2)
    grades = {row["name"]: row for row in found["grades"]}
    assert [grades[name]["missed"] for name in ("ess_bulk", "rhat", "pareto_k")] == [2, 1, 1]
    assert [grades[name]["worst"] for name in ("ess_bulk", "rhat", "pareto_k")] == [399.0, 1.03, 0.51]
    assert [grades[name]["median"] for name in ("ess_bulk", "rhat", "pareto_k")] == [400.0, 1.01, 0.5]
    assert [grades[name]["demand"] for name in ("ess_bulk", "rhat")] == ["at least 400", "at most 1.020"]
    assert grades["pareto_k"]["demand"] == "at most 0.5"
    assert "acceptance" not in grades
    # few draws have targets of their own, which the result states
    few = {"least_ess": 102.4, "largest_rhat": 1 + 3 / 64}
    stats = {"ess_bulk": np.array([102.4, 102.0]), "rhat": np.array([1.046, 1.047])}
    found = trust.convergence(
        posteriors({}, rows=SimpleNamespace(touch=np.arange(2)), sample_stats=stats, settings=few)
    )
    assert [row["demand"] for row in found["grades"]] == ["at least 102.4", "at most 1.047"]
    assert [row["missed"] for row in found["grades"]] == [1, 1] and found["missed"] == 1
    # An R-hat that meets its target is not shown as one above it: 1.0467 is not "1.05" beside "at most 1.047".
    of_page = trust.grade_rows([{"name": "rhat", "worst": 1.0467, "median": 1.0101}])
    assert (of_page[0]["worst"], of_page[0]["median"]) == ("1.047", "1.010")
    other = trust.grade_rows([{"name": "ess_bulk", "worst": 115.31, "median": None}])
    assert (other[0]["worst"], other[0]["median"]) == ("115", "–")
    old = posteriors(
        {}, rows=SimpleNamespace(touch=np.arange(2)), sample_stats={"second_round": np.array([True, True])}
    )
    assert trust.convergence(old)["second_round"] == 2


@pytest.mark.parametrize(("ess", "rhat", "met"), [(400, 1.02, True), (399, 1.02, False), (400, 1.021, False)])
def test_convergence_of_a_calibration(ess: float, rhat: float, met: bool) -> None:
    """Of 4 · 400 draws, whose targets are those of many; 4 · 25 draws need 40 % of their number, and 1 + 32/100."""
    made: Any = SimpleNamespace(statistics={"ess_bulk": ess, "rhat": rhat}, posterior={"sigma": np.zeros((4, 400))})
    found = trust.calibration_convergence(made)
    grades = {"ess_bulk": ess, "rhat": rhat, "acceptance": None, "met": met}
    assert found == {**grades, "draws": 1600, "least_ess": 400.0, "largest_rhat": 1.02}
    made.posterior = {"sigma": np.zeros((4, 25))}
    few = trust.calibration_convergence(made)
    assert few is not None and few["met"]
    assert (few["draws"], few["least_ess"], few["largest_rhat"]) == (100, 40.0, pytest.approx(1.32))
    assert trust.calibration_convergence(SimpleNamespace(statistics={"ess_bulk": 1.0})) is None  # type: ignore[arg-type]


def test_coverage() -> None:
    """Ranks of the reference among 20 draws 0.5, 1.5, ...; central intervals of 50, 80, 90 and 95 %."""
    draws = np.arange(20.0)[:, None] + 0.5
    reference = np.array([0.0, 1.0, 2.0, 5.0, 10.0, 15.0, 18.0, 19.0, 20.0, NAN])
    made = posteriors({"R": np.tile(draws, 10).tolist()}, reference={"R": reference})
    made.rows = SimpleNamespace(radius_mm=np.full(10, 3.0))
    (row,) = trust.coverage(evidence(posteriors=made))
    # |rank - 1/2| of nine touches: 0.5, 0.45, 0.4, 0.25, 0, 0.25, 0.4, 0.45, 0.5
    wanted = {"50": 300 / 9, "80": 500 / 9, "90": 700 / 9, "95": 700 / 9}
    assert row["percent_inside"] == pytest.approx(wanted)
    assert (row["parameter"], row["unit"], row["touches"]) == ("R", "mm", 9)
    assert row["se_90"] == pytest.approx(100 * np.sqrt(0.09 / 9))
    # Edges and flats are ends of the prior and are left out.
    made.rows.radius_mm = np.array([0.0, np.inf, NAN, *[3.0] * 7])
    assert trust.coverage(evidence(posteriors=made))[0]["touches"] == 6
    made = posteriors({"x": [[0.0, 0.0]]}, reference={"x": np.array([NAN, NAN])})
    made.sample_stats = {"reference_level": np.array([0.5, 0.51, NAN, 0.9, 0.99])}
    (row,) = trust.coverage(evidence(posteriors=made))
    assert (row["parameter"], row["touches"]) == ("region", 4)
    assert row["percent_inside"] == {"50": 25.0, "80": 50.0, "90": 75.0, "95": 75.0}


def test_load_is_ranked_among_draws_of_the_sensors_reading() -> None:
    """Draws of no spread at 5, noise of 0.4/sqrt(4): a reading one sd higher has 84 % of them below it.

    What counts is how often the force sensor was read, not how often the elements were.
    """
    n = 20_000
    unseen = posteriors({"P": np.full((n, 2), 5.0).tolist()}, rows=SimpleNamespace(counts=np.full((2, 2), 100.0)))
    read = SimpleNamespace(load=np.array([5.2, 5.1]), load_reads=np.array([4.0, 16.0]))
    made = evidence(posteriors=posteriors({"P": [[5.0, 5.0]]}, rows=read))
    made.without_load, made.seed = unseen, 0
    made.calibration = SimpleNamespace(noise=Noise(np.ones(2), np.zeros(2), 0.0, 0.4))
    ((name, unit, rank),) = trust.reference_ranks(made)
    # Standard error of a share of 20,000: 0.0026.
    np.testing.assert_allclose(rank, 0.8413, atol=0.011)
    assert (name, unit) == ("P", "N/m")


def test_plugged_in_beside_propagated() -> None:
    """Median sd and coverage of either way, the load's from posteriors that did not see the force sensor."""

    def way(width: float, *, plug_in: bool) -> Any:
        one = {
            "theta_c": [[-width, 0.0], [width, 0.0]],
            "R": [[0.0, 0.0], [2 * width] * 2],
            "P": [[0.0, 0.0], [9.0, 9.0]],
        }
        rows = SimpleNamespace(radius_mm=np.full(2, 3.0), load=np.full(2, NAN), load_reads=np.ones(2))
        made, unseen = posteriors(one, rows=rows), posteriors({"P": [[0.0, 0.0], [4 * width] * 2]})
        noise = SimpleNamespace(noise=Noise(np.ones(1), np.zeros(1)))
        return evidence(
            posteriors=made, without_load=unseen, plug_in=plug_in, counterpart=None, calibration=noise, seed=0
        )

    one, two = way(1.0, plug_in=True), way(3.0, plug_in=False)
    assert trust.calibration_uncertainty(one, ["R"]) is None
    for first, other in ((one, two), (two, one)):
        first.counterpart, other.counterpart = other, None
        theta, radius, load = trust.calibration_uncertainty(first, ("theta_c", "R", "P"))  # type: ignore[misc]
        assert (theta["plug_in"]["posterior_sd"], theta["propagated"]["posterior_sd"]) == (0.5, 1.5)
        assert (radius["plug_in"]["posterior_sd"], radius["propagated"]["posterior_sd"]) == (1.0, 3.0)
        assert (load["plug_in"]["posterior_sd"], load["propagated"]["posterior_sd"]) == (2.0, 6.0)
        assert load["touches"] == 0 and load["se_90"] is None and load["unit"] == "N/m"


def test_fit_and_noise_in_shares_of_the_peak() -> None:
    observed = np.array([[1.0, -8.0, NAN], [4.0, 2.0, NAN], [NAN, 6.0, NAN]])
    rows = SimpleNamespace(observed=observed, predicted=observed - [[0.3, 1.0, 0.0], [0.4, 2.0, 0.0], [9.0, 2.0, 0.0]])
    made: Any = SimpleNamespace(rows=rows, noise=SimpleNamespace(tactile_sd=np.array([0.02, 0.0, 1.0])), mode={})
    np.testing.assert_array_equal(peak_table.element_peak(made), [4.0, 8.0, NAN])
    error, noise = peak_table.error_and_noise(made)
    np.testing.assert_allclose(error, [100 * np.sqrt(0.125) / 4, 100 * np.sqrt(3) / 8, NAN])
    np.testing.assert_allclose(noise, [0.5, NAN, NAN])
    # A pad whose readings are all 100 and −40 higher has the same shares.
    offset = np.array([100.0, -40.0, 0.0])
    made.rows = SimpleNamespace(observed=observed + offset, predicted=rows.predicted + offset)
    made.mode = {"offset": offset}
    np.testing.assert_array_equal(peak_table.element_peak(made), [4.0, 8.0, NAN])
    np.testing.assert_allclose(peak_table.error_and_noise(made), [error, noise])
    near = np.array([[True, False, True], [False, True, True], [True, False, True]])
    np.testing.assert_allclose(peak_table.error_and_noise(made, near)[0], [7.5, 25.0, NAN])
    row = peak_table.peak_row("q", "u", single={"minimum": 1.0})
    assert row["single"] == {"minimum": 1.0} and row["joint"] == row["paper"] == three([])


def test_standardised_residuals() -> None:
    rows = SimpleNamespace(
        observed=np.array([[1.0, 5.0], [8.0, NAN]]),
        predicted=np.array([[0.0, 1.0], [2.0, 1.0]]),
        sd=np.array([[1.0, 2], [1.5, 0]]),
    )
    found = residuals.about_residuals(evidence(posteriors=SimpleNamespace(rows=rows)), None)
    assert (found["readings"], found["beyond_3_percent"]) == (3, pytest.approx(100 / 3))
    assert found["rms"] == pytest.approx(np.sqrt((1 + 4 + 16) / 3))
    assert found["by_element"] == [
        {"element": "e01", "rms": pytest.approx(np.sqrt(17 / 2)), "mean": 2.5},
        {"element": "e02", "rms": 2.0, "mean": 2.0},
    ]


def test_places() -> None:
    """20 samples minus a rest reading of 5 reads have the noise of 4 reads."""
    rows = SimpleNamespace(counts=np.array([[0, 4], [9, 1]]), samples=np.array([20.0, 0.0]))
    made = evidence(posteriors=SimpleNamespace(rows=rows))
    assert (places.typical_samples(made), places.typical_reads(made)) == (20, 4)
    empty = evidence(posteriors=SimpleNamespace(rows=SimpleNamespace(counts=np.zeros((2, 2)), samples=np.zeros(2))))
    assert (places.typical_samples(empty), places.typical_reads(empty)) == (1, 1)
    rows = SimpleNamespace(load=np.array([5.0, NAN, 5.0, 5.0]), load_reads=np.array([1.0, 20.0, 3.0, 1.0]))
    assert places.typical_load_reads(evidence(posteriors=SimpleNamespace(rows=rows))) == 1
    assert places.rounded(np.array([[1.234567, np.inf], [-0.00123456789, 12345678.0]])) == [
        [1.2346, None],
        [-0.0012346, 12346000.0],
    ]
    assert places.rounded(np.array([1.26]), 2) == [1.3]
    # a hundredth of the step where that is finer, of all numbers or of each
    assert places.rounded(np.array([1200.0646, 0.0646]), step=0.06) == [1200.0646, 0.0646]
    assert places.rounded(np.array([[1006.51234], [1006.51234]]), step=np.array([[0.5], [np.nan]])) == [
        [1006.512],
        [1006.5],
    ]
    assert places.rounded_columns({"x_mm": np.array([1200.0646]), "error": np.array([1200.0646])}, {"x_mm": 0.06}) == {
        "x_mm": [1200.0646],
        "error": [1200.1],
    }
    assert places.place_at({"a": np.array([1.0, 2.0]), "b": np.array([3.0, 4.0])}, 1) == {"a": 2.0, "b": 4.0}


def pad() -> Any:
    """Elements at (0, 0) and (10, 20), touches on the corner, within, beyond and unknown."""
    reference = {"x": np.array([10.0, 5.0, 11.0, NAN]), "y": np.array([20.0, 5.0, 5.0, 5.0])}
    error = {"x": [3.0, 0.0, 6.0, 0.0], "y": [4.0, 1.0, 8.0, 0.0]}
    wide = {"x": [3.0, 6.0, 5.0, 1.0], "y": [4.0, 8.0, 12.0, 1.0]}
    draws = {
        axis: [
            (np.nan_to_num(reference[axis]) + np.array(error[axis]) + sign * np.array(wide[axis])).tolist()
            for sign in (1, -1)
        ]
        for axis in ("x", "y")
    }
    made = posteriors(draws, reference=reference, rows=SimpleNamespace(touch=np.arange(4)))
    made.sample_stats = {"modes": np.array([1, 2, 1, 1])}
    calibration = SimpleNamespace(mode={"x_s": np.array([0.0, 10.0]), "y": np.array([0.0, 20.0])})
    body = SimpleNamespace(places_mm={"x": (9.0, 9.0), "y": (9.0, 9.0)})
    return evidence(posteriors=made, calibration=calibration, sensor=SimpleNamespace(body=body))


def test_errors_on_a_pad(monkeypatch: pytest.MonkeyPatch) -> None:
    from bayestouch.reporting.pad import locations

    monkeypatch.setattr(locations, "pad_of", lambda sensor: sensor.body)
    made = pad()
    assert inside_array(made).tolist() == [True, True, False, False]
    whole, inside, outside = pad_errors(made)
    assert [each["where"] for each in (whole, inside, outside)] == ["all", "inside the array", "outside the array"]
    assert [each["touches"] for each in (whole, inside, outside)] == [3, 2, 1]
    assert outside["distance"]["rms"] == pytest.approx(10.0) and outside["axes"]["y"]["bias"] == pytest.approx(8.0)
    assert inside["distance"]["rms"] == pytest.approx(np.sqrt((25 + 1) / 2))
    assert [each["posterior_sd_median_mm"] for each in (whole, inside, outside)] == pytest.approx([10.0, 7.5, 13.0])
    assert [each["several_modes_percent"] for each in (whole, inside, outside)] == pytest.approx([100 / 3, 50.0, 0.0])


def test_distance_between_elements_of_a_pad() -> None:
    def of(*axes: tuple[float, ...]) -> Any:
        return SimpleNamespace(n_elements=len(axes[0]), places_mm=dict(zip("xy", axes, strict=False)))

    assert _spacing(of((1.0,))) is None
    assert _spacing(of((0.0, 3.0, 7.0))) == 3.0
    assert _spacing(of((0.0, 3.0), (0.0, 4.0))) == 5.0


@pytest.mark.parametrize(
    ("shared", "begin", "words"),
    [
        (65.1, "Make more calibration touches", "65 % of the radius's variance stays however many"),
        (
            65.0,
            "Average more samples of each touch (now 4 samples a touch) and make more",
            "(35 % of the radius's variance)",
        ),
        (
            35.0,
            "Average more samples of each touch (now 4 samples a touch) and make more",
            "are averaged (35 %) weigh the same",
        ),
        # Noise 80 %, a quarter of it is left of four times as many: sqrt(0.2 + 0.2) = 63 %.
        (20.0, "Average more samples of each touch (now 4 samples a touch)", "to some 63 % of what it is"),
    ],
)
def test_what_limits_the_estimates(shared: float, begin: str, words: str) -> None:
    places = {
        "shared_percent": shared,
        "samples": 4,
        "calibration_percent": 0.6 * shared,
        "model_percent": 0.4 * shared,
    }
    (step,) = next_steps._limit(places, "radius", None, 7)
    assert step["what"].startswith(begin) and words in step["why"]
    (one,) = next_steps._limit(places | {"shared_percent": 20.0, "samples": 1}, "radius", None, 7)
    assert one["what"].endswith("(now one sample a touch)")


@pytest.mark.parametrize(
    ("of_calibration", "of_model", "found", "what", "why"),
    [
        (50.0, 30.0, None, "Make more calibration touches", "the uncertainty of the calibration (50 %)"),
        (30.0, 50.0, None, "Find with bayestouch diagnose what the model lacks", "the error of the model (50 %): more"),
        (30.0, 50.0, {"missing": "no"}, "Find with bayestouch diagnose what the model lacks", "the error of the model"),
        (
            30.0,
            50.0,
            {"verdict": "unattributed"},
            "Read in the diagnosis what the model lacks",
            "the error of the model",
        ),
        # 60 % of 80 % are neither
        (5.0, 15.0, None, "Measure the load of each touch, or", "that the readings do not tell load and place (60 %)"),
    ],
)
def test_more_calibration_touches_are_no_advice_against_model_error(
    of_calibration: float, of_model: float, found: dict[str, Any] | None, what: str, why: str
) -> None:
    parts = {"calibration_percent": of_calibration, "model_percent": of_model, "samples": 4, "use_load": False}
    (step,) = next_steps._limit({"shared_percent": 80.0, **parts}, "radius", found, 7)
    assert step["what"].startswith(what) and f"the largest part of that is {why}" in step["why"]
    # and beside noise that weighs as much, with half of each part
    halves = parts | {"calibration_percent": of_calibration / 2, "model_percent": of_model / 2}
    (both,) = next_steps._limit({"shared_percent": 40.0, **halves}, "radius", found, 7)
    assert both["what"].startswith(
        f"Average more samples of each touch (now 4 samples a touch) and {what[0].lower()}{what[1:]}"
    )


def test_a_load_that_is_measured_is_to_be_measured_better() -> None:
    parts = {"calibration_percent": 5.0, "model_percent": 15.0, "samples": 4, "use_load": True}
    (step,) = next_steps._limit({"shared_percent": 80.0, **parts}, "location", None, 7)
    assert step["what"] == "Measure the load with less noise, or place elements nearer to each other"


def test_one_element_has_no_neighbour_to_be_placed_nearer_to() -> None:
    parts = {"calibration_percent": 5.0, "model_percent": 15.0, "samples": 4, "use_load": True}
    (step,) = next_steps._limit({"shared_percent": 80.0, **parts}, "location", None, 1)
    assert step["what"] == "Measure the load with less noise, or use more elements"


@pytest.mark.parametrize(
    ("several", "begin"),
    [(87.0, "Use more elements, or find out"), (50.0, "Use more"), (49.9, "Average more samples")],
)
@pytest.mark.parametrize("lack_of_fit", [1.0, None])
def test_samples_are_no_advice_where_most_touches_fit_at_several_places(
    several: float, begin: str, lack_of_fit: float | None
) -> None:
    """One element on a line of 6 mm: 1.93 mm rms with 3 samples and 1.92 mm with 12, about mirrored places."""
    places = {"shared_percent": 26.0, "samples": 3, "calibration_percent": 10.0, "model_percent": 5.0, "use_load": True}
    numbers = {
        "estimates": {"several_modes_percent": several},
        "calibration": {"lack_of_fit": lack_of_fit},
        "places": places,
        "diagnosis": None,
    }
    found = next_steps._errors(numbers, "location", 1)
    if lack_of_fit is None and several < 50:
        assert found == []
        return
    (step,) = found
    assert step["what"].startswith(begin)
    if several == 87:
        assert step["what"] == "Use more elements, or find out in another way which of the places was touched"
        assert step["why"] == (
            "At 87 % of touches more than one separate place fits the readings. Neither more samples of a touch nor "
            "more calibration touches lower the distance between these places."
        )
    # A finger does not count places.
    (step,) = next_steps._errors(
        numbers | {"estimates": {}, "calibration": {"lack_of_fit": 1.0}, "places": places}, "radius", 5
    )
    assert step["what"].startswith("Average more samples")


def test_what_to_do_about_the_sampler() -> None:
    for met, missed, steps in ((True, 0, 0), (None, 0, 0), (False, 0, 1), (True, 1, 1)):
        found = {"calibration_convergence": None if met is None else {"met": met}, "convergence": {"missed": missed}}
        assert len(next_steps._sampler(found)) == steps
    assert next_steps._range({"beyond": 0, "touches": 7}) == []
    (step,) = next_steps._range({"beyond": 2, "touches": 7})
    assert step["why"] == "2 of 7 touches are beyond the loads or places of the calibration."
    assert next_steps._made_up_for("no load; measure it") == {"what": "Measure it", "why": "No load."}
    assert next_steps._made_up_for("no load") == {"what": "No load", "why": ""}


def test_errors_in_spacings() -> None:
    """As a part of the distance up to 0.4 of it."""
    assert phrases.in_spacings(4.1, 10.0) == "0.41 times the element spacing"
    assert phrases.in_spacings(4.0, 10.0) == "1/2 of the element spacing"
    assert phrases.in_spacings(0.5, 10.0) == "1/20 of the element spacing"
