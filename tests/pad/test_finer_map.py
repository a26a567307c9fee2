"""The map that a correction reads touches with, against the normal distribution written out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pad_simulation import SimulatedPad, line, square
from scipy.special import gamma, kv

import bayestouch
from bayestouch.data.touches import Touches, touches_from
from bayestouch.pad.calibration import choose_pad
from bayestouch.pad.finer_map import LOADS, FinerMap, Sizes, tabulated_loads
from bayestouch.pad.inducing import REST
from bayestouch.pad.problem import PadProblem
from bayestouch.pad.table import MapGrid

TOUCHES, FLOOR = 160, 0.05


def bent(seed: int, touches: int = TOUCHES) -> tuple[SimulatedPad, Touches]:
    """A pad whose elements feel farther under a larger load, and touches with loads that are measured."""
    pad, rng = line(), np.random.default_rng(seed)
    x, load = rng.uniform(6.0, 32.0, touches), rng.uniform(1.0, 6.0, touches)
    width = 2.5 * (1 + 0.15 * np.log(load))[:, None]
    clean = pad.chain.gain * load[:, None] * np.exp(-0.5 * ((x[:, None] - pad.chain.position[:, 0]) / width) ** 2)
    readings = pad.chain.offset + clean + FLOOR * rng.standard_normal(clean.shape)
    return pad, touches_from(np.arange(touches), readings, x_mm=x, load=load)


@pytest.fixture(scope="module")
def made() -> tuple[PadProblem, FinerMap]:
    pad, table = bent(0)
    chosen = choose_pad(pad.dataset(table), kernel="gaussian", empirical=True)
    return chosen.problem, FinerMap.of(chosen.problem, chosen.model)


def matern(distance: np.ndarray, length: float) -> np.ndarray:
    """Matérn correlation of smoothness 5/2 by its Bessel function (Rasmussen and Williams, equation 4.14)."""
    r = np.sqrt(5) * np.maximum(distance, 1e-9 * length) / length
    return 2**-1.5 / gamma(2.5) * r**2.5 * kv(2.5, r)


def covariance(finer: FinerMap, e: int, one: tuple[np.ndarray, ...], two: tuple[np.ndarray, ...]) -> np.ndarray:
    """Of the readings of an element without noise, written out for a Gaussian kernel."""
    s, fit, shape = finer.sizes, finer.model.fit, finer.model.shape
    width, position = float(shape.values[0]), shape.position[e, 0]
    kernels = [np.exp(-0.5 * ((x - position) / width) ** 2) for x, _ in (one, two)]
    distance = np.abs(one[0][:, None] - two[0])
    first = (s.even**2 + s.relative**2 * np.outer(*kernels)) * matern(distance, s.length_mm)
    in_load = np.abs(np.log(one[1])[:, None] - np.log(two[1]))
    second = s.finer**2 * matern(distance, s.finer_length_mm) * matern(in_load, s.load_length)
    return fit.misfit.amplitude[e] ** 2 * np.outer(one[1], two[1]) * (first + second)


def test_mean_and_variance_are_those_of_a_normal_distribution(made: tuple[PadProblem, FinerMap]) -> None:
    problem, finer = made
    known, fit = problem.known, finer.model.fit
    rows, there = (known.x_mm, known.load), (np.array([9.0, 17.3, 30.0]), np.full(3, 2.5))
    mean, variance = finer.at(there[0][:, None], 2.5)
    for e in range(known.n_elements):
        own = finer.covariances[e]
        noise, written_out = own.noise, covariance(finer, e, rows, rows)
        rest = (written_out - own.columns @ own.columns.T) / np.sqrt(np.outer(noise, noise))
        assert np.diag(rest).min() > -1e-6 and np.abs(rest).max() < REST * (1 + 1e-6)
        cross = covariance(finer, e, there, rows) / 2.5
        inverse = np.linalg.inv(np.diag(noise) + written_out)
        expected = fit.chain.sensitivity(there[0][:, None])[:, e] + cross @ inverse @ fit.residual[:, e]
        left = np.diag(covariance(finer, e, there, there)) / 2.5**2 - np.einsum("kn,nm,km->k", cross, inverse, cross)
        # the rest, which inducing touches leave out, changes the function by a part of its own standard deviation
        sd = np.sqrt(REST * np.median(noise)) / 2.5
        np.testing.assert_allclose(mean[:, e], expected, rtol=0, atol=sd)
        # between touches the rest is a little larger than at these
        assert (np.abs(variance[:, e] - left) < 0.03 * left + sd**2).all()


def test_readings_left_out_are_those_of_a_fit_without_them(made: tuple[PadProblem, FinerMap]) -> None:
    problem, finer = made
    known, residual = problem.known, finer.model.fit.residual
    rows_of = (known.x_mm, known.load)
    for touch, e in ((3, 0), (70, 2)):
        # 160 touches are 40 blocks of four that follow each other.
        others = np.arange(known.n_touches) // 4 != touch // 4
        noise = finer.covariances[e].noise
        total = covariance(finer, e, rows_of, rows_of) + np.diag(noise)
        rows = total[touch, others] @ np.linalg.inv(total[np.ix_(others, others)])
        # inducing touches leave a rest of a tenth of the sd of the noise or less
        assert finer.model.left_out.residual[touch, e] == pytest.approx(
            residual[touch, e] - rows @ residual[others, e], abs=np.sqrt(REST * noise[touch])
        )


def test_the_first_map_is_compared_by_the_same_blocks() -> None:
    """Without a second process, against the normal distribution written out; readings go with a power of the load."""
    pad, table = bent(1)
    chosen = choose_pad(pad.dataset(table), kernel="gaussian", empirical=True)
    first, model = FinerMap.first(chosen.problem, chosen.model), chosen.model
    own, known, fit, e = model.fit.misfit, chosen.problem.known, model.fit, 1
    x, load = known.x_mm, known.load
    kernels = np.exp(-0.5 * ((x - model.shape.position[e, 0]) / float(model.shape.values[0])) ** 2)
    rho = (own.misfit**2 + own.relative**2 * np.outer(kernels, kernels)) * matern(np.abs(x[:, None] - x), own.length_mm)
    noise = model.noise.mean_sd(known.counts, fit.predicted() - fit.chain.offset)[:, e] ** 2
    total = own.amplitude[e] ** 2 * np.outer(load, load) * rho + np.diag(noise)
    others = np.arange(known.n_touches) // 4 != 70 // 4
    rows = total[70, others] @ np.linalg.inv(total[np.ix_(others, others)])
    assert first.model.left_out.residual[70, e] == pytest.approx(
        fit.residual[70, e] - rows @ fit.residual[others, e], abs=np.sqrt(REST * noise[70])
    )
    assert FinerMap.of(chosen.problem, model).model.score > first.model.score + 20


def test_the_table_is_the_map_at_every_load() -> None:
    """Acting loads of a response that flattens reach from nearly nothing to a narrow range, where most touches are."""
    pad, rng = line(), np.random.default_rng(5)
    x, load = rng.uniform(6.0, 32.0, TOUCHES), rng.uniform(0.01, 8.0, TOUCHES)
    acting, width = load / (1 + load), 2.5 * (1 + 0.1 * load)[:, None]  # 0.01 to 0.89
    clean = pad.chain.gain * acting[:, None] * np.exp(-0.5 * ((x[:, None] - pad.chain.position[:, 0]) / width) ** 2)
    table = touches_from(np.arange(TOUCHES), clean + 0.01 * rng.standard_normal(clean.shape), x_mm=x, load=acting)
    chosen = choose_pad(pad.dataset(table), kernel="gaussian", empirical=True)
    finer = FinerMap.of(chosen.problem, chosen.model)
    known, map_ = chosen.problem.known, finer.tabulated()
    assert known.load.max() > 20 * known.load.min() and np.median(known.load) > 0.7
    off = []
    for touch in range(known.n_touches):
        there, load_here = known.location[[touch]], float(known.load[touch])
        mean, tabulated = finer.at(there, load_here)[0], map_.at(there, np.array([load_here]))[0]
        off.append(load_here * (tabulated[0] - mean[0]))
    # A fifth of the noise that was simulated adds 2 % to it. Even steps in the logarithm leave six times the noise.
    assert np.sqrt(np.mean(np.square(off))) < 0.3 * 0.01


def test_the_tables_of_a_pad_in_the_plane_are_the_map_within_its_sd() -> None:
    """36 loads are wanted. They share the points of one table, so there are fewer, and the grid is not too coarse."""
    pad, rng = square(), np.random.default_rng(3)
    place, load = rng.uniform(3.0, 19.0, (120, 2)), rng.uniform(1.0, 6.0, 120)
    width = 2.5 * (1 + 0.15 * np.log(load))[:, None]
    squares = ((place[:, None] - pad.chain.position) ** 2).sum(axis=-1)
    readings = pad.chain.gain * load[:, None] * np.exp(-0.5 * squares / width**2)
    readings += 0.005 * rng.standard_normal(readings.shape)
    table = touches_from(np.arange(120), readings, x_mm=place[:, 0], y_mm=place[:, 1], load=load)
    chosen = choose_pad(pad.dataset(table), kernel="gaussian", empirical=True)
    # Sizes that were found with 200 touches.
    sizes = Sizes(1e-4, 0.27, 6.4, 0.12, 8.3, 1.35)
    finer = FinerMap.given(chosen.problem, chosen.model, sizes, chosen.model.noise)
    map_, off, sd = finer.tabulated(), [], []
    kernel = float(chosen.model.fit.chain.values[0])
    assert map_.loads is not None and 9 <= len(map_.loads) < len(finer.loads)
    assert kernel / 6 < map_.step[0] <= kernel / 2
    for there, one in zip(rng.uniform(4.0, 18.0, (60, 2)), rng.uniform(1.1, 5.5, 60), strict=True):
        mean, variance = finer.at(there[None], float(one))
        off.append(map_.at(there[None], np.array([one]))[0] - mean)
        sd.append(np.sqrt(variance))
    # A fifth of the sd adds 2 % to it.
    assert np.sqrt(np.mean(np.square(off))) < 0.2 * np.sqrt(np.mean(np.square(sd)))
    # A table alone has six points per width.
    region = float((map_.high - map_.low).max())
    assert MapGrid.of(chosen.model, np.inf).step == min(kernel / 6, region / 60)


@pytest.mark.parametrize(("length", "steps"), [(0.95, 20), (0.51, 36), (10.0, 8)])
def test_fewer_loads_are_tabulated_on_request(length: float, steps: int) -> None:
    """The logarithm has a range of 3.6: 20 steps as asked; but none above 0.2 λ; and never fewer than eight."""
    known = np.exp(np.linspace(0.0, 3.6 - 2 * np.log(1.25), 40))
    nodes = tabulated_loads(known, length, 20)
    assert len(nodes) == steps + 1
    np.testing.assert_allclose(np.log(nodes[[0, -1]] / known[[0, -1]]), [-np.log(1.25), np.log(1.25)])


@pytest.mark.parametrize("loads", [[2.0] * 40, [1.0, 2.0, 4.0] * 20, np.geomspace(0.01, 1.0, 50)])
def test_tabulated_loads_cover_known_ones(loads: list[float]) -> None:
    nodes = tabulated_loads(np.array(loads), 1.0)
    assert np.all(np.diff(nodes) > 0) and nodes[0] < min(loads) and nodes[-1] > max(loads)
    assert LOADS[0] < len(nodes) <= LOADS[1] + 1


def test_it_finds_the_truth_and_the_noise(made: tuple[PadProblem, FinerMap]) -> None:
    _, finer = made
    map_, noise, pad = finer.tabulated(), finer.model.noise, line()
    rng = np.random.default_rng(9)
    x, load = rng.uniform(8.0, 30.0, 200), rng.uniform(1.2, 5.5, 200)
    width = 2.5 * (1 + 0.15 * np.log(load))[:, None]
    truth = pad.chain.gain * np.exp(-0.5 * ((x[:, None] - pad.chain.position[:, 0]) / width) ** 2)
    mean, variance, _ = map_.at(x[:, None], load)
    missed = (mean - truth) / np.sqrt(variance + (FLOOR / load[:, None]) ** 2)
    # What the map misses is within what it says; the truth is smoother than its prior, so that it says rather too much.
    assert 0.1 < np.mean(missed**2) < 1.3
    # Linear in proportion to the load, the kernel and map leave some 2 % of the peak, many times the noise.
    assert np.abs(mean - truth).max() < 0.02 * pad.chain.gain.max()
    at_zero = np.hypot(noise.discrepancy_sd, 0.0)
    # 160 residuals of each of four elements give a standard deviation to 3 %; some of it counts as in proportion.
    assert 0.6 * FLOOR < np.median(at_zero) < 1.2 * FLOOR


@pytest.mark.slow
def test_a_diagnosis_with_a_correction_reads_with_it() -> None:
    pad, table = bent(4, 240)
    found = bayestouch.diagnose(replace(pad.dataset(table), calibration=None), kernel="gaussian")
    assert found.traced.corrected is not None
    assert found.traced.after is found.traced.corrected
    assert found.calibration_after.settings["finer_map"] == 1.0
    assert "finer_map" not in found.calibration_before.settings
    before, after = found.numbers["before"], found.numbers["after"]
    assert after["location_rms_mm"] < 0.6 * before["location_rms_mm"]
    assert after["P_rms_N"] < 0.6 * before["P_rms_N"]
    # Of 60 held-out touches 54 are expected; three standard deviations of the binomial distribution are 7.
    for key in ("coverage_90", "P_coverage_90"):
        assert 47 / 60 <= after[key] <= 1.0


def test_a_finer_map_that_is_not_used_has_no_errors_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the empirical map already has what a finer one would add, errors after are those of the map before.

    They were those of the fit with the correction, though the calibration had no bit of it.
    """
    monkeypatch.setattr("bayestouch.pad.calibration_with_effects.CLEARLY_BETTER", np.inf)
    pad, table = bent(4, 240)
    found = bayestouch.diagnose(replace(pad.dataset(table), calibration=None), kernel="gaussian", sample=False)
    numbers = found.numbers
    assert numbers["rounds"][-1]["correction_elpd_gain"] > 3 * numbers["rounds"][-1]["correction_elpd_gain_se"] > 0
    assert numbers["calibration_after"] == {"effects": [], "correction": False} and numbers["correction"] is None
    assert numbers["after"] == numbers["before"] and found.calibration_after is found.calibration_before
