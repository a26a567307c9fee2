"""Errors of the place: the likelihood written out, known errors found again, and the regions of touches with them."""

from __future__ import annotations

import numpy as np
import pytest
from live_cases import streamed
from pad_simulation import SimulatedPad, line
from scipy.stats import multivariate_normal

from bayestouch import Calibration, Reader, infer
from bayestouch.chain.noise import Noise
from bayestouch.chain.pad_map import PadMap
from bayestouch.pad.calibration import calibrate_pad, choose_pad
from bayestouch.pad.noise import LeftOut
from bayestouch.pad.place_error import CLEAR, gain_by_touch, place_error
from bayestouch.pad.reading.reader import PadReader

PLACE = np.linspace(6, 34, 57)[:, None]


def left_out_of(n: int, error: float, dimensions: int = 2) -> tuple[LeftOut, np.ndarray, Noise]:
    """Touches on four elements with a noise of 0.1, a load error of a tenth and an error of the place, mm."""
    rng = np.random.default_rng(3)
    signal, slope = rng.normal(size=(n, 4)), rng.normal(size=(n, dimensions, 4))
    moved = np.einsum("nd,ndm->nm", error * rng.normal(size=(n, dimensions)), slope)
    residual = moved + 0.1 * rng.normal(size=(n, 1)) * signal + 0.1 * rng.normal(size=(n, 4))
    one, unknown = np.ones((n, 4), dtype=np.int64), np.full(n, np.nan)
    left_out = LeftOut(residual, np.zeros((n, 4)), signal, one, np.ones(n), unknown)
    return left_out, slope, Noise(np.zeros(4), np.full(4, 0.1))


def test_gain_is_that_of_normals_with_a_common_displacement() -> None:
    left_out, slope, noise = left_out_of(3, 0.2)
    left_out.residual[1, 2] = np.nan
    left_out.variance[:] = np.arange(12.0).reshape(3, 4) / 100
    errors = np.array([0.05, 0.3])
    found = gain_by_touch(left_out, slope, noise, 0.1, errors)
    for t in range(3):
        here = np.isfinite(left_out.residual[t])
        without = np.diag(0.01 + left_out.variance[t]) + 0.01 * np.outer(left_out.signal[t], left_out.signal[t])
        for k, error in enumerate(errors):
            with_error = without + error**2 * slope[t].T @ slope[t]
            logs = [
                multivariate_normal(np.zeros(here.sum()), each[np.ix_(here, here)]).logpdf(left_out.residual[t, here])
                for each in (with_error, without)
            ]
            assert found[k, t] == pytest.approx(logs[0] - logs[1], rel=1e-9, abs=1e-12)


def test_error_is_found_again_and_none_where_there_is_none() -> None:
    left_out, slope, noise = left_out_of(400, 0.05)
    # four standard errors of an sd from 400 touches in two coordinates (14 %), and half a step between the errors tried
    assert place_error(left_out, slope, noise, 0.1, 1.0) == pytest.approx(0.05, rel=0.25)
    left_out, slope, noise = left_out_of(400, 0.0)
    assert place_error(left_out, slope, noise, 0.1, 1.0) == 0


def test_one_wrong_touch_shows_no_error_of_all() -> None:
    left_out, slope, noise = left_out_of(60, 0.0)
    left_out.residual[7] += 3 * slope[7, 0]
    assert gain_by_touch(left_out, slope, noise, 0.1, np.array([0.5]))[0, 7] > 10 * CLEAR
    assert place_error(left_out, slope, noise, 0.1, 1.0) == 0


@pytest.fixture(scope="module")
def displaced() -> tuple[SimulatedPad, Calibration]:
    """A line and its calibration by touches whose stated places are 0.05 mm off."""
    pad, rng = line(load_spread=0.002, share=0.0, floor=0.005), np.random.default_rng(2)
    touches = pad.touch(PLACE + 0.05 * rng.standard_normal(PLACE.shape), rng)
    touches = touches.with_(x_mm=PLACE[:, 0])
    return pad, calibrate_pad(pad.dataset(touches), kernel="gaussian", empirical=True, seed=0, draws=8)


def displacements(map_: PadMap, where: np.ndarray) -> np.ndarray:
    """Sd in load (N/N) and place (mm) of the common errors of the elements, by least squares, (k, 2)."""
    by_load, slope = map_.slopes(where)
    inverse = np.linalg.pinv(np.stack([by_load, slope[:, 0]], axis=1))
    return np.sqrt(((map_.shared_at(where) @ inverse) ** 2).sum(axis=1))


def test_touches_are_read_with_the_error_of_the_place(displaced: tuple[SimulatedPad, Calibration]) -> None:
    """Common errors of the map are at least the displacement that the noise leaves."""
    error, map_ = displaced[1].statistics["place_error"], PadMap.from_arrays(displaced[1].extra)
    # the noise of the elements has a part of it
    assert 0.02 < error < 0.06
    spread = displacements(map_, np.linspace(11, 29, 10)[:, None])[:, 1]
    assert (spread > 0.97 * error).all()
    assert np.median(spread) < 1.5 * error


def test_an_exact_calibration_leaves_the_error_of_the_place(displaced: tuple[SimulatedPad, Calibration]) -> None:
    """The place of a touch is off however well the pad is known: `infer` and `Reader` allow for it, too."""
    pad, made = displaced
    error = made.statistics["place_error"]
    exact = PadReader.from_calibration(made, plug_in=True).map
    where = np.linspace(11, 29, 10)[:, None]
    # linear between grid points: less than a hundredth of the slopes of the splines
    wanted = np.array([0.0, error]) + np.zeros((10, 2))
    np.testing.assert_allclose(displacements(exact, where), wanted, atol=0.01 * error)
    assert not any(each.any() for each in exact.at(where)[1:])
    touches = pad.touch(where, np.random.default_rng(5), samples=20)
    read = infer(touches, made, plug_in=True, check_sensor=False, draws=800, workers=1)
    # 800 draws know an sd to 3 %, and all ten their median to less than a tenth; it has the noise, too
    assert 0.9 * error < np.median(read.sd("x")) < 1.5 * error
    live = streamed(Reader(made, plug_in=True), touches.with_(time_s=np.arange(len(touches.touch), dtype=float)))
    np.testing.assert_allclose([each["x"][1] for each in live], read.sd("x"), rtol=0.15)


def test_slopes_of_predicted_readings() -> None:
    """Of a Gaussian bell without a map: gain (position - x)/width² exp(-½ (x - position)²/width²), times the load."""
    pad = line()
    model = choose_pad(
        pad.dataset(pad.touch(PLACE, np.random.default_rng(2))), kernel="gaussian", empirical=False
    ).model
    chain, load = model.fit.chain, model.fit.known.load
    width = chain.values[0]
    away = PLACE - chain.position[:, 0]
    expected = -load[:, None] * chain.gain * away / width**2 * np.exp(-0.5 * (away / width) ** 2)
    np.testing.assert_allclose(model.by_place[:, 0], expected, atol=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize(("error", "least"), [(0.0, 0.85), (0.01, 0.80), (0.03, 0.84)])
def test_regions_hold_stated_places_that_are_off(error: float, least: float) -> None:
    """A line along which every fourth pair of touches is read; its places are off like those of the calibration."""
    held = []
    for seed in range(40):
        rng, pad = np.random.default_rng([7, seed]), line(load_spread=0.003, share=0.0, floor=0.005)
        stated = np.linspace(8, 33, 60)[:, None]
        touches = pad.touch(stated + error * rng.standard_normal(stated.shape), rng).with_(x_mm=stated[:, 0])
        read = np.arange(60) // 2 % 4 == 2
        calibration = touches.select(~read)
        made = calibrate_pad(pad.dataset(calibration), kernel="gaussian", empirical=True, draws=50, seed=seed)
        low, high = infer(touches.select(read), made, check_sensor=False).interval("x", 0.9)
        held.append((low <= stated[read, 0]) & (stated[read, 0] <= high))
    # An error of 0.01 mm is not clear in every calibration. 0.05 is four standard errors of a share of 560 touches.
    assert least < np.mean(held) < 0.95
