"""Simulation-based calibration: right posteriors pass, and what is wrong is noticed as often as is stated.

How often: `studies/sbc_power.py`, whose table is in docs/statistics.md.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from known_fingers import ANGLES, dataset, known_touches, sensor
from scipy.stats import binom, chi2, norm
from study_modules import study

import bayestouch
from bayestouch.data.dataset import DataSet
from bayestouch.data.sensor import Finger
from bayestouch.errors import InputError
from bayestouch.finger.likelihood import LOAD_REACH
from bayestouch.finger.softest_rubber import softest
from bayestouch.priors.parameters import LogNormal, Normal
from bayestouch.results.reading import load_calibration, load_touches
from bayestouch.simulation import PadDesign
from bayestouch.simulation_based_calibration import calibrations as calibration_checks
from bayestouch.simulation_based_calibration.calibrations import CalibrationDesign, draw_parameters, simulate_and_rank
from bayestouch.simulation_based_calibration.ranks import (
    BINS,
    RANKED,
    RankStatistics,
    normal_scores,
    of_ranks,
    pooled_spread,
    rank_statistics,
)
from bayestouch.simulation_based_calibration.running import check_calibration
from bayestouch.simulation_based_calibration.touches import simulate_touches

power = study("sbc_power")

SIMULATIONS = 500
TOUCH_QUANTITIES = ("R", "r_c", "theta_c", "P")


@pytest.fixture(scope="module")
def calibration() -> bayestouch.Calibration:
    """With a draw for each touch that is simulated."""
    return bayestouch.calibrate(dataset(known_touches(1)), draws=2000)


def narrowed(calibration: bayestouch.Calibration, share: float) -> bayestouch.Calibration:
    """What touches are read with, too sure of itself by this share; the draws stay as they are."""
    noise = calibration.noise
    less = replace(
        noise,
        tactile_sd=(1 - share) * noise.tactile_sd,
        discrepancy_sd=(1 - share) * noise.discrepancy_sd,
        force_sd=(1 - share) * noise.force_sd,
    )
    return replace(calibration, noise=less, covariance=(1 - share) ** 2 * calibration.covariance)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["emcee", "importance"])
def test_ranks_are_uniform(calibration: bayestouch.Calibration, method: str) -> None:
    """Touches read with an inferred calibration, at a level of 1 %.

    The pooled statistic notices posteriors that are 5, 10 or 20 % too narrow with a chance of 0.4, 0.98, 1.
    """
    result = bayestouch.sbc(calibration, simulations=SIMULATIONS, method=method, seed=2)
    assert tuple(result.ranks) == TOUCH_QUANTITIES
    assert result.passes(0.01), result.table()
    # the number of independent scores of which that chance was computed
    assert result.pooled.scores / SIMULATIONS == pytest.approx(power.TOUCH, rel=0.15)
    assert power.power(power.pooled("", SIMULATIONS, power.TOUCH), 0.05) > 0.1
    # a share of 0.9 of 500 touches scatters by 0.0134; four of these. Of 5, 10, 20 % too narrow: 0.02, 0.2, 1
    assert all(abs(share - 0.9) < 4 * np.sqrt(0.09 / SIMULATIONS) for share in result.coverage_90.values())


@pytest.mark.slow
def test_reading_with_too_little_noise_and_covariance_is_noticed(calibration: bayestouch.Calibration) -> None:
    """By 10 %: the simulation takes nothing from the noise and the covariance that touches are read with.

    The stated chance is 0.98. All that touches are read with is narrowed, so that their posteriors are narrower by the
    same share, save where the priors of R, θ_c and P end.
    """
    right = bayestouch.sbc(calibration, simulations=SIMULATIONS, samples=4, seed=5)
    wrong = bayestouch.sbc(narrowed(calibration, 0.1), simulations=SIMULATIONS, samples=4, seed=5)
    assert right.passes(0.01), right.table()
    assert not wrong.passes(0.01), wrong.table()
    # the same touches and noise in both: the ratio is good to 0.02, and the ends of the priors take off up to a third
    ratio = wrong.pooled.mean_square / right.pooled.mean_square
    assert 1 + 0.6 * (power.mean_square(0.1) - 1) < ratio < power.mean_square(0.1) + 0.04


@pytest.mark.slow  # a minute: 2,000 touches, read five times
@pytest.mark.parametrize("what", ["noise", "covariance", "both"])
def test_five_per_cent_are_noticed_at_length(what: str) -> None:
    """As many touches as `studies/sbc_touches.py` reads: 5 % of noise and covariance are noticed (chance 0.98).

    Of either alone a share of the variance is narrowed: 20 % of it is noticed, whichever it is.
    """
    calibration = bayestouch.calibrate(dataset(known_touches(1)), draws=2000)
    share = 0.05 if what == "both" else 0.2
    less = narrowed(calibration, share)
    spoiled = {
        "noise": replace(calibration, noise=less.noise),
        "covariance": replace(calibration, covariance=less.covariance),
        "both": less,
    }[what]
    # averages of four samples show the noise; most of the error of those of twenty is the calibration's
    result = bayestouch.sbc(spoiled, simulations=2000, samples=20 if what == "covariance" else 4, seed=6)
    assert result.pooled.p_value < 0.005, result.table()


@pytest.mark.slow
def test_plugging_the_calibration_in_is_caught(calibration: bayestouch.Calibration) -> None:
    """Averages of twenty samples are so exact that the calibration's error shows: intervals of R cover too little."""
    honest = bayestouch.sbc(calibration, simulations=SIMULATIONS, samples=20, seed=3)
    plugged = bayestouch.sbc(calibration, simulations=SIMULATIONS, samples=20, plug_in=True, seed=3)
    assert honest.passes(0.01), honest.table()
    assert not plugged.passes(0.001)
    # 0.77 instead of 0.90; the difference of two shares of 500 touches scatters by 0.023
    assert plugged.coverage_90["R"] < honest.coverage_90["R"] - 0.05


def test_what_is_ranked_is_what_is_saved(calibration: bayestouch.Calibration, tmp_path: Path) -> None:
    """Ranks of the draws in a posterior file, read with a calibration from its file: the same as those of `sbc`."""
    calibration.save(tmp_path / "calibration.nc")
    saved = load_calibration(tmp_path / "calibration.nc")
    truth, touches = simulate_touches(saved, 100, 2, np.random.default_rng([7, 1]))
    bayestouch.infer(touches, saved, check_sensor=False, seed=7, output=tmp_path / "touches.nc")
    drawn = load_touches(tmp_path / "touches.nc").posterior
    assert set(TOUCH_QUANTITIES) == set(drawn)
    from_files = rank_statistics(drawn, truth)
    from_memory = bayestouch.sbc(calibration, simulations=100, samples=2, seed=7)
    for name in TOUCH_QUANTITIES:
        np.testing.assert_array_equal(from_files.ranks[name], from_memory.ranks[name])


@pytest.mark.slow
def test_touches_are_drawn_and_read_as_documented(calibration: bayestouch.Calibration) -> None:
    """Priors of touches, and noise about the prediction of each, against the numbers of docs/statistics.md."""
    n, samples = 1000, 8
    truth, touches = simulate_touches(calibration, n, samples, np.random.default_rng(8))
    place = calibration.mode["theta_s"]
    ends = {
        "R": (0.0, 12.7),
        "theta_c": (place.min() - 20, place.max() + 20),
        "P": (0.0, 3 * calibration.rows.load.mean()),
    }
    for name, (low, high) in ends.items():
        # mean and sd of n uniform numbers: 4 standard errors (kurtosis 1.8)
        assert truth[name].mean() == pytest.approx((low + high) / 2, abs=4 * (high - low) / np.sqrt(12 * n))
        assert truth[name].std() == pytest.approx((high - low) / np.sqrt(12), rel=4 * np.sqrt(0.8 / (4 * n)))
    np.testing.assert_allclose(1 / truth["R"], 1 / truth["r_c"] + 1 / 12.7, rtol=1e-9)
    load = touches.load.reshape(n, samples)
    # scatter of loads and readings within a touch: n (samples - 1) degrees of freedom, 4 errors are 3.4 %
    error = 4 / np.sqrt(2 * n * (samples - 1))
    force = np.sqrt(np.mean(calibration.posterior["force_noise_sd"] ** 2))
    assert np.sqrt(load.var(axis=1, ddof=1).mean()) == pytest.approx(force, rel=error)
    assert (load.mean(axis=1) - truth["P"]).std() == pytest.approx(force / np.sqrt(samples), rel=4 / np.sqrt(2 * n))
    readings = touches.readings.reshape(n, samples, len(ANGLES))
    noise = np.sqrt(np.mean(calibration.posterior["noise_sd"] ** 2, axis=(0, 1)))
    np.testing.assert_allclose(np.sqrt(readings.var(axis=1, ddof=1).mean(axis=0)), noise, rtol=error)


@pytest.mark.slow
def test_shrunk_draws_are_noticed_as_often_as_stated(calibration: bayestouch.Calibration) -> None:
    """Draws of touches, shrunk about their mean by 5, 10 and 20 %: mean square, and how many of 20 batches fail.

    Loads and locations alone: their posteriors are all but normal, for which the chances are computed.
    """
    batches, size, level = 20, 100, 0.05
    truth, touches = simulate_touches(calibration, batches * size, 1, np.random.default_rng(9))
    read = bayestouch.infer(touches, calibration, check_sensor=False, draws=400, seed=9)
    inner = np.abs(truth["theta_c"]) < 35  # beyond, the prior cuts the posterior off
    truth = {name: np.where(inner, truth[name], np.nan) for name in ("theta_c", "P")}
    scores = {}
    for narrow in power.NARROW:
        ranks = {}
        for name, true in truth.items():
            draws = read.posterior[name]
            centre = draws.mean(axis=(0, 1))
            ranks[name] = rank_statistics(
                {name: centre + (1 - narrow) * (draws - centre)}, {name: np.where(inner, true, centre)}
            ).ranks[name]
        scores[narrow] = np.stack([normal_scores(each) for each in ranks.values()])
    right = scores[0.0][:, inner]
    for narrow in power.NARROW[1:]:
        wrong = scores[narrow][:, inner]
        # the same ranks before and after: what is left is the scatter of the ratio, got from touches at random
        expected = power.mean_square(narrow)
        ratio = (wrong**2).mean() / (right**2).mean()
        error = (wrong**2 - ratio * right**2).mean(axis=0).std() / np.sqrt(inner.sum()) / (right**2).mean()
        assert ratio == pytest.approx(expected, abs=4 * error), narrow
        assert error < 0.1 * (expected - 1), "too coarse to tell"
        parts = [pooled_spread(part) for part in np.array_split(wrong, batches, axis=1)]
        noticed = sum(part.p_value < level for part in parts)
        count = int(np.mean([part.scores for part in parts]))
        chance = power.power(power.pooled("", count, 1, 2 * level), narrow)
        low, high = binom.ppf([1e-4, 1 - 1e-4], batches, chance)
        assert low <= noticed <= high, (narrow, chance)


@pytest.mark.parametrize(("quantities", "common"), [(3, 0.0), (12, 0.6)])
def test_pooled_statistic_fails_right_posteriors_as_often_as_it_says(quantities: int, common: float) -> None:
    """Normal scores that share a part in each simulation; ranks among 99 draws of the right posterior."""
    rng, n, repeats = np.random.default_rng(4), 200, 2000
    p, worth, squares = np.empty((3, repeats))
    for k in range(repeats):
        z = np.sqrt(1 - common**2) * rng.standard_normal((quantities, n)) + common * rng.standard_normal(n)
        found = pooled_spread(normal_scores(rng.binomial(RANKED, norm.cdf(z))))
        p[k], worth[k], squares[k] = found.p_value, found.scores, found.mean_square
    for level in (0.05, 0.005):
        # four standard errors, and a third for the number of scores being an estimate
        assert np.mean(p < level) < level * 1.33 + 4 * np.sqrt(level / repeats), level
    assert np.mean(p < 0.05) > 0.05 - 4 * np.sqrt(0.05 / repeats)
    # what the number of scores means: the variance of the mean square, which so many repeats give to sqrt(2/2000)
    assert np.var(squares) == pytest.approx(1.83 * np.mean(1 / worth), rel=4 * np.sqrt(2 / repeats))
    # squares of normal scores of correlation c have the correlation c², a little less for the ends being cut off
    least = n * quantities / (1 + (quantities - 1) * common**4)
    assert 0.98 < 1 / np.mean(1 / worth) / least < 1.15


def test_chances_of_the_power_study() -> None:
    """Against closed forms: uniform ranks of right posteriors, coverage, and chi-square with continuous scores."""
    np.testing.assert_allclose(power.rank_probabilities(0.0), 1 / (RANKED + 1), rtol=1e-6)
    assert power.mean_square(0.0) == pytest.approx(1.0, rel=1e-6)
    # 99 draws cut the ends off: 1/0.95² = 1.108 becomes 1.095
    assert 0.85 < (power.mean_square(0.05) - 1) / (0.95**-2 - 1) < 1
    assert power.covered(0.05) == pytest.approx(2 * norm.cdf(0.95 * norm.ppf(0.95)) - 1, rel=1e-12)
    check = power.pooled("", 1200, 1)
    assert power.power(check, 0.0, 4000) == pytest.approx(0.005, abs=4 * np.sqrt(0.005 / 4000))
    exact = chi2.sf(chi2.isf(0.0025, 1200) * 0.95**2, 1200)
    assert power.power(check, 0.05, 1000) == pytest.approx(exact, abs=0.12)  # 0.46; less for the ends cut off
    assert power.power(power.pooled("", 2000, power.TOUCH), 0.05) > 0.9
    assert power.power(power.pooled("", 340, power.CALIBRATION), 0.05) > 0.9


def test_statistic_on_known_ranks() -> None:
    """4,000 simulations, 10 % too narrow: noticed with a chance of 1 (mean square 9 standard errors off)."""
    rng = np.random.default_rng(0)
    truth = rng.standard_normal(4000)
    right = rng.standard_normal((4, 250, 4000))
    result = rank_statistics({"x": right, "narrow": 0.9 * right}, {"x": truth, "narrow": truth})
    assert result.p_value["x"] > 1e-3
    assert result.p_value["narrow"] < 1e-6
    error = np.sqrt(1.83 * power.mean_square(0.1) ** 2 / 4000)
    assert result.mean_square["x"] == pytest.approx(1.0, abs=4 * error)
    assert result.mean_square["narrow"] == pytest.approx(power.mean_square(0.1), abs=4 * error)
    assert result.ranks["x"].min() >= 0
    assert result.ranks["x"].max() <= RANKED
    assert (RANKED + 1) % BINS == 0, "bins would not be equally likely"
    figure = result.plot()
    assert len(figure.axes) == 2
    assert all(axis.get_xlabel() for axis in figure.axes)


def test_too_few_simulations_are_refused(calibration: bayestouch.Calibration) -> None:
    with pytest.raises(InputError, match="at least"):
        bayestouch.sbc(calibration, simulations=10)


@pytest.mark.parametrize(
    ("option", "least", "wrong"), [("samples", 1, 0), ("samples", 1, 1.5), ("simulations", 100, "a"), ("seed", 0, -1)]
)
def test_an_option_that_is_no_whole_number_is_refused_by_its_name(
    calibration: bayestouch.Calibration, option: str, least: int, wrong: object
) -> None:
    message = f"^{option}: expected a whole number, at least {least}, got {re.escape(repr(wrong))}$"
    with pytest.raises(InputError, match=message):
        bayestouch.sbc(calibration, **{option: wrong})  # type: ignore[arg-type]


@pytest.mark.parametrize("draws", [0, 99])
@pytest.mark.parametrize("kind", ["touches", "finger", "pad"])
def test_too_few_draws_for_a_rank_are_refused(calibration: bayestouch.Calibration, kind: str, draws: int) -> None:
    of = calibration if kind == "touches" else small_finger(30.0, 5.0, slice(2, 5))
    with pytest.raises(InputError, match=f"draws: expected a whole number, at least 100, got {draws}"):
        bayestouch.sbc(of, simulations=100, draws=draws, kernel="gaussian" if kind == "pad" else None)


@pytest.mark.parametrize(
    "options", [{"priors": {"mu": LogNormal(0.1, 0.1)}}, {"contact": "hertz"}], ids=["priors", "contact"]
)
def test_options_of_a_finger_are_refused_with_a_kernel(options: dict[str, Any]) -> None:
    design = PadDesign(element_x_mm=(0.0, 5.0, 10.0), element_y_mm=None, calibration_step_mm=0.75, n_touches=2)
    with pytest.raises(InputError, match="priors and contact are options of a finger's calibration"):
        bayestouch.sbc(bayestouch.simulate(design, seed=1).dataset, kernel="gaussian", **options)


def test_a_prior_of_mu_without_a_contact_is_refused() -> None:
    """Softer than the rubber on which a flat under 3.2 times the largest load has a contact, in one line."""
    soft, data = {"mu": Normal(0.004, 0.001)}, small_finger(30.0, 5.0, slice(2, 5))
    design = CalibrationDesign.of(data, soft, "hertz", 100, 5)
    largest = LOAD_REACH * float(design.touches.averaged().load.max())
    lowest = np.exp(softest(design.finger, largest, 0.0))
    message = f"prior of mu: softer than {lowest:.3g} MPa"
    assert 0.01 < lowest < 0.1
    with pytest.raises(InputError, match=message):
        simulate_and_rank(design, 0)
    with pytest.raises(InputError, match=message):
        bayestouch.calibrate(data, priors=soft, draws=100)
    # Half of it on harder rubber is enough: draws are from this half.
    near = replace(design, drawn_from={**design.drawn_from, "mu": LogNormal(lowest, 0.1)})
    drawn = [draw_parameters(near, 4.0, np.random.default_rng(seed))["mu"] for seed in range(200)]
    assert min(drawn) > lowest
    assert np.median(drawn) == pytest.approx(lowest * np.exp(0.1 * norm.ppf(0.75)), rel=0.03)


def test_locations_on_a_finger_with_elements_all_around(calibration: bayestouch.Calibration) -> None:
    """One turn, 5° beyond the outermost elements, as `infer` reads them."""
    around = replace(calibration, mode={**calibration.mode, "theta_s": np.linspace(-180.0, 170.0, len(ANGLES))})
    found = simulate_touches(around, 300, 1, np.random.default_rng(8))[0]["theta_c"]
    assert -185 <= found.min() < -180 and 170 < found.max() <= 175


def small_finger(span: float, step: float, elements: slice) -> DataSet:
    """A finger of a few elements with touches around them, four samples each."""
    touches = known_touches(11, step=step)
    touches = touches.select(np.abs(touches.angle_deg) < span)
    part = touches.with_(readings=touches.readings[:, elements])
    few = replace(sensor(), body=Finger(9.4, 12.7, 9.9, ANGLES[elements]))
    return DataSet(few, part, part, None, ())


def design_of_three(draws: int = 200) -> CalibrationDesign:
    """Three elements, by Hertz, whose contacts are quick."""
    return CalibrationDesign.of(small_finger(30.0, 5.0, slice(2, 5)), {}, "hertz", draws, 5)


def test_parameters_are_drawn_from_the_documented_priors() -> None:
    """Mean and sd of draws against the numbers of docs/statistics.md, not against the objects that hold them."""
    design, n, reads = design_of_three(), 2000, 4.0
    rng = np.random.default_rng(3)
    drawn = [draw_parameters(design, reads, rng) for _ in range(n)]
    values = {name: np.array([each[name] for each in drawn]) for name in drawn[0]}
    nominal = np.array(ANGLES[2:5])
    own = {name: design.drawn_from[name].median for name in ("response", "noise_sd", "force_noise_sd")}
    expected = {
        "sigma": (values["sigma"], 0.46, 0.02),
        "log mu": (np.log(values["mu"]), np.log(0.15), np.log(1.35)),
        "r_s": (values["r_s"], 9.9, 0.33),
        "theta_s": (values["theta_s"] - nominal, 0.0, 2.2),
        "log response": (np.log(values["response"]), np.log(own["response"]), np.log(1.3)),
        "log noise_sd": (np.log(values["noise_sd"]), np.log(own["noise_sd"]), np.log(1.5)),
        "log force_noise_sd": (np.log(values["force_noise_sd"]), 0.0, np.log(1.5)),
        "log discrepancy": (
            np.log(values["discrepancy_sd"] / values["noise_sd"] * np.sqrt(reads)),
            np.log(0.3),
            np.log(3.0),
        ),
    }
    for name, (found, mean, sd) in expected.items():
        if name == "r_s":  # inside the rubber, which begins 1.5 sds below
            low, high = (np.array([9.4033, 12.6967]) - 9.9) / 0.33
            mass = norm.cdf(high) - norm.cdf(low)
            shift = (norm.pdf(low) - norm.pdf(high)) / mass
            bend = (low * norm.pdf(low) - high * norm.pdf(high)) / mass
            mean, sd = mean + shift * sd, sd * np.sqrt(1 + bend - shift**2)
        assert found.mean() == pytest.approx(mean, abs=4 * sd / np.sqrt(found.size)), name
        assert found.std() == pytest.approx(sd, rel=4 / np.sqrt(2 * found.size)), name


@pytest.mark.slow  # a minute: 120 calibrations
def test_calibrations_with_shrunk_draws_are_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Draws that `calibrate` returns 10 % too narrow: stated chance of the pooled statistic 0.99; not so right ones."""
    design, n = design_of_three(400), 120
    honest, made = calibration_checks.calibrate, list[bayestouch.Calibration]()

    def kept(*inputs: object, **options: object) -> bayestouch.Calibration:
        made.append(honest(*inputs, **options))  # type: ignore[arg-type]
        return made[-1]

    def shrunk(*inputs: object, **options: object) -> bayestouch.Calibration:
        result = made.pop(0)
        centre = {name: values.mean(axis=(0, 1)) for name, values in result.posterior.items()}
        draws = {name: centre[name] + 0.9 * (values - centre[name]) for name, values in result.posterior.items()}
        return replace(result, posterior=draws)

    monkeypatch.setattr(calibration_checks, "calibrate", kept)
    right = ranked([simulate_and_rank(design, number) for number in range(n)])
    monkeypatch.setattr(calibration_checks, "calibrate", shrunk)
    wrong = ranked([simulate_and_rank(design, number) for number in range(n)])
    assert right.passes(0.01), right.table()
    assert wrong.pooled.p_value < 0.005, wrong.table()


def ranked(pieces: list[dict[str, tuple[int, bool]]]) -> RankStatistics:
    ranks = {name: np.array([piece[name][0] for piece in pieces]) for name in pieces[0]}
    return of_ranks(ranks, {name: float(np.mean([piece[name][1] for piece in pieces])) for name in ranks})


@pytest.mark.slow
def test_a_calibration_that_takes_the_model_to_be_perfect_is_caught() -> None:
    """Of fingers that miss the model twice as much as the noise; the stated prior then is far off."""
    design = design_of_three()
    often = replace(
        design,
        assumed=dict(design.assumed) | {"discrepancy_sd": LogNormal(1e-3, 0.1)},
        drawn_from=dict(design.drawn_from) | {"discrepancy_sd": LogNormal(2.0, 0.1)},
    )
    wrong = check_calibration(often, 40, None)
    assert not wrong.passes(0.001), wrong.table()
    assert min(wrong.mean_square[f"response e{e:02d}"] for e in (1, 2, 3)) > 1.5


def test_a_calibration_that_the_simulation_does_not_know_is_refused(calibration: bayestouch.Calibration) -> None:
    for more in ({"e_map": "empirical"}, {"effects": "[]"}):
        other = replace(calibration, settings={**calibration.settings, **more})
        with pytest.raises(InputError, match="simulates the elastic model"):
            bayestouch.sbc(other)


def test_functions_of_place_are_refused() -> None:
    """They are read, but not simulated; without them the same touches are calibrated as the message says."""
    data = small_finger(30.0, 3.0, slice(2, 5))
    with pytest.raises(InputError, match='discrepancy="touch"'):
        bayestouch.sbc(bayestouch.calibrate(data, discrepancy="place", draws=100), simulations=100)
    plain = bayestouch.calibrate(data, discrepancy="touch", draws=100)
    ranks = bayestouch.sbc(plain, simulations=100, draws=100, method="importance").ranks
    assert tuple(ranks) == TOUCH_QUANTITIES


def test_options_of_the_other_posterior_are_refused(calibration: bayestouch.Calibration) -> None:
    with pytest.raises(InputError, match="options of a calibration's touches"):
        bayestouch.sbc(small_finger(30.0, 5.0, slice(2, 5)), plug_in=True)
    with pytest.raises(InputError, match="options of a data set's calibration"):
        bayestouch.sbc(calibration, priors={"mu": LogNormal(0.1, 0.1)})
