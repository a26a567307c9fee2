"""P-P plot: right posteriors stay inside the band as often as it says, wrong ones leave it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from known_fingers import sensor
from matplotlib.figure import Figure
from posterior_cases import calibration

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
        rows=TouchRows(np.arange(TOUCHES), {}, radius, radius, empty, empty, empty, empty, radius, radius),
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
        ({"names": ["mu"]}, r"^P-P plot: mu is not among the parameters R, theta_c$"),
        ({"truth": {"foo": [1.0]}}, r"^P-P plot: foo is not among the parameters R, theta_c$"),
        ({"truth": {"theta": [1.0]}}, r"^P-P plot: theta is not among .*; did you mean theta_c\?$"),
        ({"truth": {"R": np.ones(TOUCHES)}, "names": "theta_c"}, r"^P-P plot: theta_c has no true values; .*: R$"),
        ({"truth": [1.0]}, r"^P-P plot: expected true values by parameter, such as \{'R': \[...\]\}, got \[1.0\]$"),
        ({"truth": {"R": ["a"]}}, r"^P-P plot: true R: expected a list of numbers, got \['a'\]$"),
        ({"level": "a"}, r"^P-P plot: level: expected a number, got 'a'$"),
        ({"truth": {"R": [1.0, 2.0]}}, "true R of 500 touches"),
        ({"truth": {"R": np.full(TOUCHES, np.nan)}}, "no touch has a known true value"),
        ({"level": 1.0}, "level between 0 and 1, got 1"),
        ({"level": 0.0}, "level between 0 and 1, got 0"),
    ],
)
def test_what_cannot_be_plotted_is_said(posteriors: TouchPosteriors, options: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=words):
        bayestouch.pp_plot(posteriors, **options)  # type: ignore[arg-type]


def few(draws: np.ndarray, **changes: object) -> TouchPosteriors:
    """Posteriors of R alone from draws (chain, draw, touch)."""
    parts: dict[str, object] = {
        "sensor": sensor(),
        "parameters": (
            Parameter("R", "R", "R", "mm", Uniform(0, 10.0)),
            Parameter("P", "P", "P", "N/m", Uniform(0, 9)),
        ),
        "posterior": {"R": draws, "P": draws},
        "sample_stats": {},
        "reference": {"R": np.zeros(draws.shape[2]), "P": np.ones(draws.shape[2]), "r_c": np.ones(draws.shape[2])},
        "rows": None,
        "settings": {},
    }
    return TouchPosteriors(**(parts | changes))  # type: ignore[arg-type]


def test_shares_of_draws_below_the_truth() -> None:
    """Draws 1, 2, 3, 4 of every touch; a draw that is the truth counts half; ends of the prior are left out."""
    made = few(np.tile(np.array([[[1.0], [2.0]], [[3.0], [4.0]]]), 6))
    truth = [2.5, 3.0, 0.5, 9.9, 10.0 * (1 - 1e-7), 0.0]
    np.testing.assert_allclose(shares_below(made, {"R": truth})["R"], [0.5, 0.625, 0.0, 1.0])
    # Whoever names the load as a truth has it compared; by default it is none.
    np.testing.assert_allclose(shares_below(made, {"P": truth[:3] * 2})["P"], [0.5, 0.625, 0.0] * 2)
    with pytest.raises(InputError, match="no touch has a known true value"):
        shares_below(made)


def test_angles_are_compared_around_the_circle() -> None:
    draws = np.array([[[179.0, -170.0], [-179.0, 170.0]]])
    angle = (Parameter("theta_c", "θ_c", "", "degree", Uniform(-180, 180)),)
    made = few(draws, parameters=angle, posterior={"theta_c": draws}, reference={"theta_c": np.array([-179.5, -175.0])})
    np.testing.assert_allclose(shares_below(made)["theta_c"], [0.5, 0.5])
    turned = few(
        draws, parameters=angle, posterior={"theta_c": draws}, reference={"theta_c": np.array([178.0, -160.0])}
    )
    np.testing.assert_allclose(shares_below(turned)["theta_c"], [0.0, 1.0])


@pytest.mark.parametrize("turns", [-1, 0, 1])
def test_a_truth_by_another_turn_is_the_same_truth(turns: int) -> None:
    """Draws from -180 to 180 and a truth from 0 to 360; a truth out of the prior by any turn is left out."""
    draws = np.array([[[-21.0, 10.0, -59.0], [-19.0, 12.0, -58.0]]])
    angle = (Parameter("theta_c", "θ_c", "", "degree", Uniform(-60, 60)),)
    truth = np.array([-20.0, 13.0, -61.0]) + 360 * turns
    made = few(draws, parameters=angle, posterior={"theta_c": draws}, reference={"theta_c": truth})
    np.testing.assert_array_equal(shares_below(made)["theta_c"], [0.5, 1.0])


def test_band_of_three_numbers() -> None:
    """Two-sided probabilities of counts, and ends of the band, by the binomial distribution."""
    from scipy.stats import binom

    band = UniformBand.of(3)
    np.testing.assert_allclose(band.place, np.arange(101) / 100)
    assert (band.low[0], band.high[0], band.low[-1], band.high[-1]) == (0, 0, 1, 1)
    assert len(band.least) == 4000 and np.all(np.diff(band.least) >= 0)
    tail = np.quantile(band.least, 0.05) / 2
    for place in (7, 50, 93):
        assert band.low[place] == binom.ppf(tail, 3, place / 100) / 3
        assert band.high[place] == binom.isf(tail, 3, place / 100) / 3
    # All three below 1 %: the count of three at 0.01 has probability 1e-6, twice that is 2e-6.
    assert band.p_value(np.full(3, 0.005)) == pytest.approx((1 + (band.least <= 2e-6).sum()) / 4001)
    assert band.p_value(np.array([0.25, 0.5, 0.75])) > 0.5
    # At 0.3 exactly the number counts as below: two of three at 0.3, at least 0.216.
    least = min(
        2 * min(binom.cdf(k, 3, p), binom.sf(k - 1, 3, p)) for p, k in ((0.29, 0), (0.3, 3), (0.99, 3), (0.01, 0))
    )
    assert band.p_value(np.full(3, 0.3)) == pytest.approx((1 + (band.least <= least).sum()) / 4001)


def test_texts_of_the_legend() -> None:
    """The band is of the parameter with the fewest; curves go from 0 to 1 in steps at each share."""
    draws = np.tile(np.arange(1.0, 9.0)[None, :, None], (1, 1, 40))
    made = few(draws)
    axes = bayestouch.pp_plot(made, {"R": np.full(40, 4.5), "P": np.r_[np.full(39, np.nan), 4.5]}, level=0.9)
    texts = [text.get_text() for text in axes.get_legend().get_texts()]
    assert texts[0] == "90 % of curves, 1 touches"
    assert texts[1] == "$R$: 40 touches, p < 0.001" and texts[2].startswith("$P$: 1 touches, p = ")
    curve = next(line for line in axes.get_lines() if line.get_label() == texts[1])
    np.testing.assert_allclose(curve.get_xdata(), [0, *[0.5] * 40, 1])
    np.testing.assert_allclose(curve.get_ydata(), [0, *(np.arange(1, 41) / 40), 1])


def test_other_things_than_posteriors_are_refused() -> None:
    for other, got in ((calibration(), "Calibration"), ("p.nc", "'p.nc'")):
        with pytest.raises(InputError) as error:
            bayestouch.pp_plot(other)  # type: ignore[arg-type]
        assert str(error.value) == (
            f"expected posteriors of touches, got {got}; bayestouch.infer makes them, bayestouch.load reads them"
        )
