"""Touches on a pad whose noise grows with the signal, or is shared by its elements, by a simulator of its own.

A line of five elements with bells; readings are drawn here, sample by sample. A touch is also read by a density that is
written out and summed over a grid.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import bayestouch
from bayestouch.chain.pad_map import PadMap
from bayestouch.data.dataset import DataSet
from bayestouch.data.sensor import Pad, Sensor
from bayestouch.data.touches import Touches, touches_from
from bayestouch.effects.stated import StatedModel
from bayestouch.results.reading import load_calibration

PLACE, GAIN, WIDTH = np.array([0.0, 6.0, 12.0, 18.0, 24.0]), np.array([1.0, 1.2, 0.8, 1.1, 0.9]), 5.0
FORCE_NOISE, TOUCHES = 0.01, 600
# Loads of the touches that are read: a third are light ones, a third are heavy ones.
LIGHT, HEAVY = 0.87, 1.43


@dataclass(frozen=True)
class Errors:
    """Noise of a sample: constant and of all elements together, over the gain; and as a share of the signal."""

    floor: float
    share: float = 0.0
    common: float = 0.0


NOISES = {
    "signal_dependent_noise": Errors(floor=0.001, share=0.02),
    "common_mode_noise": Errors(floor=0.002, common=0.01),
}


def pressed(rng: np.random.Generator, place: np.ndarray, load: np.ndarray, samples: int, errors: Errors) -> Touches:
    rows = np.repeat(np.arange(len(place)), samples)
    signal = (load[:, None] * GAIN * np.exp(-0.5 * ((place[:, None] - PLACE) / WIDTH) ** 2))[rows]
    noise = np.hypot(errors.floor * GAIN, errors.share * signal) * rng.standard_normal(signal.shape)
    noise += errors.common * GAIN * rng.standard_normal((len(rows), 1))
    return touches_from(
        rows,
        signal + noise,
        sample=np.tile(np.arange(samples), len(place)),
        x_mm=place[rows],
        load=load[rows] + FORCE_NOISE * rng.standard_normal(len(rows)),
    )


@cache
def calibrated(effect: str) -> bayestouch.Calibration:
    rng = np.random.default_rng(7)
    table = pressed(rng, rng.uniform(-2, 26, 150), rng.uniform(0.5, 2, 150), 8, NOISES[effect])
    sensor = Sensor(
        name="line", body=Pad(tuple(PLACE)), reading_unit="V", force_noise_sd=FORCE_NOISE, source={"note": "simulated"}
    )
    model = StatedModel("pad", "", ((effect, {}),))
    return bayestouch.calibrate(DataSet(sensor, table, table), kernel="gaussian", e_map="model", model=model, draws=100)


@cache
def fresh(effect: str, samples: int) -> tuple[np.ndarray, np.ndarray, Touches]:
    rng = np.random.default_rng(8)
    place, load = rng.uniform(0, 24, TOUCHES), rng.uniform(0.3, 2, TOUCHES)
    return place, load, pressed(rng, place, load, samples, NOISES[effect])


@pytest.mark.parametrize("samples", [1, 4])
@pytest.mark.parametrize("effect", list(NOISES))
def test_errors_of_touches_are_what_their_posteriors_say(effect: str, samples: int) -> None:
    """Places and loads without the force sensor: light and heavy touches each by itself, on average of 200 each.

    With one noise of each element at all signals, the errors of light touches were half of their sd, and those of heavy
    ones 1.4 (place) and 2 (load) times it; with a noise that elements share, those of the place a third.
    """
    place, load, table = fresh(effect, samples)
    read = bayestouch.infer(table, calibrated(effect), draws=200, use_load=False, check_sensor=False)
    for name, truth in (("x", place), ("P", load)):
        draws = read.posterior[name].reshape(-1, TOUCHES)
        inside = np.abs((draws < truth).mean(axis=0) - 0.5) < 0.45
        square = ((draws.mean(axis=0) - truth) / draws.std(axis=0)) ** 2
        for some in (load < LIGHT, load > HEAVY, np.ones(TOUCHES, dtype=bool)):
            # Four standard errors, and 5 % of the sd that 150 touches leave of the noise.
            error = 4 / np.sqrt(some.sum())
            assert square[some].mean() == pytest.approx(1, abs=np.sqrt(2) * error + 0.1)
            assert inside[some].mean() == pytest.approx(0.9, abs=0.3 * error + 0.02)


@pytest.mark.parametrize("seed", [9, 11])
def test_a_gain_3_percent_off_beside_noise_of_all_elements(seed: int) -> None:
    """As if that noise were each element's own, the check said nothing of one table, and two others of the second."""
    rng = np.random.default_rng(seed)
    place, load = rng.uniform(0, 24, 40), rng.uniform(0.3, 2, 40)
    table = pressed(rng, place, load, 1, NOISES["common_mode_noise"])
    for gain, left_out in ((1.0, None), (0.97, "e03")):
        other = table.with_(readings=table.readings * np.where(np.arange(5) == 2, gain, 1.0))
        read = bayestouch.infer(other, calibrated("common_mode_noise"), draws=64)
        assert read.settings.get("elements_left_out") == left_out


def written_out(calibration: bayestouch.Calibration, reading: np.ndarray, samples: int) -> np.ndarray:
    """Mean and sd of place and load, (2, 2), from the mean reading (m,) of one touch: sums over a grid.

    The map of the calibration is exact; its noise and that of the effects are the numbers on file.
    """
    map_, noise = PadMap.from_arrays(calibration.extra), calibration.noise
    added = json.loads(str(calibration.settings["effects"]))["noise"]
    peak = calibration.extra["effect_peak"]
    together = peak ** (1 - added["common_shared"]) * peak.mean() ** added["common_shared"]
    common = (added["common"] ** 2 / samples + added["common_touch"] ** 2) * np.outer(together, together)
    mean, sd = float(calibration.settings["load_mean"]), float(calibration.settings["load_sd"])
    ends = np.array([map_.low[0], map_.high[0]]), np.array([0.05, 3.0])
    for _ in range(4):
        place, load = (np.linspace(*end, 161) for end in ends)
        x, p = (each.ravel() for each in np.meshgrid(place, load, indexing="ij"))
        predicted = map_.offset + p[:, None] * map_.at(x[:, None])[0]
        own = noise.tactile_sd**2 + (added["share"] * peak * np.abs(predicted / peak) ** added["power"]) ** 2
        own = own / samples + noise.discrepancy_sd**2 + (noise.signal_share * (predicted - map_.offset)) ** 2
        covariance = own[:, :, None] * np.eye(len(peak)) + common
        miss = reading - predicted
        log = -0.5 * np.einsum("ni,ni->n", miss, np.linalg.solve(covariance, miss[:, :, None])[:, :, 0])
        log -= 0.5 * np.linalg.slogdet(covariance)[1]
        log -= 0.5 * (p - mean) ** 2 / (sd**2 + noise.load_scatter**2)
        weight = np.exp(log - log.max())
        weight /= weight.sum()
        points = np.stack([x, p])
        middle = points @ weight
        spread = np.sqrt((points - middle[:, None]) ** 2 @ weight)
        # At first, all is in one cell of the grid.
        step = np.array([place[1] - place[0], load[1] - load[0]])
        reach = np.maximum(7 * spread, 3 * step)
        ends = tuple(np.array([m - r, m + r]) for m, r in zip(middle, reach, strict=True))
    # The load that is stated is the one that acts; what elements feel has an error that they share.
    kept = sd**2 / (sd**2 + noise.load_scatter**2)
    middle[1], spread[1] = mean + kept * (middle[1] - mean), np.hypot(kept * spread[1], kept**0.5 * noise.load_scatter)
    return np.stack([middle, spread])


@pytest.mark.parametrize("effect", list(NOISES))
def test_touches_are_read_by_the_density_written_out(effect: str) -> None:
    """`infer` and the live reader, the calibration exact, four samples in each touch."""
    calibration = calibrated(effect)
    _, _, table = fresh(effect, 4)
    some = table.select(table.touch < 12)
    read = bayestouch.infer(some, calibration, draws=4000, use_load=False, check_sensor=False, plug_in=True)
    live = bayestouch.Reader(calibration, use_load=False, plug_in=True)
    for t, reading in enumerate(some.averaged().readings):
        mean, sd = written_out(calibration, reading, 4)
        touch = live.read(reading, reads=4)
        for k, name in enumerate(("x", "P")):
            # The sampler has some 2,000 independent draws.
            assert read.mean(name)[t] == pytest.approx(mean[k], abs=0.1 * sd[k])
            assert read.sd(name)[t] == pytest.approx(sd[k], rel=0.08)
            assert touch.mean[k] == pytest.approx(mean[k], abs=0.05 * sd[k])
            assert touch.sd[k] == pytest.approx(sd[k], rel=0.04)


@pytest.mark.parametrize("effect", list(NOISES))
def test_a_calibration_on_file_reads_alike(effect: str, tmp_path: Path) -> None:
    """Its noise is that without the effects; and no note says that touches are read without them."""
    calibration = calibrated(effect)
    calibration.save(tmp_path / "pad.nc")
    loaded = load_calibration(tmp_path / "pad.nc")
    # Of 150 touches of eight samples, the sd of the noise is known to 3 %; shares of a noise that is 20 times as large
    # leave less of it.
    np.testing.assert_allclose(loaded.noise.tactile_sd, NOISES[effect].floor * GAIN, rtol=0.2)
    _, _, table = fresh(effect, 1)
    some = table.select(table.touch < 20)
    one, other = (bayestouch.infer(some, each, draws=64, check_sensor=False) for each in (calibration, loaded))
    np.testing.assert_array_equal(one.posterior["x"], other.posterior["x"])
    assert not [note for note in calibration.notes if "are read without" in note]
