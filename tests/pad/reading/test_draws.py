"""Posteriors of touches on simulated pads: against dense quadrature, and against the truth."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest
from pad_simulation import SimulatedPad, grid, line, square
from scipy import stats
from scipy.integrate import dblquad

from bayestouch.data.touches import Touches
from bayestouch.errors import InputError
from bayestouch.inference import infer
from bayestouch.pad.calibration import calibrate_pad
from bayestouch.pad.effect_changes import CorrectedMeans
from bayestouch.pad.known_touches import pad_readings
from bayestouch.pad.reading.components import components_of
from bayestouch.pad.reading.draws import PadSampler
from bayestouch.pad.reading.lattice import lattice_for
from bayestouch.pad.reading.proposal import ManyParts, count_places, many_parts
from bayestouch.pad.reading.reader import PadReader, PadTouches
from bayestouch.results.objects import Calibration, TouchPosteriors
from bayestouch.sampling import BlockStreams


@pytest.fixture(scope="module")
def line_pad() -> tuple[SimulatedPad, Calibration]:
    pad = line()
    touches = pad.touch(np.linspace(6, 34, 57)[:, None], np.random.default_rng(0))
    return pad, calibrate_pad(pad.dataset(touches), kernel="gaussian", empirical=False, draws=8)


@pytest.fixture(scope="module")
def square_pad() -> tuple[SimulatedPad, Calibration]:
    pad = square()
    touches = pad.touch(grid(3, 19, 17, 2), np.random.default_rng(0))
    return pad, calibrate_pad(pad.dataset(touches), kernel="gaussian", empirical=True, draws=8)


def known(reader: PadReader, touches: Touches) -> PadTouches:
    return reader.touches(pad_readings(touches, reader.map.dimensions, reader.samples))


def log_posterior(reader: PadReader, touches: PadTouches, index: int, points: np.ndarray) -> np.ndarray:
    """Log posterior density (n,) of location and load (n, D + 1), written out; the tables are the calibration's.

    Normal readings, their variance noise, what the model misses, a share of the signal and what the calibration leaves,
    of which the elements share a part; a normal load, above zero.
    `tests/end_to_end/test_density_of_pad_touches.py` holds the tables against a kernel written out.
    """
    location, load, noise, pad = points[:, :-1], points[:, -1], reader.noise, reader.map
    sensitivity, open_, with_offset = pad.at(location)
    signal = load[:, None] * sensitivity
    variance = noise.discrepancy_sd**2 + noise.tactile_sd**2 / np.maximum(touches.counts[index], 1)
    variance = variance + (noise.signal_share * signal) ** 2
    variance = variance + pad.offset_variance + 2 * load[:, None] * with_offset + load[:, None] ** 2 * open_
    here = touches.counts[index] > 0
    shared = load[:, None, None] * pad.shared_at(location)[..., here]
    covariance = variance[:, here, None] * np.eye(here.sum()) + shared.swapaxes(1, 2) @ shared
    miss = (touches.readings[index] - pad.offset - signal)[:, here, None]
    squares = (miss * np.linalg.solve(covariance, miss)).sum(axis=(1, 2))
    log = -0.5 * (squares + np.linalg.slogdet(covariance)[1])
    return np.asarray(log + stats.norm(touches.load[index], touches.load_sd[index]).logpdf(load))


def quadrature(
    reader: PadReader, touches: PadTouches, index: int, low: np.ndarray, high: np.ndarray, n: int
) -> tuple[np.ndarray, np.ndarray]:
    """Mean and standard deviation of location and load by the midpoint rule in a box."""
    step = (high - low) / n
    axes = [a + (np.arange(n) + 0.5) * h for a, h in zip(low, step, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))
    log_density = log_posterior(reader, touches, index, points)
    weight = np.exp(log_density - log_density.max())
    weight /= weight.sum()
    mean = weight @ points
    return mean, np.sqrt(weight @ (points - mean) ** 2)


def box(posterior: TouchPosteriors, t: int, reader: PadReader) -> tuple[np.ndarray, np.ndarray]:
    """A box around all draws and half as much again, within the prior."""
    draws = np.stack([posterior.posterior[name][..., t].ravel() for name in posterior.posterior], axis=1)
    middle, half = (draws.max(axis=0) + draws.min(axis=0)) / 2, 0.75 * np.ptp(draws, axis=0)
    low, high = middle - half, middle + half
    low[:-1], high[:-1] = np.maximum(low[:-1], reader.map.low), np.minimum(high[:-1], reader.map.high)
    low[-1] = max(low[-1], 0.0)
    return low, high


def check_against_quadrature(
    pad: SimulatedPad, calibration: Calibration, location: np.ndarray, n: int, seed: int
) -> TouchPosteriors:
    return infer_beside_quadrature(pad.touch(location, np.random.default_rng(seed)), calibration, n)


def infer_beside_quadrature(
    touches: Touches, calibration: Calibration, n: int, *, use_load: bool = True
) -> TouchPosteriors:
    posterior = infer(touches, calibration, draws=4000, seed=1, workers=1, use_load=use_load, check_sensor=False)
    reader = PadReader.from_calibration(calibration)
    means = pad_readings(touches, reader.map.dimensions, reader.samples)
    given = reader.touches(means if use_load else means.without_load())
    for t in range(given.n_touches):
        mean, sd = quadrature(reader, given, t, *box(posterior, t, reader), n)
        for k, name in enumerate(posterior.posterior):
            # Standard errors of mean and sd from the effective draws; of the sd with room for tails heavier than a
            # normal's (kurtosis up to 6), and 1 % for the midpoint rule.
            error = 1 / np.sqrt(posterior.sample_stats["ess_bulk"][t])
            assert posterior.mean(name)[t] == pytest.approx(mean[k], abs=(4 * error + 0.01) * sd[k])
            assert posterior.sd(name)[t] == pytest.approx(sd[k], rel=4 * error * np.sqrt(5 / 4) + 0.01)
    return posterior


def test_line_against_quadrature(line_pad: tuple[SimulatedPad, Calibration]) -> None:
    # Above an element, between two, at the array's end, and beyond it where hardly anything is read.
    location = np.array([10.3, 13.0, 19.1, 8.0, 31.0, 33.5])[:, None]
    check_against_quadrature(*line_pad, location, 600, 0)


def test_plane_against_quadrature(square_pad: tuple[SimulatedPad, Calibration]) -> None:
    # Above an element (by symmetry of its bell, located by the others), in the middle, at an edge, in a corner.
    location = np.array([[8.2, 5.1], [11.0, 8.0], [11.0, 14.0], [17.5, 17.0], [3.5, 3.5]])
    check_against_quadrature(*square_pad, location, 90, 0)


def measured_line(load: np.ndarray) -> tuple[SimulatedPad, Calibration]:
    """A line whose loads were measured, (57,). Its elements do not share an error of the load."""
    pad = line()
    table = pad.touch(np.linspace(6, 34, 57)[:, None], np.random.default_rng(0), load=load, measured=True)
    calibration = calibrate_pad(pad.dataset(table), kernel="gaussian", empirical=False, draws=8)
    return pad, replace(calibration, noise=replace(calibration.noise, load_scatter=0.0))


def test_loads_of_a_force_sensor_that_reads_below_zero() -> None:
    """Touches of nothing and of 0.03 N, and one without readings: normal priors of the load that are cut at zero."""
    pad, calibration = measured_line(np.tile([2.0, 2.5, 3.0], 19))
    reader = PadReader.from_calibration(calibration)
    location, true = np.array([13.0, 13.0, 22.0, 22.0, 22.0])[:, None], np.array([0.0, 0.0, 0.03, 0.03, 0.0])
    load = np.array([-0.02, 0.005, -0.02, 0.03, -0.02])
    readings = reader.map.offset + pad.chain.predict(location, true) - pad.chain.offset
    readings[4] = np.nan
    touches = pad.touch(location, np.random.default_rng(0), load=load, measured=True).with_(readings=readings)
    posterior = infer_beside_quadrature(touches, calibration, 800)
    draws = posterior.posterior["P"]
    assert np.isfinite(draws).all() and (draws > 0).all()
    force_sd = float(reader.noise.force_sd)
    cut = stats.truncnorm(0.02 / force_sd, np.inf, loc=-0.02, scale=force_sd)
    # Four standard errors of 3,000 effective draws.
    assert posterior.mean("P")[4] == pytest.approx(cut.mean(), rel=0.07)
    assert posterior.sd("P")[4] == pytest.approx(cut.std(), rel=0.09)


def test_one_load_in_the_calibration_says_little_of_others() -> None:
    """The prior of a load that is not measured is then as wide as that load, and a note says so."""
    pad, calibration = measured_line(np.full(57, 2.0))
    assert (calibration.settings["load_mean"], calibration.settings["load_sd"]) == (2.0, 2.0)
    assert any("the same load" in note for note in calibration.notes)
    location, load = np.array([10.3, 13.0, 25.0])[:, None], np.array([2.0, 0.7, 4.0])
    touches = pad.touch(location, np.random.default_rng(1), load=load, measured=True)
    posterior = infer_beside_quadrature(touches, calibration, 600, use_load=False)
    # Noise of 1 % and 0.05 of readings of 7 and more.
    np.testing.assert_allclose(posterior.mean("P"), load, rtol=0.1)
    infer_beside_quadrature(touches, calibration, 600)


def test_one_element_names_two_places() -> None:
    pad = line()
    pad = replace(
        pad,
        chain=replace(
            pad.chain, gain=pad.chain.gain[1:2], offset=pad.chain.offset[1:2], position=pad.chain.position[1:2]
        ),
        nominal=pad.nominal[1:2],
    )
    touches = pad.touch(np.linspace(8, 24, 65)[:, None], np.random.default_rng(0))
    calibration = calibrate_pad(pad.dataset(touches), kernel="gaussian", empirical=False, draws=8)
    touch = np.array([[12.0], [19.5], [15.8]])
    posterior = check_against_quadrature(pad, calibration, touch, 800, 1)
    np.testing.assert_array_equal(posterior.sample_stats["modes"], [2, 2, 1])
    # The truth at 12.0 and its mirror at 2 * 15.8 - 12.0 are equally likely; half to the Monte Carlo error.
    left = (posterior.posterior["x"][..., 0] < 15.8).mean()
    assert left == pytest.approx(0.5, abs=4 * 0.5 / np.sqrt(posterior.sample_stats["ess_bulk"][0]))


@pytest.mark.parametrize("which", ["line", "square"])
def test_posteriors_cover_the_truth(which: str, request: pytest.FixtureRequest) -> None:
    pad, calibration = request.getfixturevalue(f"{which}_pad")
    rng = np.random.default_rng(9)
    n, dimensions = (400, 1) if which == "line" else (150, 2)
    map_ = PadReader.from_calibration(calibration).map
    location = rng.uniform(map_.low, map_.high, (n, dimensions))
    posterior = infer(pad.touch(location, rng), calibration, draws=400, seed=0, workers=1)
    level = posterior.sample_stats["reference_level"]
    for share in (0.5, 0.9):
        # 4 binomial standard errors, and what one calibration is off by for all touches alike, at most as much again.
        assert np.mean(level <= share) == pytest.approx(share, abs=5 * np.sqrt(share * (1 - share) / n))
    assert (posterior.sample_stats["ess_bulk"] > 160).mean() > 0.95


def test_true_loads_are_covered() -> None:
    pad, rng = line(), np.random.default_rng(3)
    location = np.repeat(np.linspace(6, 34, 29), 3)[:, None]
    calibration = calibrate_pad(
        pad.dataset(pad.touch(location, rng, load=rng.uniform(1, 4, len(location)), measured=True)),
        kernel="gaussian",
        empirical=False,
        draws=8,
    )
    load = rng.uniform(1, 4, 300)
    place = rng.uniform(9, 29, (300, 1))
    touches = pad.touch(place, rng, load=load, measured=True)
    with_force = infer(touches, calibration, draws=400, workers=1)
    without = infer(touches, calibration, draws=400, use_load=False, workers=1)
    assert np.median(without.sd("P")) > 1.5 * np.median(with_force.sd("P"))
    for posterior in (with_force, without):
        low, high = posterior.interval("P", 0.9)
        assert np.mean((low < load) & (load < high)) == pytest.approx(0.9, abs=5 * np.sqrt(0.09 / 300))
    assert any(note.startswith("measured loads are not used: the prior of a load is that") for note in without.notes)
    assert not any("no measured load" in note for note in (*without.notes, *with_force.notes))
    one = infer(touches.select([0]).with_(load=[np.nan]), calibration, draws=64, workers=1)
    assert any(note.startswith("1 touch has no measured load: the prior of a load is that") for note in one.notes)


def test_plug_in_is_narrower(line_pad: tuple[SimulatedPad, Calibration]) -> None:
    pad, _ = line_pad
    few = pad.touch(np.linspace(8, 30, 12)[:, None], np.random.default_rng(1))
    calibration = calibrate_pad(pad.dataset(few), kernel="gaussian", empirical=False, draws=8)
    touches = pad.touch(np.linspace(9, 29, 40)[:, None], np.random.default_rng(2))
    full, plugged = (infer(touches, calibration, plug_in=each, draws=800, workers=1) for each in (False, True))
    ratio = full.sd("x") / plugged.sd("x")
    # An sd of 800 draws is good to 3 %; the median over 40 touches far better.
    assert np.median(ratio) > 1.05


def test_repeats_narrow_a_posterior() -> None:
    pad = line(share=0.0, load_spread=0.0)
    location = np.linspace(6, 34, 57)[:, None]
    calibration = calibrate_pad(
        pad.dataset(pad.touch(location, np.random.default_rng(0), samples=2)),
        kernel="gaussian",
        empirical=False,
        draws=8,
    )
    place = np.full((40, 1), 13.0)
    single = infer(pad.touch(place, np.random.default_rng(1)), calibration, draws=400, plug_in=True, workers=1)
    many = infer(pad.touch(place, np.random.default_rng(1), samples=9), calibration, draws=400, plug_in=True, workers=1)
    # A third of the noise; a part of it may have been taken for discrepancy, which stays.
    assert 0.3 < np.median(many.sd("x")) / np.median(single.sd("x")) < 0.6


def test_touches_that_say_nothing_give_the_prior_back(square_pad: tuple[SimulatedPad, Calibration]) -> None:
    pad, calibration = square_pad
    touches = pad.touch(np.full((3, 2), 11.0), np.random.default_rng(0))
    readings = np.full_like(touches.readings, np.nan)
    readings[1] = touches.readings[1]
    posterior = infer(touches.with_(readings=readings), calibration, draws=1000, workers=1)
    reader = PadReader.from_calibration(calibration)
    for axis, name in enumerate(("x", "y")):
        width = reader.map.high[axis] - reader.map.low[axis]
        draws = posterior.posterior[name][..., 0]
        # Uniform: sd is the width over sqrt(12); 1,000 draws of acceptance 0.7 give it to 5 %.
        assert draws.std() == pytest.approx(width / np.sqrt(12), rel=0.15)
        assert draws.min() >= reader.map.low[axis] and draws.max() <= reader.map.high[axis]
    assert posterior.sd("x")[1] < 0.5
    assert np.isinf(posterior.rows.sd[0]).all()


def test_parts_are_a_density_and_draws_follow_it() -> None:
    rng = np.random.default_rng(0)
    root = np.tril(rng.normal(size=(1, 3, 2, 2)))
    root[..., 0, 0], root[..., 1, 1] = 0.5, 0.8
    parts = ManyParts(np.array([[0.5, 0.3, 0.2]]), 2 * rng.normal(size=(1, 3, 2)), root)

    def density(y: float, x: float) -> float:
        return float(np.exp(parts.log_density(np.array([[[x, y]]]))[0, 0]))

    # Student-t with 6 degrees of freedom: 1e-5 of it lies beyond 20 of its widths.
    total, _ = dblquad(density, -20, 20, -20, 20, epsabs=1e-4)
    assert total == pytest.approx(1, abs=1e-3)
    x, log_density = parts.draw(BlockStreams(0, [0]), 40000)
    np.testing.assert_allclose(log_density, parts.log_density(x), rtol=1e-12)
    mean = np.einsum("k,kd->d", parts.weight[0], parts.mean[0])
    # 4 standard errors of the mean of 40,000 draws.
    assert np.all(np.abs(x[0].mean(axis=0) - mean) < 4 * x[0].std(axis=0) / 200)
    below, _ = dblquad(density, -20, mean[0], -20, 20, epsabs=1e-4)
    assert (x[0, :, 0] < mean[0]).mean() == pytest.approx(below, abs=4 * 0.5 / 200 + 1e-3)


def test_parts_serve_as_the_posterior(square_pad: tuple[SimulatedPad, Calibration]) -> None:
    # They need not, for the sampler corrects them; but it is quick only where most draws are accepted.
    pad, calibration = square_pad
    rng = np.random.default_rng(5)
    posterior = infer(pad.touch(rng.uniform(4, 18, (100, 2)), rng), calibration, draws=200, workers=1)
    assert np.median(posterior.sample_stats["acceptance"]) > 0.6
    assert (posterior.sample_stats["acceptance"] > 0.3).mean() > 0.9


def test_many_parts_keep_mean_and_spread(square_pad: tuple[SimulatedPad, Calibration]) -> None:
    pad, calibration = square_pad
    reader = PadReader.from_calibration(calibration)
    touches = known(reader, pad.touch(np.array([[18.9, 18.9], [11.0, 8.0]]), np.random.default_rng(0)))
    components = components_of(reader, touches, lattice_for(reader))
    parts = many_parts(components, 2)
    for t in range(2):
        here = components.touch == t
        weight = np.exp(components.log_weight[here] - components.log_weight[here].max())
        weight /= weight.sum()
        np.testing.assert_allclose(parts.weight[t] @ parts.mean[t], weight @ components.mean[here], rtol=1e-9)
    assert count_places(components, 2)[1] == 1


def test_draws_depend_on_seed_and_place_alone(line_pad: tuple[SimulatedPad, Calibration]) -> None:
    pad, calibration = line_pad
    touches = pad.touch(np.linspace(9, 29, 20)[:, None], np.random.default_rng(2))
    first, second = (infer(touches, calibration, draws=100, seed=4, workers=1) for _ in range(2))
    other = infer(touches, calibration, draws=100, seed=5, workers=1)
    np.testing.assert_array_equal(first.posterior["x"], second.posterior["x"])
    assert not np.array_equal(first.posterior["x"], other.posterior["x"])


def test_touches_after_missing_ones_are_drawn_apart(line_pad: tuple[SimulatedPad, Calibration]) -> None:
    """They alone have what missing touches may have left. The others are drawn as if no touch had it."""
    pad, calibration = line_pad
    sampler = PadSampler.of(PadReader.from_calibration(calibration))
    plain = pad_readings(pad.touch(np.linspace(9, 29, 6)[:, None], np.random.default_rng(2)), 1, "mean")
    left = np.zeros((6, 2, 4))
    left[[1, 4], 0, :2], left[[1, 4], 1] = 0.5, [[1.0, 2.0, 3.0, 4.0], [2.0, 2.0, 2.0, 0.0]]
    means = CorrectedMeans(
        **{each.name: getattr(plain, each.name) for each in fields(plain)}, load_as_read=plain.load, by_missing=left
    )
    others, some = sampler.groups(means, np.arange(6))
    np.testing.assert_array_equal(others.rows, [0, 2, 3, 5])
    assert others.known.by_noise is None
    (wanted,) = sampler.groups(plain, others.rows)
    points = np.array([[[x, 1.0]] for x in (9.0, 17.0, 21.0, 29.0)])
    for of in (lambda group: group.log_density(points, np.arange(4)), lambda group: group.proposal.log_density(points)):
        np.testing.assert_allclose(of(others), of(wanted), rtol=1e-12)
    np.testing.assert_array_equal(some.rows, [1, 4])
    np.testing.assert_array_equal(some.known.by_noise, left[[1, 4]])


def test_wrong_number_of_elements_is_said(line_pad: tuple[SimulatedPad, Calibration]) -> None:
    _, calibration = line_pad
    with pytest.raises(InputError, match="the table has 3 elements, the calibrated sensor 4"):
        infer(
            line().touch(np.array([[12.0]]), np.random.default_rng(0)).with_(readings=np.zeros((1, 3))),
            calibration,
            draws=1000,
            workers=1,
        )
