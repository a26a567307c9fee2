"""A line of elements, calibrated and saved."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import xarray as xr
from pad_simulation import line

from bayestouch.pad.calibration import calibrate_pad
from bayestouch.results.objects import Calibration
from bayestouch.results.reading import load_calibration

M = 4


SAMPLES = 3


#: Shared spread of loads, noise and share of the simulated pad.
SETTINGS = {"floor": 0.15, "share": 0.01, "load_spread": 0.05}


@dataclass(frozen=True, eq=False)
class Kernel:
    """A pad by the numbers on file: gains, offsets, places (mm), and the width that all share."""

    flat: np.ndarray

    def readings(self, x: np.ndarray, load: np.ndarray) -> np.ndarray:
        """Readings (n, m) at places and loads (n,)."""
        gain, offset, place = self.flat[: 3 * M].reshape(3, M)
        return offset + load[:, None] * gain * np.exp(-0.5 * ((x[:, None] - place) / self.flat[-1]) ** 2)

    def slopes(self, x: np.ndarray, load: np.ndarray) -> np.ndarray:
        """Derivative (d, n, m) over the numbers, by central differences."""
        out = []
        for i, step in enumerate(np.repeat([1e-4, 1e-4, 1e-4, 1e-4], [M, M, M, 1])):
            ends = [Kernel(self.flat + sign * step * (np.arange(len(self.flat)) == i)) for sign in (1, -1)]
            out.append((ends[0].readings(x, load) - ends[1].readings(x, load)) / (2 * step))
        return np.array(out)


@dataclass(frozen=True, eq=False)
class OnFile:
    """A calibrated pad as its file has it."""

    path: Path
    place: np.ndarray
    load: np.ndarray
    readings: np.ndarray

    @cache  # noqa: B019  # a fixture lives as long as its module
    def group(self, name: str) -> dict[str, np.ndarray]:
        """Arrays of a group of the file."""
        with xr.open_datatree(self.path) as tree:
            return {str(key): np.array(values) for key, values in tree[name].data_vars.items()}

    def flat(self, group: str) -> np.ndarray:
        """Gains, offsets, places and width in a row (..., d)."""
        values = self.group(group)
        return np.concatenate([*(values[name] for name in ("gain", "offset", "x_s")), values["w"][..., None]], axis=-1)

    def calibration(self) -> Calibration:
        return load_calibration(self.path)

    def variance(self, x: np.ndarray, load: np.ndarray, counts: int, *, exact: bool = False) -> np.ndarray:
        """Variance (n, m) of mean readings: noise, what the model misses, a share of the signal, the calibration."""
        noise, pad = self.group("noise"), Kernel(self.flat("mode"))
        signal = pad.readings(x, load) - self.group("mode")["offset"]
        total = noise["tactile_sd"] ** 2 / counts + noise["discrepancy_sd"] ** 2
        total = total + (float(noise["signal_share"]) * signal) ** 2
        if exact:
            return np.asarray(total)
        covariance = self.group("laplace")["covariance"]
        return np.asarray(total + np.einsum("dnm,de,enm->nm", slope := pad.slopes(x, load), covariance, slope))

    def covariance(self, x: np.ndarray, load: np.ndarray, counts: int) -> np.ndarray:
        """Covariance (n, m, m) of mean readings, whose errors by the calibration are not independent."""
        slope, known = Kernel(self.flat("mode")).slopes(x, load), self.group("laplace")["covariance"]
        own = self.variance(x, load, counts, exact=True)[:, :, None] * np.eye(M)
        return np.asarray(own + np.einsum("dnm,de,enk->nmk", slope, known, slope, optimize=True))


def on_file(folder: Path, seed: int, *, touches: int, measured: bool, draws: int = 8) -> OnFile:
    """Touch a pad along its line, calibrate, save."""
    pad, rng = line(**SETTINGS), np.random.default_rng(seed)
    place = np.linspace(6, 34, touches)
    load = rng.uniform(0.8, 1.2, touches) if measured else 1 + 0.05 * rng.standard_normal(touches)
    table = pad.touch(place[:, None], rng, load=load, measured=measured, samples=SAMPLES)
    path = folder / "pad.nc"
    calibrate_pad(pad.dataset(table), kernel="gaussian", empirical=False, samples="mean", draws=draws).save(path)
    means = table.averaged()
    return OnFile(path, place, means.load if measured else np.ones(touches), means.readings)
