"""References are drawn by the turn that is nearest the posterior."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from posterior_cases import calibration, touches

from bayestouch.errors import InputError
from bayestouch.priors.parameter_text import PriorOfOtherCode
from bayestouch.priors.parameters import Normal, Parameter


def parts(relative: bool, name: str) -> list[str]:
    """Legend of a parameter that is far from the centre of its prior."""
    parameter = Parameter(name, name, name, "", Normal(100.0, 1.0), relative=relative)
    legend = replace(calibration(), parameters=(parameter,)).plot_parameter(name).get_legend()
    return [] if legend is None else [text.get_text() for text in legend.get_texts()]


@pytest.mark.parametrize(
    ("name", "band", "others"),
    [("r_s", "prior, central 90 %", "posterior mean, 90 % interval"), ("sigma", "prior", "posterior")],
)
def test_a_prior_is_drawn_if_it_is_of_the_parameter_itself(name: str, band: str, others: str) -> None:
    """Wherever it is: a posterior far from its prior shows that they disagree."""
    assert sorted(parts(False, name)) == sorted([band, others])
    assert parts(True, name) == [others]


def test_a_reference_from_0_to_360_is_drawn_beside_the_draws() -> None:
    made = touches()
    mean = made.mean("theta_c")
    near = mean + np.linspace(-3, 3, len(mean))
    for turns in (0, 360, -720):
        stated = replace(made, reference={**made.reference, "theta_c": near + turns})
        points, right = stated.plot_estimates("theta_c").get_lines()[:2]
        np.testing.assert_allclose(points.get_xdata(), near, atol=1e-9)
        np.testing.assert_array_equal(points.get_ydata(), mean)
        np.testing.assert_allclose(right.get_xdata(), [near.min(), near.max()], atol=1e-9)
        cross = stated.plot_touch(int(made.rows.touch[1]), ("theta_c", "R")).get_lines()
        if np.isfinite(made.reference["R"][1]):
            np.testing.assert_allclose(cross[1].get_xdata(), near[1:2], atol=1e-9)


def test_draws_that_were_not_kept_are_not_plotted() -> None:
    made = touches()
    without = replace(made, posterior={}, estimates={"R": np.ones((5, len(made.rows.touch)))})
    for plot in (lambda: without.plot_touch(int(made.rows.touch[0])), without.plot_pp):
        with pytest.raises(InputError, match=r"^only summaries were kept of these posteriors, no draws$"):
            plot()


@pytest.mark.parametrize("name", ["r_s", "sigma"])
def test_a_prior_of_other_code_from_a_file_is_not_drawn(name: str) -> None:
    """The file has no density of it."""
    parameter = Parameter(name, name, name, "", PriorOfOtherCode("Triangle(0.44, 0.46, 0.49)", 0.44, 0.49))
    axes = replace(calibration(), parameters=(parameter,)).plot_parameter(name)
    assert [text.get_text()[:9] for text in axes.get_legend().get_texts()] == ["posterior"]


def test_the_legend_says_which_sample_of_a_touch_is_drawn() -> None:
    made = touches()
    samples = replace(made, rows=replace(made.rows, touch=np.array([7, 3, 3, 3, 8])))
    shown = [samples.plot_touch(touch, ("theta_c", "R")) for touch in (7, 3)]
    said = [
        axes.get_legend().get_texts()[0].get_text() for axes in (*shown, samples[2].plot_touch(3, ("theta_c", "R")))
    ]
    assert said == ["draws of touch 7", "draws of touch 3, the first of 3 samples", "draws of touch 3"]
    np.testing.assert_array_equal(shown[1].get_lines()[0].get_ydata(), made.posterior["R"][..., 1].ravel())
