"""P-P plot: right posteriors stay inside the band as often as it says, wrong ones leave it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from known_fingers import sensor
from matplotlib.figure import Figure

import bayestouch
from bayestouch.errors import InputError
from bayestouch.priors.parameters import Parameter, Uniform
from bayestouch.results.data import TouchRows
from bayestouch.results.objects import TouchPosteriors
from bayestouch.results.probability_plot import UniformBand, shares_below

TOUCHES = 500


@pytest.fixture(scope="module")
def posteriors() -> TouchPosteriors:
    """Posteriors as they should be: truth and draws from the same normal about what was read."""
    rng = np.random.default_rng(3)
    read, wide = rng.uniform(2, 10, TOUCHES), rng.standard_normal((4, 250, TOUCHES))
    radius, angle = read + 0.5 * rng.standard_normal(TOUCHES), 180 + 4 * rng.standard_normal(TOUCHES)
    empty = np.full((TOUCHES, 7), np.nan)
    return TouchPosteriors(
        sensor=sensor(),
        parameters=(
            Parameter("R", "R", "R", "mm", Uniform(0, 12.7)),
            Parameter("theta_c", "θ_c", r"\theta_c", "degree", Uniform(-180, 180)),
        ),
        posterior={
            "R": read + 0.5 * wide,
            "theta_c": np.mod(180 + 4 * wide[::-1] + 180, 360) - 180,
        },
        sample_stats={},
        reference={"R": radius, "theta_c": np.mod(angle + 180, 360) - 180, "P": np.full(TOUCHES, 200.0)},
        rows=TouchRows(np.arange(TOUCHES), {}, radius, radius, empty, empty, empty, np.zeros((TOUCHES, 7), np.int64)),
        settings={},
    )


def test_right_posteriors_are_inside_and_wrong_ones_are_not(posteriors: TouchPosteriors) -> None:
    """Angles are compared around the circle: half of these draws are near 180°, half near -180°."""
    shares = shares_below(posteriors)
    assert set(shares) == {"R", "theta_c"}, "a load that was read is no truth"
    band = UniformBand.of(TOUCHES)
    assert all(band.p_value(values) > 0.01 for values in shares.values())
    draws = posteriors.posterior["R"]
    mean = draws.mean(axis=(0, 1))
    for wrong in (mean + 0.7 * (draws - mean), draws + 0.2, mean + 1.4 * (draws - mean)):
        spoiled = replace(posteriors, posterior={"R": wrong})
        assert band.p_value(shares_below(spoiled, names=["R"])["R"]) < 1e-3


def test_band_holds_as_many_curves_as_it_says() -> None:
    n, curves = 200, 2000
    band = UniformBand.of(n, 0.9)
    numbers = np.random.default_rng(8).random((curves, n))
    height = (numbers[:, :, None] <= band.place).mean(axis=1)
    inside = ((height >= band.low - 1e-12) & (height <= band.high + 1e-12)).all(axis=1).mean()
    # four standard errors of the curves here and of those that made the band; counts are whole, so it may be wider
    error = np.sqrt(0.9 * 0.1 * (1 / curves + 1 / 4000))
    assert 0.9 - 4 * error < inside < 0.9 + 4 * error + 0.01
    p = np.array([band.p_value(row) for row in numbers])
    assert np.mean(p < 0.1) == pytest.approx(0.1, abs=4 * error + 0.01)


def test_axes_in_and_out(posteriors: TouchPosteriors) -> None:
    axes = Figure().subplots()
    assert bayestouch.pp_plot(posteriors, names=["R"], axes=axes) is axes
    assert [text.get_text().split(":")[0] for text in axes.get_legend().get_texts()] == [
        "95 % of curves, 500 touches",
        "$R$",
    ]
    assert axes.get_xlabel()
    new = posteriors.plot_pp({"R": posteriors.reference["R"]}, level=0.5)
    assert "500 touches, p = " in new.get_legend().get_texts()[1].get_text()


def test_ends_of_the_prior_and_unknown_truths_are_left_out(posteriors: TouchPosteriors) -> None:
    truth = posteriors.reference["R"].copy()
    truth[:10], truth[10:30], truth[30:60] = 0.0, 12.7, np.nan
    assert len(shares_below(posteriors, {"R": truth})["R"]) == TOUCHES - 60


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"names": ["mu"]}, "mu is not among"),
        ({"truth": {"R": [1.0, 2.0]}}, "true R of 500 touches"),
        ({"truth": {"R": np.full(TOUCHES, np.nan)}}, "no touch has a known true value"),
        ({"level": 1.0}, "level"),
    ],
)
def test_what_cannot_be_plotted_is_said(posteriors: TouchPosteriors, options: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=words):
        bayestouch.pp_plot(posteriors, **options)  # type: ignore[arg-type]
