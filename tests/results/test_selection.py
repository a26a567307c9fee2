"""Some of the touches of a result, by position, number, tip and place; short tables of results."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from posterior_cases import PAD, calibration, same, touches

import bayestouch
from bayestouch.errors import InputError
from bayestouch.results import netcdf
from bayestouch.results.draws_on_file import DrawsOnFile
from bayestouch.results.summaries import summarise
from bayestouch.results.tips import TipProbabilities

# Numbers of the touches are 8, 6, 4, 2, 0; tips a knife edge, a flat, unknown, 3.2 mm, a knife edge.
PLACES = np.array([-20.0, -10.0, 0.0, 10.0, np.nan])


@pytest.fixture
def posteriors() -> bayestouch.TouchPosteriors:
    """Five touches, in which whatever is stored a touch differs from touch to touch."""
    made = touches()
    rng = np.random.default_rng(5)
    sharp = rng.uniform(size=5)
    tips = np.log(np.stack([sharp, 1 - sharp], axis=1))
    return replace(
        made,
        rows=replace(made.rows, location={"theta_c": PLACES}),
        sample_stats={**made.sample_stats, "grade": np.array([1, 0, 1, 1, 0])},
        estimates=summarise(made.posterior),
        groups={"log_likelihood": {"reading": rng.normal(size=(4, 50, 5, 3))}, "log_prior": {"R": made.posterior["R"]}},
        tips=TipProbabilities(np.array([0.0, np.inf]), np.array([0.5, 0.5]), tips),
    )


@pytest.mark.parametrize(
    ("index", "expected"),
    [
        (3, [3]),
        (-1, [4]),
        (slice(1, 3), [1, 2]),
        (slice(None, None, -2), [4, 2, 0]),
        ([2, 0], [2, 0]),
        ([], []),
        (np.array([True, False, False, True, False]), [0, 3]),
    ],
)
def test_an_index_is_that_of_numpy(posteriors: bayestouch.TouchPosteriors, index: Any, expected: list[int]) -> None:
    """Everything that is stored a touch is that of the chosen touches; all else is unchanged."""
    some = posteriors[index]
    assert type(some) is bayestouch.TouchPosteriors and len(some) == len(expected)
    for name in ("posterior", "sample_stats", "reference", "estimates"):
        for key, values in getattr(posteriors, name).items():
            np.testing.assert_array_equal(getattr(some, name)[key], values[..., expected], err_msg=f"{name} {key}")
    for group, arrays in posteriors.groups.items():
        for key, values in arrays.items():
            np.testing.assert_array_equal(some.groups[group][key], values[:, :, expected], err_msg=key)
    for name in ("touch", "radius_mm", "load", "observed", "predicted", "sd", "counts", "samples", "load_reads"):
        np.testing.assert_array_equal(getattr(some.rows, name), getattr(posteriors.rows, name)[expected], err_msg=name)
    np.testing.assert_array_equal(some.rows.location["theta_c"], PLACES[expected])
    assert some.tips is not None and posteriors.tips is not None
    np.testing.assert_array_equal(some.tips.log_probability, posteriors.tips.log_probability[expected])
    for name in ("sensor", "parameters", "settings", "notes"):
        assert getattr(some, name) is getattr(posteriors, name)


def test_a_result_is_a_sequence_of_touches(posteriors: bayestouch.TouchPosteriors) -> None:
    assert [int(each.rows.touch[0]) for each in posteriors] == [8, 6, 4, 2, 0] == list(posteriors.rows.touch)
    with pytest.raises(IndexError):
        posteriors[5]
    with pytest.raises(IndexError):
        posteriors[np.array([True, False])]
    with pytest.raises(IndexError, match="one axis"):
        posteriors[[[1, 2]]]


@pytest.mark.parametrize(
    ("wanted", "numbers"),
    [
        ({}, [8, 6, 4, 2, 0]),
        ({"touch": 6}, [6]),
        ({"touch": slice(2, 6)}, [6, 4, 2]),
        ({"touch": [0, 8]}, [8, 0]),
        ({"tip": 0}, [8, 0]),
        ({"tip": np.inf}, [6]),
        ({"tip": slice(1, None)}, [6, 2]),
        ({"place": slice(-10, 10)}, [6, 4, 2]),
        ({"place": 10.0}, [2]),
        ({"place": 350.0}, [6]),
        ({"place": slice(340, 355)}, [8, 6]),
        ({"place": slice(350, 370)}, [6, 4, 2]),
        ({"place": slice(340, None)}, [8, 6]),
        ({"place": slice(None, -345)}, [2]),
        ({"tip": [0, np.inf], "place": slice(None, 0)}, [8, 6]),
    ],
)
def test_touches_by_number_tip_and_place(
    posteriors: bayestouch.TouchPosteriors, wanted: dict[str, Any], numbers: list[int]
) -> None:
    """A range holds both of its ends; what is not known of a touch meets no condition."""
    assert posteriors.sel(**wanted).rows.touch.tolist() == numbers


def test_places_of_a_pad_have_two_coordinates() -> None:
    made = touches(PAD)
    x, y = np.arange(5.0), np.array([0.0, 1.0, 0.0, 1.0, 0.0])
    made = replace(made, rows=replace(made.rows, location={"x": x, "y": y}))
    assert made.sel(place_x=slice(1, 3), place_y=1).rows.touch.tolist() == [6, 2]
    with pytest.raises(InputError, match="place: touches of this sensor are chosen by touch, tip, place_x, place_y"):
        made.sel(place=1)


@pytest.mark.parametrize(
    ("wanted", "words"),
    [
        ({"tip": 4}, "tip: no touch has 4; there are 0, 3.2, inf"),
        ({"touch": slice(10, 20)}, "touch: no touch has 10 to 20; there are 0, 2, 4, 6, 8"),
        ({"place_x": 1}, "place_x: touches of this sensor are chosen by touch, tip, place"),
        ({"tip": 0, "place": 10}, "no touch meets all of tip=0, place=10"),
        ({"place": np.inf}, "place: no touch has inf; there are -20, -10, 0, 10"),
        ({"place": slice("a", 3)}, "place: expected a number, got 'a'"),
        ({"touch": slice(0, 10, 2)}, "touch: a slice of touches has no step, got 2"),
    ],
)
def test_what_no_touch_has_is_refused_with_what_there_is(
    posteriors: bayestouch.TouchPosteriors, wanted: dict[str, Any], words: str
) -> None:
    with pytest.raises(InputError) as error:
        posteriors.sel(**wanted)
    assert str(error.value) == words


def test_draws_on_file_stay_there(
    posteriors: bayestouch.TouchPosteriors, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "posterior.nc"
    replace(posteriors, groups={}).save(path)
    monkeypatch.setattr(netcdf, "LARGEST_IN_MEMORY", 0)
    lazy = bayestouch.load(path)
    assert isinstance(lazy, bayestouch.TouchPosteriors)
    some = lazy[[4, 1, 1, 2]]
    again = some[1:3]
    for result, positions in ((some, [4, 1, 1, 2]), (again, [1, 1])):
        assert isinstance(result.posterior, DrawsOnFile)
        assert result.posterior.shapes["R"] == (4, 50, len(positions))
        np.testing.assert_array_equal(result.posterior["R"], posteriors.posterior["R"][..., positions])
    np.testing.assert_array_equal(some.posterior.some("R", slice(2, 4)), posteriors.posterior["R"][..., [1, 2]])
    before = path.read_bytes()
    for result in (lazy, some):
        with pytest.raises(InputError, match="is read, so that it cannot be the output too; give another name"):
            result.save(path)
    assert path.read_bytes() == before


def test_summaries_without_draws_are_chosen_too(posteriors: bayestouch.TouchPosteriors, tmp_path: Path) -> None:
    path = tmp_path / "posterior.nc"
    replace(posteriors, posterior={}, groups={}).save(path)
    some = bayestouch.load(path)[1:2]
    np.testing.assert_array_equal(some.mean("R"), posteriors.estimates["R"][0, 1:2])
    with pytest.raises(InputError, match="only summaries"):
        some.posterior["R"]


def test_no_touches(posteriors: bayestouch.TouchPosteriors) -> None:
    none = posteriors[[]]
    assert "there are no touches" in str(none) and "targets" not in str(none)
    for probability in (0.9, 0.5):
        assert [limit.shape for limit in replace(none, estimates={}).interval("R", probability)] == [(0,), (0,)]
    for plot in (lambda: none.plot_estimates("R"), none.plot_residuals):
        with pytest.raises(InputError, match=r"^there are no touches to plot$"):
            plot()


def test_a_selection_is_saved_and_read_back(posteriors: bayestouch.TouchPosteriors, tmp_path: Path) -> None:
    some = posteriors.sel(tip=0)
    some.save(tmp_path / "some.nc")
    again = bayestouch.load(tmp_path / "some.nc")
    same(again.rows, some.rows)
    same(dict(again.posterior), dict(some.posterior))


def test_one_row_a_touch(posteriors: bayestouch.TouchPosteriors) -> None:
    table = posteriors.summary()
    expected = ["tip", "place", "R", "R_sd", "theta_c", "theta_c_sd", "P", "P_sd", "grade"]
    assert table.columns.tolist() == expected and table.index.tolist() == [8, 6, 4, 2, 0]
    np.testing.assert_array_equal(table["place"], PLACES)
    np.testing.assert_array_equal(table["tip"], posteriors.rows.radius_mm)
    np.testing.assert_allclose(table["theta_c"], posteriors.posterior["theta_c"].mean(axis=(0, 1)), rtol=1e-12)
    np.testing.assert_allclose(table["P_sd"], posteriors.posterior["P"].std(axis=(0, 1)), rtol=1e-12)
    assert table["grade"].tolist() == [1, 0, 1, 1, 0]
    assert table.attrs["units"] == {"R": "mm", "theta_c": "degree", "P": "N/m"}


def test_angles_from_0_to_360_are_beside_their_estimates(posteriors: bayestouch.TouchPosteriors) -> None:
    stated = replace(posteriors, reference={**posteriors.reference, "theta_c": PLACES % 360})
    table = stated.to_dataframe().query("parameter == 'theta_c'")
    near = table["reference"] - table["mean"]
    assert (near.dropna().abs() <= 180).all()
    np.testing.assert_allclose(table["reference"] % 360, PLACES % 360)


def test_two_tables_side_by_side_are_printed(posteriors: bayestouch.TouchPosteriors) -> None:
    twice = pd.concat([posteriors.summary(), posteriors.summary()], axis=1)
    assert repr(twice).splitlines()[0].split().count("R_sd") == 2 or "..." in repr(twice)


def test_one_row_a_parameter() -> None:
    made = calibration()
    table = made.summary()
    assert table.index.tolist() == ["sigma", "mu", "r_s", "gain"]
    draws = made.posterior["r_s"]
    row = table.loc["r_s"]
    assert row[["lowest", "highest"]].tolist() == [draws.mean(axis=(0, 1)).min(), draws.mean(axis=(0, 1)).max()]
    assert row["sd"] == np.median(draws.std(axis=(0, 1))) and row["mean"] == pytest.approx(draws.mean(), rel=1e-12)
    assert np.isnan(table.loc["mu", "lowest"]) and table.loc["mu", "sd"] == made.posterior["mu"].std()
    assert table["unit"].to_dict() == {"sigma": "", "mu": "MPa", "r_s": "mm", "gain": "counts/strain"}
    assert made.to_dataframe().set_index("parameter")["unit"]["gain"].unique().tolist() == ["counts/strain"]
    assert "counts/strain" in made._repr_html_()


def test_means_and_ranges_are_those_of_elements_with_readings() -> None:
    """An element that was never read has the draws of its prior: here a depth of 90 mm ± 30."""
    made = calibration()
    observed, draws = made.rows.observed.copy(), made.posterior["r_s"].copy()
    observed[:, 1], draws[:, :, 1] = np.nan, np.random.default_rng(0).normal(90.0, 30.0, draws.shape[:2])
    dead = replace(made, rows=replace(made.rows, observed=observed), posterior={**made.posterior, "r_s": draws})
    others = np.delete(draws, 1, axis=2)
    row = dead.summary().loc["r_s"]
    assert row["mean"] == pytest.approx(others.mean(), rel=1e-12)
    assert row["sd"] == pytest.approx(np.median(others.std(axis=(0, 1))), rel=1e-12)
    assert row["highest"] == others.mean(axis=(0, 1)).max()
    (line,) = (each for each in repr(dead).splitlines() if "r_s from" in each)
    assert "90" not in line.split("r_s from")[1].split("mm")[0]
    assert len(dead.to_dataframe().query("parameter == 'r_s'")) == draws.shape[2]


@pytest.mark.parametrize("width", [50, 80, 200])
def test_every_column_is_printed(
    posteriors: bayestouch.TouchPosteriors, monkeypatch: pytest.MonkeyPatch, width: int
) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    for table in (posteriors.summary(), calibration().summary()):
        lines = repr(table).splitlines()
        for shown in (repr(table), repr(table.head(2))):
            assert set(table.columns) <= {word.rstrip(":") for word in shown.split()} and "..." not in shown
        assert max(map(len, lines)) <= width
    meaning = calibration().summary()["meaning"]
    assert all(text in " ".join(repr(calibration().summary()).split()) for text in meaning)
    table = posteriors.summary()
    assert repr(table).splitlines()[-1] == "units: R mm, theta_c degree, P N/m"
    assert repr(table[["P"]]).splitlines()[-1] == "units: P N/m" and "units" not in repr(table[["tip"]])
    assert "NaN" not in repr(table)
    long = pd.concat([table] * 5)
    assert len(repr(long.reset_index(drop=True)[["P"]]).splitlines()) == 1 + 20 + 1 + 1
