"""Expected errors of locations on a pad, against the inverse of the information about place and load, written out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bayestouch.chain.noise import Noise
from bayestouch.chain.pad_map import PadMap
from bayestouch.model.noise import AddedNoise
from bayestouch.pad.added_noise import NoiseByEffects
from bayestouch.pad.reading.reader import PadReader
from bayestouch.reliability import pad_known_bias, pad_spots

CENTRE, WIDTH, GAIN = np.array([4.0, 10.0, 16.0]), 4.0, np.array([10.0, 12.0, 9.0])
NOISE, LOW, HIGH = np.array([0.10, 0.12, 0.08]), 0.0, 24.0
LOAD, LOAD_SD, FORCE_SD = 2.0, 0.5, 0.02
# Between the elements, and far beyond the last of them, where one element reads alone.
PLACES = np.array([7.0, 17.0, 23.0])


def sensitivity(place: np.ndarray) -> np.ndarray:
    return np.asarray(GAIN * np.exp(-0.5 * ((place[..., None] - CENTRE) / WIDTH) ** 2))


def reader(*, measured: bool = True, scatter: float = 0.0, lack: float = 0.0, gain: float = 1.0) -> PadReader:
    """A pad whose calibration is exact."""
    place = np.arange(-3.0, 27.01, 0.5)
    table = gain * sensitivity(place)
    none = np.zeros_like(table)
    map_ = PadMap(
        origin=place[:1],
        step=np.array([0.5]),
        low=np.array([LOW]),
        high=np.array([HIGH]),
        offset=np.zeros(3),
        offset_variance=np.zeros(3),
        sensitivity=table,
        variance=none,
        covariance=none,
    )
    noise = Noise(NOISE, np.full(3, lack), 0.0, FORCE_SD if measured else np.nan, scatter)
    usable = np.ones(3, dtype=bool)
    return PadReader(map_, noise, LOAD, LOAD_SD, load_measured=measured, samples="mean", usable=usable)


def written_out(load_sd: float, variance: np.ndarray) -> np.ndarray:
    """Standard deviation of x (n,) by the inverse of the 2 by 2 information about x and the felt load."""
    by_load = sensitivity(PLACES)
    by_place = LOAD * by_load * (CENTRE - PLACES[:, None]) / WIDTH**2
    weight = 1 / variance
    of_place = (weight * by_place**2).sum(axis=1) + 12 / (HIGH - LOW) ** 2
    of_load = (weight * by_load**2).sum(axis=1) + (load_sd**-2.0 if load_sd else np.inf)
    both = (weight * by_place * by_load).sum(axis=1)
    return np.asarray((of_place - both**2 / of_load) ** -0.5)


@pytest.mark.parametrize(
    ("measured", "use_load", "scatter", "load_sd"),
    [
        (True, True, 0.0, FORCE_SD / 2),
        (True, True, 0.1, np.hypot(FORCE_SD / 2, 0.1)),
        (True, False, 0.1, np.hypot(LOAD_SD, 0.1)),
        (False, True, 0.0, LOAD_SD),
    ],
)
def test_a_measured_load_is_known_as_the_force_sensor_reads_it(
    measured: bool, use_load: bool, scatter: float, load_sd: float
) -> None:
    pad = reader(measured=measured, scatter=scatter)
    found = pad_spots(pad, PLACES[:, None], reads=4, use_load=use_load).sd
    # the derivative of the cubic splines of the tables has an error of about 1e-4
    np.testing.assert_allclose(found, written_out(load_sd, NOISE**2 / 4), rtol=1e-3)
    # beyond the elements it makes the difference
    assert written_out(FORCE_SD / 2, NOISE**2 / 4)[2] < 0.2 * written_out(LOAD_SD, NOISE**2 / 4)[2]


def test_a_load_that_is_stated_once_is_one_reading_of_the_force_sensor() -> None:
    found = pad_spots(replace(reader(), load_reads=1.0), PLACES[:, None], reads=400).sd
    np.testing.assert_allclose(found, written_out(FORCE_SD, NOISE**2 / 400), rtol=1e-3)


@pytest.mark.parametrize("scatter", [0.0, 0.1])
def test_averaging_without_end_leaves_the_lack_of_fit_and_the_scatter_of_the_load(scatter: float) -> None:
    found = pad_spots(reader(scatter=scatter, lack=0.2), PLACES[:, None], reads=np.inf).sd
    np.testing.assert_allclose(found, written_out(scatter, np.full(3, 0.2**2)), rtol=1e-3)


def test_with_a_measured_load_one_element_tells_the_place() -> None:
    """It reads 1 % too much: the touch seems nearer by the change of place that gives 1 %."""
    far = np.array([[23.0]])
    found = pad_known_bias(reader(), reader(gain=1.01), far)[0, 0]
    assert found == pytest.approx(0.01 * WIDTH**2 / (CENTRE[2] - 23.0), rel=0.02)


@pytest.mark.parametrize("reads", [1.0, 4.0, np.inf])
def test_noise_of_the_signal_and_of_all_elements(reads: float) -> None:
    """The whole covariance of the readings, inverted; an error that all samples of a touch share remains."""
    added = AddedNoise(share=0.05, power=0.8, common=0.01, common_touch=0.02)
    plain, peak = reader(lack=0.02), LOAD * GAIN
    pad = replace(plain, noise=NoiseByEffects(added, peak, np.zeros(3)).to(plain.noise))
    found = pad_spots(pad, PLACES[:, None], reads=reads)
    by_load = sensitivity(PLACES)
    by_place = LOAD * by_load * (CENTRE - PLACES[:, None]) / WIDTH**2
    own = (NOISE**2 + (0.05 * peak * (LOAD * by_load / peak) ** 0.8) ** 2) / reads + 0.02**2
    covariance = own[:, :, None] * np.eye(3) + (0.01**2 / reads + 0.02**2) * np.outer(peak, peak)
    slopes = np.stack([by_place, by_load], axis=1)
    precision = np.diag([12 / (HIGH - LOW) ** 2, max(FORCE_SD / np.sqrt(reads), 1e-6 * LOAD) ** -2.0])
    wanted = np.linalg.inv(slopes @ np.linalg.solve(covariance, slopes.swapaxes(1, 2)) + precision)
    np.testing.assert_allclose(found.sd, np.sqrt(wanted[:, 0, 0]), rtol=1e-3)
    assert (found.bias_rms == 0).all()
    np.testing.assert_allclose((found.by_element.sum(axis=-1) + found.of_none)[:, 0], found.sd**2, rtol=1e-9)
