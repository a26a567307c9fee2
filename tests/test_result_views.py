"""Results as people see them: tables in a notebook, plots that take axes and give them back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure
from test_report import FINGER, Page, small

import bayestouch
from bayestouch.errors import InputError


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
    assert len(rows) == 1 + sum(p.name in calibration.posterior for p in calibration.parameters)
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
