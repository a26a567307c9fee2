"""Calibration of simulated pads: known truth found again, and the closed forms behind it against brute force."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pad_simulation import SimulatedPad, grid, line, square
from scipy.stats import multivariate_normal

from bayestouch.chain.kernel_choice import kernel_for
from bayestouch.chain.kernels import GaussianKernel
from bayestouch.chain.noise import Noise
from bayestouch.data.dataset import DataSet
from bayestouch.data.touches import Touches
from bayestouch.errors import InputError
from bayestouch.pad.calibration import calibrate_pad
from bayestouch.pad.candidates import add_map, fit_kernel, with_noise_between_blocks
from bayestouch.pad.fit import fit_chain
from bayestouch.pad.known_touches import choose_samples, pad_readings
from bayestouch.pad.load import load_statistics
from bayestouch.pad.misfit_fit import _evidence
from bayestouch.pad.problem import PadProblem, pad_problem
from bayestouch.pad.residual_map import MapDiscrepancy
from bayestouch.pad.table import tabulate
from bayestouch.simulation import PadDesign, simulate


def problem_of(pad: SimulatedPad | DataSet, touches: Touches) -> PadProblem:
    return pad_problem(pad.sensor, touches, samples="auto", seed=0)[0]


def test_a_load_that_one_sample_has_errs_like_one_reading() -> None:
    """Four samples a touch; in every other touch three of them have no load."""
    made = line()
    touches = made.touch(np.linspace(6, 32, 12)[:, None], np.random.default_rng(4), measured=True, samples=4)
    rare = (touches.touch % 2 == 1) & (touches.sample > 0)
    problem = problem_of(made, touches.with_(load=np.where(rare, np.nan, touches.load)))
    reads = np.where(problem.known.touch % 2 == 1, 1, 4)
    assert problem.force_sd > 0
    np.testing.assert_allclose(problem.load_share * problem.known.load, problem.force_sd / np.sqrt(reads))


class BumpyKernel(GaussianKernel):
    """A Gaussian with a negative ring and a shoulder, which no kernel at hand has."""

    def __call__(self, distance_mm: np.ndarray, values: np.ndarray) -> np.ndarray:
        ring = 0.06 * np.exp(-0.5 * ((distance_mm - 8) / 2) ** 2)
        return super().__call__(distance_mm, values) - ring + 0.05 * np.sin(distance_mm) * np.exp(-distance_mm / 4)


@pytest.fixture(scope="module")
def known_line() -> tuple[SimulatedPad, PadProblem]:
    pad = line()
    location = np.linspace(6, 32, 53)[:, None]
    return pad, problem_of(pad, pad.touch(location, np.random.default_rng(0)))


@pytest.mark.parametrize("make", [line, square])
def test_truth_is_found_again(make: type) -> None:
    # z scores of the mode over all parameters and 6 data sets: their mean square is chi-square over its number, which
    # stays within 4 standard errors, sqrt(2/n), of 1; the gains' common scale is that of the loads, 1 by definition
    # up to the mean of their spread, which is in their variance.
    pad = make()
    scores, total, floors = [], [], []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        location = grid(6, 32, 60, 1) if make is line else grid(3, 19, 14, 2)
        problem = problem_of(pad, pad.touch(location, rng))
        model = fit_kernel(problem, kernel_for("gaussian", pad.sensor, problem.pitch_mm))
        scores.append((model.fit.laplace.mode - pad.chain.flat) / model.fit.laplace.sd)
        # Right above an element a load that is off cannot be told from a reading that is: the two add up.
        total.append(np.hypot(model.load_spread, model.noise.signal_share))
        floors.append(np.median(model.noise.discrepancy_sd))
    # At least 30 touches a data set have a signal that tells, and 100 readings a floor: 4 standard errors of an sd.
    assert np.mean(total) == pytest.approx(np.hypot(pad.load_spread, pad.share), rel=4 / np.sqrt(2 * 6 * 30))
    assert np.mean(floors) == pytest.approx(pad.floor, rel=4 / np.sqrt(2 * 6 * 100))
    square_ = np.mean(np.square(scores))
    assert abs(square_ - 1) < 4 * np.sqrt(2 / np.size(scores))


def test_true_kernel_wins(known_line: tuple[SimulatedPad, PadProblem]) -> None:
    _, problem = known_line
    scores = {
        name: fit_kernel(problem, kernel_for(name, line().sensor, 6.0)).score
        for name in ("gaussian", "half-space", "layer")
    }
    assert max(scores, key=lambda name: scores[name]) == "gaussian"


def test_no_map_where_the_kernel_is_right() -> None:
    pad = line()
    touches = pad.touch(np.linspace(6, 32, 53)[:, None], np.random.default_rng(0))
    assert calibrate_pad(pad.dataset(touches), draws=8).settings["empirical_map"] == "no"


def test_map_finds_what_the_kernel_misses() -> None:
    pad = line(BumpyKernel(6.0), load_spread=0.005, floor=0.02, share=0.002)
    between = np.linspace(6.25, 31.75, 52)[:, None]
    truth = pad.chain.sensitivity(between)
    scores = []
    for seed in range(1, 7):
        problem = problem_of(pad, pad.touch(np.linspace(6, 32, 53)[:, None], np.random.default_rng(seed)))
        alone = fit_kernel(problem, kernel_for("gaussian", pad.sensor, 6.0))
        mapped = add_map(problem, alone)
        map_ = tabulate(mapped)
        sensitivity, *own = map_.at(between)
        error = map_.offset + sensitivity - (truth + pad.chain.offset)
        plain = alone.fit.chain.predict(between, np.ones(52)) - (truth + pad.chain.offset)
        assert mapped.score > alone.score + 50
        # 0.15 found
        assert np.sqrt(np.mean(error**2)) < 0.2 * np.sqrt(np.mean(plain**2))
        scores.append(np.mean((error / np.sqrt(map_.reading_variance(*own, np.ones(52)))) ** 2))
    # What the map says of its own error. The z scores of neighbours go together: the scatter of data sets says how far.
    assert np.mean(scores) == pytest.approx(1, abs=4 * np.std(scores, ddof=1) / np.sqrt(len(scores)))
    # 208 scores of which some 40 are independent, in six data sets: no coarser than four standard errors of these
    assert np.std(scores, ddof=1) < 2 * np.sqrt(2 / 40)


def test_a_map_without_a_kernel_finds_the_noise() -> None:
    """The noise may have a share of the signal, which is that of the map, and not that of the constant."""
    corners = {"element_x_mm": (0.0, 0.0, 6.75, 6.75), "element_y_mm": (0.0, 6.75, 0.0, 6.75)}
    design, found = PadDesign(**corners), []
    for seed in range(1, 4):
        dataset = simulate(design, seed=seed).dataset
        assert dataset.calibration is not None
        problem = problem_of(dataset, dataset.calibration)
        fit = add_map(problem, fit_kernel(problem, kernel_for("constant", dataset.sensor, problem.pitch_mm))).fit
        found.append(np.mean(fit.misfit.variance))
    truth = (design.noise_percent_peak / 100 * design.peak_reading) ** 2 / design.samples_per_touch
    # 81 touches of four elements each, with three samples: the variance is known to 5 %. Gains differ by 15 %, and the
    # noise with them.
    assert np.mean(found) == pytest.approx(truth, rel=0.2)


def test_left_out_is_what_a_fit_without_the_reading_predicts(known_line: tuple[SimulatedPad, PadProblem]) -> None:
    pad, problem = known_line
    model = add_map(problem, fit_kernel(problem, kernel_for("half-space", pad.sensor, problem.pitch_mm)))
    fit, priors = model.fit, problem.priors.of(model.kernel)
    residual, variance = fit.left_out
    for touch, element in ((10, 0), (20, 1), (33, 3), (52, 2)):
        missing = fit.misfit.variance.copy()
        missing[touch, element] = np.inf
        misfit = replace(fit.misfit, variance=missing)
        without = fit_chain(fit.chain, priors, problem.known, misfit)
        predicted = without.predicted()[touch, element]
        sd = np.sqrt(fit.misfit.variance[touch, element] + variance[touch, element])
        # The closed form takes the chain as linear about the mode with all readings: a few hundredths of the sd.
        expected = problem.known.readings[touch, element] - predicted
        assert residual[touch, element] == pytest.approx(expected, abs=0.05 * sd)


def test_blocks_left_out_are_what_a_fit_without_them_predicts(known_line: tuple[SimulatedPad, PadProblem]) -> None:
    pad, problem = known_line
    model = add_map(problem, fit_kernel(problem, kernel_for("half-space", pad.sensor, problem.pitch_mm)))
    fit, priors = model.fit, problem.priors.of(model.kernel)
    blocks = np.array_split(np.arange(problem.known.n_touches), 12)
    residual, variance = fit.without_blocks(blocks)
    for block, element in ((blocks[1], 0), (blocks[4], 1), (blocks[7], 3)):
        missing = fit.misfit.variance.copy()
        missing[block, element] = np.inf
        without = fit_chain(fit.chain, priors, problem.known, replace(fit.misfit, variance=missing))
        predicted = without.predicted()[block, element]
        sd = np.sqrt(fit.misfit.variance[block, element] + variance[block, element])
        # The closed form takes the chain as linear about the mode with all readings: a few hundredths of the sd.
        expected = problem.known.readings[block, element] - predicted
        np.testing.assert_allclose(residual[block, element] / sd, expected / sd, atol=0.1)


def test_errors_that_neighbours_share_are_noise_of_later_touches(known_line: tuple[SimulatedPad, PadProblem]) -> None:
    """A zero that walks is nearly the same in the touch before: left out one by one, touches hide it."""
    pad, problem = known_line
    rng = np.random.default_rng(4)
    n, m = problem.known.readings.shape
    walk = np.repeat(rng.normal(size=(-(-n // 8), m)), 8, axis=0)[:n]
    size = 0.03 * np.abs(problem.known.readings - problem.known.readings.mean(axis=0)).max(axis=0)
    drifting = replace(problem, known=replace(problem.known, readings=problem.known.readings + size * walk))
    model = add_map(drifting, fit_kernel(drifting, kernel_for("half-space", pad.sensor, problem.pitch_mm)))
    later = with_noise_between_blocks(drifting, model)
    signal = np.zeros((1, m))
    one, two = (each.noise.mean_sd(np.ones((1, m), dtype=int), signal)[0] for each in (model, later))
    assert (two > one).all()


def test_log_evidence_and_its_gradient() -> None:
    rng = np.random.default_rng(0)
    n, m = 12, 2
    misfit = MapDiscrepancy(
        location=rng.uniform(0, 10, (n, 2)),
        load=rng.uniform(0.5, 2, n),
        variance=np.ones((n, m)),
        amplitude=np.array([1.0, 2.0]),
        shape=rng.uniform(0, 1, (n, m)),
        misfit=0.3,
        relative=0.5,
        length_mm=4.0,
    )
    signal, residual = rng.normal(size=(n, m)), rng.normal(size=(n, m))
    counts = np.full((n, m), 4)
    counts[3, 1] = 0

    def noise(vector: np.ndarray) -> Noise:
        return Noise(np.full(m, 0.2), np.exp(vector[4] + vector[5:]) * misfit.amplitude, np.exp(vector[3]))

    def at(vector: np.ndarray) -> MapDiscrepancy:
        length, size, relative = np.exp(vector[:3])
        variance = noise(vector).mean_variance(counts, signal)
        return replace(misfit, length_mm=length, misfit=size, relative=relative, variance=variance)

    vector = np.log([4.0, 0.3, 0.5, 0.2, 0.1, 1.0, 1.0])
    value, gradient = _evidence(at(vector), residual, signal, noise(vector))
    whole = 0.0
    for e in range(m):
        here = counts[:, e] > 0
        now = at(vector)
        r = np.sqrt(5) * np.linalg.norm(now.location[:, None] - now.location, axis=-1) / now.length_mm
        smooth = (1 + r + r**2 / 3) * np.exp(-r) * np.outer(now.load, now.load) * now.amplitude[e] ** 2
        covariance = (now.misfit**2 + now.relative**2 * np.outer(now.shape[:, e], now.shape[:, e])) * smooth
        covariance += np.diag(now.variance[:, e])
        normal = multivariate_normal(np.zeros(here.sum()), covariance[np.ix_(here, here)])
        whole += normal.logpdf(residual[here, e]) + 0.5 * here.sum() * np.log(2 * np.pi)
    assert value == pytest.approx(whole, rel=1e-9)
    for k in range(len(vector)):
        step = np.zeros(len(vector))
        step[k] = 1e-5
        up, down = (_evidence(at(vector + s * step), residual, signal, noise(vector + s * step))[0] for s in (1, -1))
        assert gradient[k] == pytest.approx((up - down) / 2e-5, rel=1e-5, abs=1e-5)


def test_missing_reading_tells_nothing() -> None:
    pad = line()
    location = np.linspace(6, 32, 27)[:, None]
    touches = pad.touch(location, np.random.default_rng(3))
    readings = touches.readings.copy()
    readings[5, 1] = np.nan
    problem = problem_of(pad, touches.with_(readings=readings))
    model = add_map(problem, fit_kernel(problem, kernel_for("gaussian", pad.sensor, 6.0)))
    misfit = replace(model.fit.misfit, variance=np.where(problem.present, model.fit.misfit.variance, np.inf))
    here = problem.present[:, 1]
    rows = np.random.default_rng(0).normal(size=27)
    own = misfit.covariances[1]
    whole = own.whiten(np.where(here, rows, 0.0))
    covariance = own.columns @ own.columns.T + np.diag(own.variance)
    part = np.linalg.cholesky(covariance[np.ix_(here, here)])
    # A missing reading has 1e9 times the variance of the others instead of none at all.
    assert whole @ whole == pytest.approx(np.sum(np.linalg.solve(part, rows[here]) ** 2), rel=1e-6)
    assert np.isnan(model.left_out.residual[5, 1]) and np.isfinite(model.score)


@pytest.mark.parametrize(("creep", "chosen"), [(0.1, "first"), (0.0, "mean")])
def test_creep_decides_which_samples_count(creep: float, chosen: str) -> None:
    pad = line()
    touches = pad.touch(np.linspace(6, 32, 27)[:, None], np.random.default_rng(0), samples=3, creep=creep)
    samples, why = choose_samples(touches)
    assert samples == chosen and "creep" in why
    readings = pad_readings(touches, 1, "first")
    np.testing.assert_array_equal(readings.readings, touches.readings[::3])
    np.testing.assert_array_equal(pad_readings(touches, 1, "last").readings, touches.readings[2::3])
    np.testing.assert_allclose(pad_readings(touches, 1, "mean").readings[0], touches.readings[:3].mean(axis=0))


def test_repeats_give_the_noise_of_a_reading() -> None:
    pad = line(share=0.0)
    touches = pad.touch(np.linspace(6, 32, 53)[:, None], np.random.default_rng(2), samples=5)
    calibration = calibrate_pad(pad.dataset(touches), kernel="gaussian", empirical=False, draws=8)
    # 4 standard errors of an sd from 53 * 4 degrees of freedom.
    np.testing.assert_allclose(calibration.noise.tactile_sd, pad.floor, rtol=4 / np.sqrt(2 * 212))
    assert calibration.settings["samples"] == "mean"
    assert np.all(calibration.noise.discrepancy_sd < 0.5 * pad.floor)


def test_loads_that_are_measured() -> None:
    pad, rng = line(), np.random.default_rng(4)
    location = np.repeat(np.linspace(6, 32, 27), 4)[:, None]
    touches = pad.touch(location, rng, load=rng.uniform(1, 4, len(location)), measured=True)
    calibration = calibrate_pad(pad.dataset(touches), kernel="gaussian", empirical=False, draws=8)
    sd = np.sqrt(np.diag(calibration.covariance))[:4]
    np.testing.assert_array_less(np.abs(calibration.mode["gain"] - pad.chain.gain), 4 * sd)
    assert calibration.settings["load_unit"] == "N" and calibration.settings["load_measured"] == 1
    assert calibration.settings["load_mean"] == pytest.approx(touches.load.mean())
    # Linear: an exponent of 1 to the error of readings of 1 % over loads of 1 to 4 N.
    assert calibration.statistics["load_exponent"] == pytest.approx(1.0, abs=0.05)


def test_exponent_of_the_load() -> None:
    pad, rng = line(share=0.002), np.random.default_rng(4)
    location = np.repeat(np.linspace(6, 32, 27), 4)[:, None]
    touches = pad.touch(location, rng, load=rng.uniform(1, 4, len(location)), measured=True, exponent=0.5)
    problem = problem_of(pad, touches)
    statistics = load_statistics(problem, fit_kernel(problem, kernel_for("gaussian", pad.sensor, 6.0)))
    assert statistics["load_exponent"] == pytest.approx(0.5, abs=0.05)
    assert statistics["error_percent_peak_power"] < 0.5 * statistics["error_percent_peak_linear"]
    assert 0 < statistics["load_trend_share"] < 1


def test_calibration_holds_what_it_should() -> None:
    pad = square()
    touches = pad.touch(grid(3, 19, 12, 2), np.random.default_rng(0))
    calibration = calibrate_pad(pad.dataset(touches), draws=200, seed=3)
    assert calibration.settings["kernel"] in ("gaussian", "layer", "half-space")
    d = len(calibration.layout)
    assert calibration.covariance.shape == (d, d)
    for name in ("gain", "offset", "x_s", "y_s"):
        assert calibration.posterior[name].shape == (4, 50, 4)
        column = calibration.layout.index(f"{name}[0]")
        sd = np.sqrt(calibration.covariance[column, column])
        # Monte Carlo error of an sd from 200 draws, and of a mean, at 4 standard errors.
        assert calibration.posterior[name][..., 0].std() == pytest.approx(sd, rel=4 / np.sqrt(400))
        assert calibration.posterior[name][..., 0].mean() == pytest.approx(
            calibration.mode[name][0], abs=4 * sd / np.sqrt(200)
        )
    assert calibration.rows.predicted.shape == (144, 4)
    z = (calibration.rows.observed - calibration.rows.predicted) / calibration.rows.sd
    # 576 readings, with the loads in common to four: at least 144 of their own.
    assert abs(np.mean(z**2) - 1) < 4 * np.sqrt(2 / 144)
    assert any("+8" in note and "+5" in note for note in calibration.notes)
    assert {parameter.name for parameter in calibration.parameters} >= {"gain", "offset", "x_s", "y_s"}
    again = calibrate_pad(pad.dataset(touches), draws=200, seed=3)
    np.testing.assert_array_equal(again.posterior["gain"], calibration.posterior["gain"])


def test_element_that_is_dead_is_left_out() -> None:
    pad = square()
    touches = pad.touch(grid(3, 19, 10, 2), np.random.default_rng(0))
    readings = touches.readings.copy()
    readings[:, 2] = np.nan
    calibration = calibrate_pad(pad.dataset(touches.with_(readings=readings)), kernel="gaussian", draws=8)
    assert any("e03 has no reading" in note for note in calibration.notes)
    assert np.isfinite(calibration.statistics["error_percent_peak"])
    assert not calibration.extra["usable"][2] and calibration.extra["usable"][[0, 1, 3]].all()


def test_what_cannot_be_calibrated_is_said() -> None:
    pad = square()
    rng = np.random.default_rng(0)
    few = pad.touch(grid(5, 15, 2, 2), rng)
    with pytest.raises(InputError, match="touches at 4 known locations"):
        calibrate_pad(pad.dataset(few), kernel="gaussian")
    touches = pad.touch(grid(3, 19, 10, 2), rng)
    with pytest.raises(InputError, match="unknown kernel"):
        calibrate_pad(pad.dataset(touches), kernel="layer-line")
    with pytest.raises(InputError, match="samples: expected"):
        calibrate_pad(pad.dataset(touches), samples="second")
    nowhere = touches.with_(x_mm=np.full(100, np.nan))
    with pytest.raises(InputError, match="no calibration touch has a location"):
        calibrate_pad(pad.dataset(nowhere))
    with pytest.raises(InputError, match="no element responds"):
        calibrate_pad(pad.dataset(touches.with_(readings=np.ones((100, 4)))))
    sparse = touches.readings.copy()
    sparse[4:, 1] = np.nan
    with pytest.raises(InputError, match="column e02: 4 calibration touches have a reading"):
        calibrate_pad(pad.dataset(touches.with_(readings=sparse)))
