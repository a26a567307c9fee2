"""Priors over indenters: what they say of R, what text they are written in, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

import bayestouch
from bayestouch import EdgeOrRound, IndenterDistribution, KnownTips, UniformCurvature, UniformRadius
from bayestouch.errors import InputError
from bayestouch.finger.reading.indenter_coordinate import CELLS_END, IndenterCoordinate
from bayestouch.priors.indenter_text import indenter_from_text
from bayestouch.priors.parameters import LogNormal, Normal, Uniform

OUTER = 12.7

DENSITIES = [
    UniformRadius(),
    UniformCurvature(0.3),
    IndenterDistribution(LogNormal(2.0, 0.5)),
    IndenterDistribution(LogNormal(6.0, 1.5), "R"),
    IndenterDistribution(Uniform(1.0, 5.0)),
    IndenterDistribution(Normal(0.2, 0.3), "curvature"),
]


def radius_of(quantity: str, value: np.ndarray) -> np.ndarray:
    curvature = {"R": 1 / value - 1 / OUTER, "r_c": 1 / value, "curvature": value}[quantity]
    return 1 / (curvature + 1 / OUTER)


@pytest.mark.parametrize("indenter", DENSITIES, ids=str)
def test_density_integrates_to_its_quantiles(indenter: bayestouch.UniformRadius) -> None:
    prior = indenter.radius_prior(OUTER)
    low, high = prior.support
    assert 0 <= low < high <= OUTER * (1 + 1e-12)
    for probability in (0.03, 0.5, 0.9, 1.0):
        end = min(float(prior.quantile(probability)), high)
        middle = [float(prior.quantile(p)) for p in (0.01, 0.1, 0.5) if p < probability]
        below, _ = quad(lambda r: float(np.exp(prior.log_density(r))), low, end, points=middle, limit=200)
        assert below == pytest.approx(probability, abs=1e-6)
    assert np.all(np.isneginf(prior.log_density([-0.1, OUTER + 0.1])))


@pytest.mark.parametrize("quantity", ["R", "r_c", "curvature"])
def test_density_is_that_of_transformed_draws(quantity: str) -> None:
    """Draws of the quantity, turned into R and cut off at edge and flat, against the derived quantiles."""
    source = Normal(
        {"R": 9.0, "r_c": 3.0, "curvature": 0.1}[quantity], {"R": 4.0, "r_c": 2.0, "curvature": 0.3}[quantity]
    )
    rng = np.random.default_rng(1)
    value = source.quantile(rng.random(400_000))
    radius = radius_of(quantity, value[(value > 0) & ((value < OUTER) | (quantity != "R"))])
    prior = IndenterDistribution(source, quantity).radius_prior(OUTER)
    for probability in (0.1, 0.5, 0.9):
        below = (radius < float(prior.quantile(probability))).mean()
        # four standard errors of a share
        assert abs(below - probability) < 4 * np.sqrt(probability * (1 - probability) / len(radius))


@pytest.mark.parametrize(
    "indenter", [UniformCurvature(0.3), KnownTips((0, 2, np.inf), (0.5, 0.25, 0.25)), EdgeOrRound(0.3)], ids=str
)
def test_coordinate_holds_the_whole_prior(indenter: bayestouch.KnownTips) -> None:
    """The density of w integrates to 1 over cells and line, and its masses are the weights."""
    coordinate = IndenterCoordinate(indenter.radius_prior(OUTER), OUTER)
    w = np.arange(CELLS_END - 4, 40, 1e-3) + 5e-4
    density = np.exp(coordinate.log_density(w))
    assert density.sum() * 1e-3 == pytest.approx(1.0, abs=1e-5)
    if coordinate.tips is not None:
        radius, r_c = coordinate.indenter_radius(w)
        for tip, weight in zip(coordinate.tips.indenter_radius_mm, coordinate.tips.weights, strict=True):
            cell = r_c == tip
            assert density[cell].sum() * 1e-3 == pytest.approx(weight, abs=1e-9)
            np.testing.assert_allclose(radius[cell], 1 / (1 / OUTER + (1 / tip if tip else np.inf)), rtol=1e-12)


def test_draws_from_the_prior_of_tips_have_their_weights() -> None:
    prior = EdgeOrRound(0.3, UniformCurvature(0.5)).radius_prior(OUTER)
    drawn = prior.quantile((np.arange(100_000) + 0.5) / 100_000)
    assert (drawn == 0).mean() == pytest.approx(0.3, abs=1e-4)
    assert drawn[drawn > 0].min() >= 1 / (1 / OUTER + 2) - 1e-12
    assert prior.log_density(0.0) == pytest.approx(np.log(0.3))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("uniform", UniformRadius()),
        ("curvature:0.3", UniformCurvature(0.3)),
        ("tips:0,0.5,2,inf", KnownTips((0, 0.5, 2, np.inf))),
        ("tips:0=0.5, 2=0.25, inf=0.25", KnownTips((0, 2, np.inf), (0.5, 0.25, 0.25))),
        ("edge-or-round", EdgeOrRound()),
        ("edge-or-round:0.2", EdgeOrRound(0.2)),
    ],
)
def test_text_is_read_and_written_back(text: str, expected: object) -> None:
    assert indenter_from_text(text) == expected
    assert indenter_from_text(str(expected)) == expected


def test_densities_are_read() -> None:
    assert indenter_from_text("curvature=uniform:0,2") == IndenterDistribution(Uniform(0, 2), "curvature")
    assert indenter_from_text("R=normal:4,1") == IndenterDistribution(Normal(4, 1), "R")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "expected uniform"),
        ("sphere", "expected uniform"),
        ("uniform:3", "expected uniform"),
        ("curvature", "sharpest"),
        ("curvature:0", "above 0"),
        ("curvature:x", "number"),
        ("tips:", "at least one"),
        ("tips:0,-1", "-1"),
        ("tips:nan", "nan"),
        ("tips:2,0,2", "2 mm is given twice"),
        ("tips:0=0.5,2", "for every tip or for none"),
        ("tips:0=0.5,2=0.4", "add up to 1, got 0.9"),
        ("tips:0=1.5,2=-0.5", "above 0"),
        ("tips:0,two", "number, got 'two'"),
        ("edge-or-round:1", "inside 0 and 1"),
        ("edge-or-round:", "number"),
        ("r_c=log-normal:2", "log-normal:MEDIAN,FACTOR"),
        ("diameter=normal:2,1", "expected uniform"),
    ],
)
def test_impossible_text_is_one_clear_line(text: str, words: str) -> None:
    with pytest.raises(InputError) as error:
        indenter_from_text(text)
    assert words in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: KnownTips((0, 2), (1.0,)), "weight for each of 2 tips, got 1"),
        (lambda: IndenterDistribution(3.0), "LogNormal"),  # type: ignore[arg-type]
        (lambda: IndenterDistribution(LogNormal(2, 1), "diameter"), "diameter"),  # type: ignore[arg-type]
        (lambda: IndenterDistribution(Uniform(20, 30), "R").radius_prior(OUTER), "from edge to flat"),
        (lambda: IndenterDistribution(Uniform(-3, -1), "curvature").radius_prior(OUTER), "from edge to flat"),
        (lambda: EdgeOrRound(0.5, KnownTips((1,))), "density of round"),
        (lambda: EdgeOrRound(float("nan")), "inside 0 and 1"),
    ],
)
def test_impossible_priors_are_refused(make: object, words: str) -> None:
    with pytest.raises(InputError, match=words):
        make()  # type: ignore[operator]
