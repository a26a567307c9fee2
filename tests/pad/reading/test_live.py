"""Live reader of a pad whose sensitivity depends on the load: against sums over a grid of places and loads."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import bayestouch
from bayestouch.chain.pad_map import PadMap
from bayestouch.pad.reading.draws import PadSampler
from bayestouch.pad.reading.live import PadLive
from bayestouch.pad.reading.reader import PadReader, PadTouches
from bayestouch.reading.live import HeldTouch
from bayestouch.reading.options import Options

READS = 20.0


@pytest.fixture(scope="module")
def live() -> PadLive:
    """A line of four elements whose sensitivity falls by 20 % where the load is e times as large."""
    design = bayestouch.PadDesign(element_x_mm=(0.0, 6.0, 12.0, 18.0), element_y_mm=None, n_touches=5)
    dataset = bayestouch.simulate(design, seed=3).dataset
    calibration = bayestouch.calibrate(dataset, kernel="gaussian", e_map="model", draws=64, seed=1)
    plain, typical = PadMap.from_arrays(calibration.extra), float(calibration.settings["load_mean"])
    loads = typical * np.geomspace(0.3, 3.0, 12)
    by_load = np.concatenate([-0.2 * np.log(each / typical) * plain.sensitivity for each in loads], axis=-1)
    bent = replace(plain, loads=loads, by_load=by_load, variance_by_load=np.zeros_like(by_load))
    made = PadLive.of(calibration, Options())
    reader = replace(made.reader.sampler.reader, map=bent)
    return PadLive(replace(made.reader, sampler=PadSampler.of(reader)))


def exact(reader: PadReader, reading: np.ndarray, load: float, measured: bool) -> tuple[float, float]:
    """Mean and sd of the load, by sums over 201 places and 2001 loads as they are felt.

    What is felt is the load that acts and an error of all elements, both normal: a share of what is felt is the load.
    """
    sd = reader.measured_load_sd(np.array([load]), np.array([READS]))[0] if measured else reader.load_sd
    given = np.array([load if measured else reader.load])
    touches = PadTouches(reading[None], np.full((1, 4), int(READS)), given, np.array([sd]), reader.noise.load_scatter)
    touches = replace(touches, changes=np.zeros((1, 0, 5)))
    places, loads = np.linspace(7.0, 9.0, 201), np.linspace(0.5 * load, 1.6 * load, 2001)
    grid = np.stack([each.ravel() for each in np.meshgrid(places, loads, indexing="ij")], axis=-1)
    log = reader.log_density(touches, grid[None], np.array([0]))[0]
    weight = np.exp(log - log.max())
    felt = np.average(grid[:, 1], weights=weight)
    variance = np.average((grid[:, 1] - felt) ** 2, weights=weight)
    scatter = reader.noise.load_scatter
    share = sd**2 / (sd**2 + scatter**2)
    return float(given[0] + share * (felt - given[0])), float(np.sqrt(share**2 * variance + share * scatter**2))


@pytest.mark.parametrize("measured", [True, False])
@pytest.mark.parametrize("times", [0.5, 1.0, 2.0])
def test_a_load_far_from_the_typical_one(live: PadLive, times: float, measured: bool) -> None:
    """Three to seven nodes suffice if they lie about the mode, as they are promised to: 0.1 sd, and 5 % of it."""
    reader = live.reader.sampler.reader
    load = times * reader.load
    sensitivity, _, _ = reader.map.at(np.array([[8.0]]), np.array([load]))
    reading = reader.map.offset + load * sensitivity[0]
    touch, _ = live.read(HeldTouch.none(4).after(reading, load if measured else np.nan, READS))
    mean, sd = exact(reader, reading, load, measured)
    assert touch["P"][0] == pytest.approx(mean, abs=0.1 * sd)
    assert touch["P"][1] == pytest.approx(sd, rel=0.05)
    assert not [flag for flag in touch.flags if "fit no touch" in flag]
