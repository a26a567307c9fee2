"""Results as people see them: tables in a notebook, plots that take axes and give them back."""

from __future__ import annotations

import inspect
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from report_cases import FINGER, Page, small

import bayestouch
from bayestouch.errors import InputError
from bayestouch.simulation_based_calibration.ranks import of_ranks


@pytest.fixture(scope="module")
def calibration() -> bayestouch.Calibration:
    found = bayestouch.calibrate(small(FINGER).dataset, draws=200)
    return replace(found, sensor=replace(found.sensor, name="<b>x</b>"))


@pytest.fixture(scope="module")
def touches(calibration: bayestouch.Calibration) -> bayestouch.TouchPosteriors:
    return bayestouch.infer(small(FINGER).dataset.touches, calibration, draws=128)


def test_tables_in_a_notebook(calibration: bayestouch.Calibration, touches: bayestouch.TouchPosteriors) -> None:
    for result in (calibration, touches):
        html = result._repr_html_()
        assert "<b>x" not in html and "&lt;b&gt;x" in html
        page = Page(html)
        assert len(page.all("table")) == 1
    rows = Page(calibration._repr_html_()).all("tr")
    # a head, the parameters, and the gain that follows from them
    assert len(rows) == 2 + sum(p.name in calibration.posterior for p in calibration.parameters)
    # mean of the first touch, to the digits that its standard deviation asks for
    sd = touches.sd("theta_c")[0]
    first = [cell for cell in Page(touches._repr_html_()).cells if "±" in cell]
    place = [p.name for p in touches.parameters if p.name in touches.posterior].index("theta_c")
    shown = float(first[place].split("±")[0].replace("−", "-"))
    assert shown == pytest.approx(touches.mean("theta_c")[0], abs=sd)


def test_plots_take_axes_and_give_them_back(
    calibration: bayestouch.Calibration, touches: bayestouch.TouchPosteriors
) -> None:
    plots = (
        lambda axes: calibration.plot_parameter("sigma", axes),
        lambda axes: calibration.plot_parameter("r_s", axes),
        lambda axes: calibration.plot_fit(2, axes),
        lambda axes: touches.plot_estimates("R", axes),
        lambda axes: touches.plot_touch(int(touches.rows.touch[3]), axes=axes),
        touches.plot_residuals,
    )
    for plot in plots:
        given = Figure().subplots()
        assert plot(given) is given
        assert given.get_xlabel() and given.get_ylabel()
        assert plot(None) is not given


def test_what_is_drawn_is_what_was_read(
    calibration: bayestouch.Calibration, touches: bayestouch.TouchPosteriors
) -> None:
    axes = calibration.plot_fit(2)
    read, model = (line.get_ydata() for line in axes.get_lines())
    np.testing.assert_array_equal(read, calibration.rows.observed[:, 1])
    np.testing.assert_array_equal(model, calibration.rows.predicted[:, 1])
    points = touches.plot_estimates("theta_c").get_lines()[0]
    np.testing.assert_array_equal(points.get_ydata(), touches.mean("theta_c"))
    np.testing.assert_array_equal(points.get_xdata(), touches.reference["theta_c"])


def test_wrong_names_are_told(calibration: bayestouch.Calibration, touches: bayestouch.TouchPosteriors) -> None:
    for wrong in (
        lambda: calibration.plot_parameter("radius"),
        lambda: calibration.plot_fit(7),
        lambda: touches.plot_estimates("x"),
        lambda: touches.plot_touch(10_000),
    ):
        with pytest.raises(InputError, match=r"expected|not among"):
            wrong()


def test_a_diagnosis_as_table_and_plots() -> None:
    """Cross-talk is put in, and found; each plot draws on the axes that it is given."""
    data = bayestouch.simulate(FINGER, effects={"crosstalk": 0.08}, seed=4).dataset
    found = bayestouch.diagnose(data, sample=False, draws=64)
    assert found.effects == ("crosstalk",)
    table = found.to_dataframe()
    assert list(table["effect"].unique()) == list(found.effects)
    for effect in found.to_dict()["effects"]:
        rows = table[table["effect"] == effect["name"]].set_index("parameter")
        assert rows["mean"].to_dict() == {name: value["mean"] for name, value in effect["parameters"].items()}
    assert "posterior" in found.to_arviz()
    html = Page(found._repr_html_())
    assert str(found).splitlines()[0] in "".join(html.text)
    given = Figure().subplots()
    assert found.plot_errors(given) is given
    before, after = given.containers
    heights = [[bar.get_height() for bar in bars] for bars in (before, after)]
    errors = [found.numbers[stand]["prediction_error_percent_peak"] for stand in ("before", "after")]
    # the paper's measure is the mean over the elements
    assert [np.mean(each) for each in heights] == pytest.approx(errors, rel=1e-9)
    names = [label.get_text() for label in found.plot_candidates().get_yticklabels()]
    assert names == [each["name"] for each in found.numbers["candidates"]]
    with pytest.raises(InputError, match="round: expected 1 to"):
        found.plot_candidates(99)


def test_a_comparison_is_drawn(calibration: bayestouch.Calibration, tmp_path: Path) -> None:
    other = bayestouch.calibrate(small(FINGER).dataset, draws=200, seed=1)
    compared = bayestouch.compare(calibration, other, tmp_path / "out")
    given = Figure().subplots()
    assert compared.plot_parameter("r_s", given) is given
    first, second = (container.lines[0].get_ydata() for container in given.containers)
    np.testing.assert_allclose(second, -np.asarray(first))
    with pytest.raises(InputError, match="expected one of"):
        compared.plot_parameter("sigma")  # all elements share it


def test_a_report_hands_on_what_it_read(touches: bayestouch.TouchPosteriors, tmp_path: Path) -> None:
    touches.save(tmp_path / "posterior.nc")
    key = [{"quantity": "location error, rms", "value": 0.1, "unit": "degree", "detail": ""}]
    report = bayestouch.Report(tmp_path, {"answer": {"key_numbers": key}}, ())
    assert report.to_dataframe().to_dict("records") == key
    assert "posterior" in report.to_arviz()
    given = Figure().subplots()
    assert report.plot_estimates("R", given) is given
    np.testing.assert_array_equal(given.get_lines()[0].get_ydata(), touches.mean("R"))


def test_a_simulation_and_its_data_set() -> None:
    simulated = small(FINGER)
    data = simulated.dataset
    table = simulated.to_dataframe()
    assert data.calibration is not None
    counts = {"calibration": data.calibration.n_rows, "touches": data.touches.n_rows}
    assert table["table"].value_counts().to_dict() == counts
    read = table[table["table"] == "touches"]
    np.testing.assert_array_equal(read[["e01", "e06"]], data.touches.readings[:, [0, 5]])
    assert "seed 4; effects: none" in simulated._repr_html_()


def test_ranks_as_table_and_plot() -> None:
    ranks = of_ranks({"R": np.arange(100), "<P>": np.full(100, 99)}, {"R": 0.9, "<P>": 0.0})
    assert ranks.to_dataframe()["parameter"].tolist() == ["R", "<P>"]
    assert "<P>" not in ranks._repr_html_() and "not uniform" in ranks._repr_html_()
    given = Figure().subplots()
    assert ranks.plot_ranks("R", given) is given
    assert sum(bar.get_height() for bar in given.containers[0]) == 100
    with pytest.raises(InputError, match="expected one of"):
        ranks.plot_ranks("x")


@pytest.mark.parametrize(
    ("result", "names"),
    [
        (bayestouch.DataCheck, ("to_dataframe", "plot_touches", "plot_readings")),
        (bayestouch.Calibration, ("to_arviz", "to_dataframe", "plot_parameter", "plot_fit")),
        (bayestouch.TouchPosteriors, ("to_arviz", "to_dataframe", "plot_estimates", "plot_touch", "plot_residuals")),
        (bayestouch.Diagnosis, ("to_arviz", "to_dataframe", "plot_errors", "plot_candidates")),
        (bayestouch.Report, ("to_arviz", "to_dataframe", "plot_estimates")),
        (bayestouch.Comparison, ("to_dataframe", "plot_parameter")),
        (bayestouch.SimulatedDataSet, ("to_dataframe",)),
        (bayestouch.RankStatistics, ("to_dataframe", "plot_ranks")),
    ],
)
def test_what_a_verb_returns_has_its_views(result: type, names: tuple[str, ...]) -> None:
    for name in ("_repr_html_", *names):
        assert callable(getattr(result, name, None)), f"{result.__name__}.{name}"
    plots = [name for name in dir(result) if name.startswith("plot_") and name != "plot_pp"]
    for name in plots:
        assert "axes" in inspect.signature(getattr(result, name)).parameters, name
