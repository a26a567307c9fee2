"""What a calibration file holds, against the information of its touches written out.

Expected covariances are inverse information matrices (readings linear in the parameters over a posterior's width,
which these touches hold to a per cent), averaged over the noise that is not known exactly. Of n draws in d dimensions
the mean ratio of variances scatters by sqrt(2/(n d)), and 5 % of a standard deviation is 10 % of a variance.
"""

from __future__ import annotations

import numpy as np
import pytest
import written_out as w
import xarray as xr
from calibrated_files import Calibrated
from independent.body import Annulus, solve
from scipy import stats

M = w.ELEMENTS
#: Rows of `written_out.parameters_of` by the names in the file.
BLOCKS = {
    "response": slice(0, M),
    "r_s": slice(M, 2 * M),
    "theta_s": slice(2 * M, 3 * M),
    "sigma": slice(3 * M, 3 * M + 1),
    "mu": slice(3 * M + 1, 3 * M + 2),
}
#: Effective draws of the fixture, at least: nine in ten of 4,000 are accepted.
ESS = 3000
#: Readings are linear in the parameters to this share of a variance.
LINEAR = 0.015


def expected_covariance(known: Calibrated) -> np.ndarray:
    """Covariance of response, depth, angle, σ and log μ that the touches leave, averaged over the noise's draws."""
    draws = known.draws
    centre = w.parameters_of(draws).mean(axis=0)
    slope, by_load = w.slopes(centre, known.pressed), w.slope_over_load(w.finger_at(centre), known.pressed)
    prior = np.diag(w.prior_sd(centre) ** -2.0)
    some = range(0, len(draws["sigma"]), 80)
    total = np.zeros_like(prior)
    for i in some:
        variance = draws["noise_sd"][i] ** 2 / known.samples + draws["discrepancy_sd"][i] ** 2
        load_variance = float(draws["force_noise_sd"][i]) ** 2 / known.samples
        total += np.linalg.inv(w.information(slope, by_load, variance, load_variance) + prior) / len(some)
    return total


@pytest.fixture(scope="module")
def expected(well_known: Calibrated) -> np.ndarray:
    return expected_covariance(well_known)


@pytest.mark.parametrize("name", BLOCKS)
def test_draws_on_file_spread_as_the_touches_leave_them(
    name: str, well_known: Calibrated, expected: np.ndarray
) -> None:
    """Draws of each parameter; 5 % narrower ones have 10 % less variance, and 10 % against 4 sds is at least 1.4 sds
    more than what is allowed for one parameter, 5 for the five of the elements."""
    rows = BLOCKS[name]
    found = np.atleast_2d(np.cov(w.parameters_of(well_known.draws).T[rows]))
    size = len(found)
    error = 3 * np.sqrt(2 / (ESS * size)) if size == 1 else 4 * np.sqrt(2 / (ESS * size))
    assert w.mean_ratio(found, expected[rows, rows]) == pytest.approx(1, abs=error + LINEAR)


def test_the_covariance_on_file_is_that_of_the_touches(well_known: Calibrated, expected: np.ndarray) -> None:
    """What touches are read with: all 17 parameters together, and each kind by itself."""
    found = well_known.group("laplace")["covariance"]
    with xr.open_datatree(well_known.path) as tree:
        named = [str(name) for name in tree["laplace"]["row"].values]
    by_element = [f"{name}[{e}]" for name in ("response", "r_s", "theta_s_rad") for e in range(M)]
    assert named == [*by_element, "sigma", "log_mu"]
    assert w.mean_ratio(found, expected) == pytest.approx(1, abs=4 * np.sqrt(2 / (ESS * len(found))) + LINEAR)
    for name in ("response", "r_s", "theta_s"):
        rows = BLOCKS[name]
        ratio = w.mean_ratio(found[rows, rows], expected[rows, rows])
        assert ratio == pytest.approx(1, abs=4 * np.sqrt(2 / (ESS * M)) + LINEAR), name
    # as correlated as expected: of the whitened covariance no entry off the diagonal is beyond 5 sds of 1/sqrt(ESS)
    root = np.linalg.inv(np.linalg.cholesky(expected))
    white = root @ found @ root.T
    assert np.abs(white - np.diag(np.diag(white))).max() < 5 / np.sqrt(ESS) + LINEAR


def test_draws_on_file_lie_where_readings_and_priors_put_them(well_known: Calibrated, expected: np.ndarray) -> None:
    """One Newton step of the written-out posterior from the mean of the draws: a tenth of an sd at most.

    The mean of 3,000 draws scatters by 0.018 sd; the rest is the posterior's skewness and the noise's own spread.
    """
    draws, pressed = well_known.draws, well_known.pressed
    centre = w.parameters_of(draws).mean(axis=0)
    chain, means = w.finger_at(centre), well_known.table.averaged()
    as_read = w.Pressed(pressed.radius, pressed.angle, means.load)
    slope, by_load = w.slopes(centre, as_read), w.slope_over_load(chain, as_read)
    left = means.readings - chain.predict(as_read.radius, as_read.angle, as_read.load)
    variance = (draws["noise_sd"] ** 2).mean(axis=0) / 6 + (draws["discrepancy_sd"] ** 2).mean(axis=0)
    load_variance = (draws["force_noise_sd"] ** 2).mean() / 6
    pull = np.zeros(len(centre))
    for touch in range(len(left)):
        covariance = np.diag(variance) + load_variance * np.outer(by_load[touch], by_load[touch])
        pull += slope[:, touch] @ np.linalg.solve(covariance, left[touch])
    built = np.concatenate([centre[:M], np.full(M, w.DEPTH), np.radians(w.ANGLES), [0.46, np.log(0.15)]])
    pull += (built - centre) / w.prior_sd(centre) ** 2
    step = expected @ pull / np.sqrt(np.diag(expected))
    assert np.abs(step).max() < 0.1


def test_noise_on_file_is_what_repeats_and_residuals_say(well_known: Calibrated) -> None:
    """Log noise of each element on a grid with its discrepancy: chi-squares of the repeats and of what the fit leaves.

    The sd of log s is 4.4 % here; of 3,000 draws it is good to 1.3 % in each element, 0.6 % in the mean of five. What
    the fit spends on an element (3.4 of 50 readings, its share of 17 parameters) is worth 0.7 % of the sd.
    """
    draws, t, n = well_known.draws, len(well_known.pressed.load), well_known.samples
    centre = w.parameters_of(draws).mean(axis=0)
    raw = well_known.table.readings.reshape(t, n, M)
    means = raw.mean(axis=1)
    squares = ((raw - means[:, None]) ** 2).sum(axis=(0, 1))
    as_read = w.Pressed(well_known.pressed.radius, well_known.pressed.angle, well_known.table.averaged().load)
    left = means - w.finger_at(centre).predict(as_read.radius, as_read.angle, as_read.load)
    by_load = w.slope_over_load(w.finger_at(centre), as_read)
    force = (draws["force_noise_sd"] ** 2).mean() / n
    log_tau = np.linspace(np.log(0.3) - 5 * np.log(3), np.log(0.3) + 4 * np.log(3), 200)
    ratios, offs = [], []
    for e in range(M):
        log_s = np.log(w.NOISE) + np.linspace(-0.35, 0.35, 200)
        s, tau = np.exp(log_s)[:, None], np.exp(log_tau)
        log = stats.chi2(t * (n - 1)).logpdf(squares[e] / s**2) + np.log(1 / s**2)
        for touch in range(t):
            sd = np.sqrt(s**2 * (1 + tau**2) / n + force * by_load[touch, e] ** 2)
            # the fit has taken its share of each residual
            log = log + stats.norm(0, sd).logpdf(left[touch, e]) * (1 - 17 / (M * t))
        log = log + stats.norm(np.log(0.3), np.log(3)).logpdf(log_tau)
        weight = np.exp(log - log.max())
        marginal = weight.sum(axis=1) / weight.sum()
        mean = marginal @ log_s
        sd_s = np.sqrt(marginal @ (log_s - mean) ** 2)
        found = np.log(draws["noise_sd"][:, e])
        ratios.append(found.std() / sd_s)
        offs.append((found.mean() - mean) / sd_s)
    assert np.mean(ratios) == pytest.approx(1, abs=4 * np.sqrt(1 / (2 * ESS * M)) + 0.01)
    # each centre within a quarter of an sd (1 % of the noise): residuals on a grid know nothing of the other elements
    assert np.abs(offs).max() < 0.25


def test_force_noise_on_file_is_what_repeated_loads_say(well_known: Calibrated) -> None:
    """250 degrees of freedom of repeats, the stated prior (a factor of 1.5), and what readings of a touch share.

    The sd of log s_F is 4.2 %; that of 3,000 draws is good to 1.3 % of itself.
    """
    draws, t, n = well_known.draws, len(well_known.pressed.load), well_known.samples
    load = well_known.table.load.reshape(t, n)
    squares = ((load - load.mean(axis=1, keepdims=True)) ** 2).sum()
    chain = w.finger_at(w.parameters_of(draws).mean(axis=0))
    as_read = w.Pressed(well_known.pressed.radius, well_known.pressed.angle, load.mean(axis=1))
    left = well_known.table.averaged().readings - chain.predict(as_read.radius, as_read.angle, as_read.load)
    by_load = w.slope_over_load(chain, as_read)
    variance = np.diag((draws["noise_sd"] ** 2).mean(axis=0) / n + (draws["discrepancy_sd"] ** 2).mean(axis=0))
    log_s = np.linspace(-0.4, 0.4, 201)
    log = stats.chi2(t * (n - 1)).logpdf(squares / np.exp(2 * log_s)) - 2 * log_s
    log = log + stats.norm(0, np.log(1.5)).logpdf(log_s)
    for i, one in enumerate(log_s):
        for touch in range(t):
            covariance = variance + np.exp(2 * one) / n * np.outer(by_load[touch], by_load[touch])
            log[i] += stats.multivariate_normal(np.zeros(M), covariance).logpdf(left[touch])
    weight = np.exp(log - log.max()) / np.exp(log - log.max()).sum()
    mean = weight @ log_s
    sd = np.sqrt(weight @ (log_s - mean) ** 2)
    found = np.log(draws["force_noise_sd"])
    assert found.std() / sd == pytest.approx(1, abs=3 / np.sqrt(2 * ESS))
    # the residuals of the fit are a little smaller than those at the truth
    assert abs(found.mean() - mean) < 0.2 * sd


def test_noise_for_reading_touches_is_the_mean_square_of_the_draws(well_known: Calibrated) -> None:
    """A new reading's variance is the mean of the variances that the draws say."""
    draws, noise = well_known.draws, well_known.group("noise")
    pairs = {"tactile_sd": "noise_sd", "discrepancy_sd": "discrepancy_sd", "force_sd": "force_noise_sd"}
    for name, of_draws in pairs.items():
        np.testing.assert_allclose(noise[name], np.sqrt((draws[of_draws] ** 2).mean(axis=0)), rtol=1e-9)
    assert float(noise["signal_share"]) == 0


def test_gains_on_file_are_readings_over_strain(well_known: Calibrated) -> None:
    """Gain = reading per N/m over strain per N/m under an edge, the strain from a collocated annulus (1e-4)."""
    draws = well_known.draws
    for i in (0, 1234, 2500):
        depth, sigma, mu = draws["r_s"][i], float(draws["sigma"][i]), float(draws["mu"][i])
        modes = np.arange(70)
        solved = solve(Annulus(w.CORE, w.OUTER, sigma), modes)
        strain = solved.strain_at(depth)
        # an edge of 1 N/m = 1e-3 N/mm presses with 1/(2π r_b) + Σ cos kθ/(π r_b) of it, inwards
        edge = (strain[0] + 2 * strain[1:].sum(axis=0)) / (2 * np.pi * w.OUTER) * 1e-3 / mu
        np.testing.assert_allclose(np.abs(draws["response"][i] / edge), np.abs(draws["gain"][i]), rtol=2e-3)


def test_units_on_file(well_known: Calibrated) -> None:
    """Each draw in the unit that its attribute states: the sensor as built lies within the draws' scatter."""
    with xr.open_datatree(well_known.path) as tree:
        units = {str(name): values.attrs["units"] for name, values in tree["posterior"].data_vars.items()}
    assert units == {
        "sigma": "",
        "mu": "MPa",
        "r_s": "mm",
        "theta_s": "degree",
        "response": "counts/(N/m)",
        "gain": "counts/strain",
        "noise_sd": "counts",
        "discrepancy_sd": "counts",
        "force_noise_sd": "N/m",
    }
    truth, draws = w.true_finger(), well_known.draws
    known = {
        "sigma": truth.poisson_ratio,
        "mu": truth.shear_modulus_MPa,
        "r_s": truth.sensing_radius_mm,
        "theta_s": np.degrees(truth.angle),
        "response": truth.response,
        "noise_sd": np.full(M, w.NOISE),
        "force_noise_sd": w.FORCE_NOISE,
    }
    for name, value in known.items():
        z = (draws[name].mean(axis=0) - value) / draws[name].std(axis=0)
        # largest of 5 normal numbers: beyond 4 once in 3,000
        assert np.abs(z).max() < 4, name
