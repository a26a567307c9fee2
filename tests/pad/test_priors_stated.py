"""Stated priors and the E map of a pad: posteriors as products of likelihood and prior, densities written out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from pad_simulation import line
from scipy.stats import norm, uniform

import bayestouch
from bayestouch.effects.stated import StatedModel
from bayestouch.errors import InputError
from bayestouch.model.fitting import SETTLED
from bayestouch.pad.calibration import choose_pad
from bayestouch.pad.planned import planned
from bayestouch.priors.parameters import LogNormal, Normal, Prior, StudentT, Uniform
from bayestouch.results.keys import STATED_MAP, STATED_PRIORS

M = 4
#: 2000 draws know a mean to 2 % of its sd and an sd to 1.6 %; the density is normal only approximately.
MEAN, SD = 0.1, 0.05
SIGNS = ((1, 1), (1, -1), (-1, 1), (-1, -1))
CREEP = StatedModel("pad", "", (("creep", {}),))


@pytest.fixture(scope="module")
def dataset() -> bayestouch.DataSet:
    pad, rng = line(), np.random.default_rng(3)
    place = np.linspace(6, 32, 30)[:, None]
    table = pad.touch(place, rng, load=rng.uniform(0.8, 1.2, 30), measured=True, samples=2)
    # A force sensor that is so good that loads do not relate the gains.
    return replace(pad.dataset(table), sensor=replace(pad.sensor, force_noise_sd=1e-4))


def calibrated(
    dataset: bayestouch.DataSet, priors: dict[str, Prior] | None = None, draws: int = 2000, **changes: object
):
    options = {"kernel": "gaussian", "e_map": "model", "draws": draws, "seed": 2} | changes
    return bayestouch.calibrate(dataset, priors=priors, **options)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def free(dataset: bayestouch.DataSet) -> bayestouch.Calibration:
    return calibrated(dataset)


def product(mean: np.ndarray, sd: np.ndarray, of_prior: np.ndarray, width: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean and sd of the product of two normal densities."""
    precision = sd**-2.0 + width**-2.0
    return (mean / sd**2 + of_prior / width**2) / precision, precision**-0.5


def test_a_prior_of_the_kernel_combines_with_the_likelihood(
    dataset: bayestouch.DataSet, free: bayestouch.Calibration
) -> None:
    """The default prior of w is a hundred times as wide as the posterior, so that this is the likelihood."""
    width = free.posterior["w"]
    stated = Normal(float(width.mean() + width.std()), float(width.std()))
    calibration = calibrated(dataset, {"w": stated})
    mean, sd = product(width.mean(), width.std(), np.array(stated.mean), np.array(stated.sd))
    assert calibration.posterior["w"].mean() == pytest.approx(mean, abs=MEAN * sd)
    assert calibration.posterior["w"].std() == pytest.approx(sd, rel=SD)
    (own,) = (each.prior for each in calibration.parameters if each.name == "w")
    assert own == Normal(stated.mean, stated.sd, 0.0)
    assert calibration.settings[STATED_PRIORS] == "w" and calibration.settings[STATED_MAP] == "model"
    assert STATED_PRIORS not in free.settings


def test_priors_of_the_elements_combine_with_the_likelihood(dataset: bayestouch.DataSet) -> None:
    """As in any linear Gaussian model the precisions of likelihood and priors add, correlations included.

    All elements are the same and at their nominal places, so that the priors are near each: there the model is linear.
    Loads hardly vary, so that readings peak where the elements are. The likelihood is that of the public density.
    """
    made = line()
    same = replace(made.chain, gain=np.full(M, 13.0), offset=np.full(M, 0.1), position=made.nominal + 10)
    pad, rng = replace(made, chain=same), np.random.default_rng(7)
    table = pad.touch(np.arange(7.0, 32.0)[:, None], rng, load=rng.uniform(0.99, 1.01, 25), measured=True, samples=2)
    data = replace(pad.dataset(table), sensor=dataset.sensor)
    stated = {"gain": Normal(13.1, 0.07), "offset": Normal(0.12, 0.02), "x_s": Normal(0.02, 0.01)}
    calibration = calibrated(data, stated, draws=4000)
    density = bayestouch.log_density(calibration, data)
    slope, curvature = quadratic(density.log_likelihood, density.start, np.sqrt(np.diag(density.covariance)))
    # The last coordinate is log w, whose default prior is log-normal about half the pitch within a factor of 2.
    sd = np.append(np.repeat([each.sd for each in stated.values()], M), np.log(2.0))
    centre = np.append(np.repeat([each.mean for each in stated.values()], M), np.log(3.0))
    centre[2 * M : 3 * M] += nominal_places(data)
    covariance = np.linalg.inv(np.diag(sd**-2.0) - curvature)
    expected = density.start + covariance @ (slope + (centre - density.start) / sd**2)
    spread = np.sqrt(np.diag(covariance))
    own = density.from_parameters({n: v.reshape(-1, *v.shape[2:]) for n, v in calibration.posterior.items()})
    # 4000 draws, some 2500 of them independent, know a mean to 2 % of its sd and an sd to 1.4 %.
    np.testing.assert_allclose((own.mean(axis=0) - expected) / spread, 0, atol=MEAN)
    np.testing.assert_allclose(own.std(axis=0), spread, rtol=SD)
    # The priors matter: without them the sds would be larger by more than a fifth.
    assert np.mean(np.sqrt(np.diag(np.linalg.inv(-curvature)))[:-1] / spread[:-1]) > 1.2


def nominal_places(dataset: bayestouch.DataSet) -> np.ndarray:
    """Nominal places moved to where readings peak, (m,): the means of the default priors."""
    return choose_pad(dataset, kernel="gaussian", empirical=False).problem.priors.position[:, 0]


def quadratic(
    function: Callable[[np.ndarray], np.ndarray], at: np.ndarray, step: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Gradient and second derivatives of a function by central differences."""
    d = len(at)
    moves = step * np.eye(d)
    pairs = [(i, j) for i in range(d) for j in range(d)]
    ends = [function(np.array([at + a * moves[i] + b * moves[j] for i, j in pairs])) for a, b in SIGNS]
    second = sum(a * b * end for (a, b), end in zip(SIGNS, ends, strict=True)).reshape(d, d) / 4
    first = 0.5 * (function(at + moves) - function(at - moves))
    return first / step, second / np.outer(step, step)


def test_the_log_density_changes_by_that_of_the_prior(
    dataset: bayestouch.DataSet, free: bayestouch.Calibration
) -> None:
    """Each prior written out with SciPy, at the same points; the likelihood is the same."""
    stated = {
        "w": Uniform(2.0, 3.0), "gain": LogNormal(13.0, 0.3), "offset": Normal(0.1, 0.5), "x_s": Uniform(-1.0, 1.0)
    }  # fmt: skip
    calibration = calibrated(dataset, stated, draws=64)
    before, after = (bayestouch.log_density(each, dataset) for each in (free, calibration))
    values = {name: draws.reshape(-1, *draws.shape[2:])[:20] for name, draws in calibration.posterior.items()}
    old, new = before.from_parameters(values), after.from_parameters(values)
    priors = choose_pad(dataset, kernel="gaussian", empirical=False).problem.priors
    amplitude, nominal = priors.amplitude, priors.position[:, 0]
    gain, offset, place, width = (values[name] for name in ("gain", "offset", "x_s", "w"))
    by_default = norm(0, 10 * amplitude).logpdf(gain) + norm(priors.offset, priors.offset_sd).logpdf(offset)
    by_default = (by_default + norm(nominal, 3.0).logpdf(place)).sum(axis=1)
    by_default += norm(np.log(3.0), np.log(2.0)).logpdf(np.log(width))  # half the pitch, in the logarithm
    by_stated = norm(np.log(13.0), 0.3).logpdf(np.log(gain)) + norm(0.1, 0.5).logpdf(offset)
    by_stated = (by_stated + uniform(nominal - 1.0, 2.0).logpdf(place)).sum(axis=1) + uniform(2.0, 1.0).logpdf(width)
    np.testing.assert_allclose(before.log_prior(old), by_default, rtol=1e-10)
    np.testing.assert_allclose(after.log_prior(new), by_stated, rtol=1e-10)
    assert after.names[0] == "log gain[0]" and after.names[-1] == "w"


def test_groups_have_the_stated_prior(dataset: bayestouch.DataSet) -> None:
    made = calibrated(dataset, {"gain": LogNormal(13.0, 0.01)}, draws=400, groups=["prior", "log_prior"])
    prior = np.log(made.groups["prior"]["gain"])
    # 1600 draws of a normal variable: 2.5 % of its sd for the mean, 1.8 % for the sd, four times each
    assert prior.mean() == pytest.approx(np.log(13.0), abs=0.1 * 0.01)
    assert prior.std() == pytest.approx(0.01, rel=0.072)
    gain = made.posterior["gain"]
    expected = norm(np.log(13.0), 0.01).logpdf(np.log(gain)) - np.log(gain)
    np.testing.assert_allclose(made.groups["log_prior"]["gain"], expected, rtol=1e-10)


def test_a_prior_of_places_is_of_the_difference_from_the_nominal_ones(dataset: bayestouch.DataSet) -> None:
    """The stated object is about 0, draws are about each place; elements are moved together by some 10 mm."""
    made = calibrated(dataset, draws=400, groups=["prior"])
    of = {each.name: each for each in made.parameters}
    assert of["x_s"].prior == Normal(0.0, 3.0) and str(of["x_s"].prior) == "normal, 0 ± 3"
    assert [name for name, each in of.items() if each.relative] == ["gain", "offset", "x_s"]
    drawn = made.groups["prior"]["x_s"]
    centre = drawn.mean(axis=(0, 1))
    # 400 draws of an sd of 3 mm: 0.15 mm for a mean, 0.11 mm for an sd, four times each (a difference: six times).
    np.testing.assert_allclose(np.diff(centre), 6.0, atol=0.9)
    np.testing.assert_allclose(drawn.std(axis=(0, 1)), 3.0, atol=0.44)
    assert centre[0] == pytest.approx(10.0, abs=1.0)


def test_a_stated_prior_counts_in_plans_and_after_a_file(dataset: bayestouch.DataSet, tmp_path) -> None:
    """Gains that are known to 1e-6 stay so, whatever is planned."""
    made = calibrated(dataset, {"gain": LogNormal(13.0, 1e-6)}, draws=64)
    made.save(tmp_path / "c.nc")
    read = bayestouch.load(tmp_path / "c.nc")
    assert isinstance(read, bayestouch.Calibration)
    sd = np.sqrt(np.diag(planned(read, dataset.calibration).readings.covariance))[:M]
    np.testing.assert_allclose(sd, 13e-6, rtol=0.01)
    start = [bayestouch.log_density(each, dataset).start for each in (made, read)]
    np.testing.assert_array_equal(*start)


def test_with_every_kernel_a_prior_applies_where_it_can(dataset: bayestouch.DataSet) -> None:
    made = choose_pad(
        dataset, kernel="auto", empirical=False, stated={"w": Normal(2.6, 0.001), "sigma": Normal(0.4, 0.01)}
    )
    found = {
        (name, each.name): value
        for name, rival in made.rivals.items()
        for each, value in zip(rival.kernel.parameters, rival.fit.chain.values, strict=True)
    }
    assert found["gaussian", "w"] == pytest.approx(2.6, abs=0.004)
    assert found["layer", "sigma"] == pytest.approx(0.4, abs=0.04)
    unused = {"gaussian": "sigma", "layer": "w", "layer-line": "w"}.get(made.name, "w and sigma")
    assert any(note.startswith(f"prior of {unused}: not used, because") for note in made.notes)


@pytest.mark.parametrize("e_map", ["model", "empirical"])
def test_the_map_is_as_asked_for(dataset: bayestouch.DataSet, e_map: str) -> None:
    made = calibrated(dataset, draws=64, e_map=e_map)
    assert made.settings["empirical_map"] == {"model": "no", "empirical": "yes"}[e_map]
    assert made.settings[STATED_MAP] == e_map
    density = bayestouch.log_density(made, dataset)
    draws = density.from_parameters({n: v.reshape(-1, *v.shape[2:]) for n, v in made.posterior.items()})
    np.testing.assert_allclose(made.groups["sample_stats"]["lp"].ravel(), density(draws), rtol=1e-8)


def with_creep(dataset: bayestouch.DataSet) -> bayestouch.DataSet:
    """Readings that rise within a touch by the share of creep: 1 + 0.1 (1 - exp(-t / 1 s))."""
    pad, rng = line(), np.random.default_rng(3)
    table = pad.touch(np.linspace(6, 32, 30)[:, None], rng, load=rng.uniform(0.8, 1.2, 30), measured=True, samples=6)
    held = 0.5 * np.asarray(table.sample)
    readings = table.readings + (table.readings - pad.chain.offset) * 0.1 * (1 - np.exp(-held))[:, None]
    table = table.with_(readings=readings, time_s=10.0 * np.asarray(table.touch) + held)
    return replace(pad.dataset(table), sensor=dataset.sensor)


def test_priors_and_the_map_beside_effects(dataset: bayestouch.DataSet) -> None:
    """A narrow prior holds its parameter; the map is as asked for; the density is that of the draws."""
    data, stated = with_creep(dataset), {"w": Normal(2.6, 1e-4), "gain": LogNormal(13.0, 0.3)}
    for e_map in ("model", "empirical"):
        made = calibrated(data, stated, draws=400, e_map=e_map, model=CREEP)
        assert made.posterior["w"].mean() == pytest.approx(2.6, abs=5e-4)
        assert made.posterior["w"].std() == pytest.approx(1e-4, rel=0.15)
        assert made.settings["empirical_map"] == {"model": "no", "empirical": "yes"}[e_map]
        share = made.posterior["creep_share"]
        assert abs(share.mean() - 0.1) < 4 * share.std() < 0.1
        density = bayestouch.log_density(made, data)
        flat = {n: v.reshape(-1, *v.shape[2:]) for n, v in made.posterior.items()}
        log = density(density.from_parameters(flat))
        # The fit is repeated from other starting values; a fit ends when a step gains less than 0.05.
        np.testing.assert_allclose(made.groups["sample_stats"]["lp"].ravel(), log, atol=SETTLED)


def test_the_kernel_alone_has_no_correction(dataset: bayestouch.DataSet) -> None:
    model = replace(CREEP, correction=True)
    made = calibrated(with_creep(dataset), draws=64, model=model)
    assert any(note.startswith("no correction is added: on a pad it is an empirical map") for note in made.notes)


def test_what_cannot_be_is_refused_in_a_line(dataset: bayestouch.DataSet) -> None:
    thick = replace(dataset, sensor=replace(dataset.sensor, body=replace(dataset.sensor.body, thickness_mm=5.0)))
    for data, kernel, priors, said in (
        (dataset, "gaussian", {"h": Normal(5, 1)}, "prior of h: not a parameter of a pad with the gaussian kernel"),
        (dataset, "gaussian", {"y_s": Normal(0, 1)}, r"prior of y_s: .* expected one of w, gain, offset, x_s"),
        (dataset, "auto", {"gian": Normal(0, 1)}, "prior of gian: not a parameter of a pad, did you mean gain|gian"),
        (dataset, "layer", {"sigma": Uniform(0.5, 0.6)}, "prior of sigma: nothing of the prior"),
        (dataset, "gaussian", {"w": Normal(-5, 0.1)}, "prior of w: nothing of the prior"),
        (dataset, "gaussian", {"x_s": Uniform(1.0, 2.0)}, "prior of x_s: .* excludes the nominal places"),
        (dataset, "gaussian", {"x_s": LogNormal(1.0, 2.0)}, "prior of x_s: expected a normal or uniform prior"),
        (thick, "layer", {"h": Normal(8.0, 0.1)}, "prior of h: .* excludes the thickness as built, 5 mm"),
        (dataset, "gaussian", {"gain": StudentT(10.0, 1.0, 4.0)}, "expected a normal, uniform or log-normal prior"),
    ):
        for model in (None, CREEP):
            with pytest.raises(InputError, match=said):
                bayestouch.calibrate(data, kernel=kernel, priors=priors, model=model)
    with pytest.raises(InputError, match="a pad has no contact model, choose a kernel"):
        bayestouch.calibrate(dataset, contact="layer")
