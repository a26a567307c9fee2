"""Small simulated pads for the tests of pads: a kernel, a load that varies, noise, and the truth."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

import bayestouch
from bayestouch.chain.kernels import GaussianKernel, Kernel
from bayestouch.chain.pad import PadChain
from bayestouch.data.dataset import DataSet
from bayestouch.data.sensor import Pad, Sensor
from bayestouch.data.touches import Touches, touches_from
from bayestouch.effects.stated import StatedModel
from bayestouch.results.objects import Calibration

# Noise of the force sensor of `flattening`, N.
FORCE_NOISE = 0.02


@dataclass(frozen=True, eq=False)
class SimulatedPad:
    """A pad as it is, with its noise.

    Attributes
    ----------
    chain : PadChain
        The truth, in the stage's coordinates.
    nominal : (m, D) array
        Positions that the maker states.
    floor, share : float
        Noise of a reading, and what of it is in proportion to the signal.
    load_spread : float
        Standard deviation of the loads, which nobody measures, about 1.
    """

    chain: PadChain
    nominal: np.ndarray
    floor: float = 0.005
    share: float = 0.01
    load_spread: float = 0.02

    @property
    def sensor(self) -> Sensor:
        """As built."""
        columns = [tuple(column) for column in self.nominal.T]
        return Sensor(name="simulated pad", body=Pad(*columns), reading_unit="kPa", source={"note": "simulated"})

    def touch(
        self,
        location: np.ndarray,
        rng: np.random.Generator,
        *,
        load: np.ndarray | None = None,
        measured: bool = False,
        acting: np.ndarray | None = None,
        exponent: float = 1.0,
        samples: int = 1,
        creep: float = 0.0,
    ) -> Touches:
        """Readings of touches at `location` (t, D), `samples` of each; the last ones lower by the share `creep`.

        `acting` are the loads that elements feel; by default, `load` itself.
        """
        n = len(location)
        if load is None:
            load = 1 + self.load_spread * rng.standard_normal(n)
        felt = load**exponent if acting is None else acting
        signal = self.chain.predict(location, felt) - self.chain.offset
        rows = np.repeat(np.arange(n), samples)
        fade = 1 - creep * np.tile(np.linspace(0, 1, samples) if samples > 1 else [0.0], n)
        clean = signal[rows] * fade[:, None]
        sd = np.hypot(self.floor, self.share * clean)
        columns = dict(zip(("x_mm", "y_mm"), location[rows].T, strict=False))
        if measured:
            # The force sensor is read with each sample: equal loads in all rows would count as one reading.
            columns["load"] = load[rows] * (1 + 1e-9 * np.tile(np.arange(samples), n))
        return touches_from(
            rows,
            self.chain.offset + clean + sd * rng.standard_normal(clean.shape),
            sample=np.tile(np.arange(samples), n),
            **columns,
        )

    def dataset(self, calibration: Touches, touches: Touches | None = None) -> DataSet:
        """A data set of it."""
        return DataSet(self.sensor, calibration, calibration if touches is None else touches)


def line(kernel: Kernel | None = None, values: tuple[float, ...] = (2.5,), **changes: float) -> SimulatedPad:
    """Four elements 6 mm apart; the stage's origin is 10 mm off and elements are off their places."""
    nominal = np.array([0.0, 6.0, 12.0, 18.0])[:, None]
    true = nominal + 10 + np.array([0.3, -0.2, 0.1, 0.4])[:, None]
    gain, offset = np.array([10.0, 12.0, 14.0, 16.0]), np.array([0.5, -0.2, 0.0, 0.1])
    chain = PadChain(kernel or GaussianKernel(6.0), np.array(values), gain, offset, true)
    settings = {"floor": 0.05, "share": 0.01, "load_spread": 0.02} | changes
    return SimulatedPad(chain, nominal, **settings)


def square(kernel: Kernel | None = None, values: tuple[float, ...] = (2.5,), **changes: float) -> SimulatedPad:
    """Two by two elements 6 mm apart in the plane, the stage's origin off by (8, 5) mm."""
    nominal = np.array([[0.0, 0.0], [6.0, 0.0], [0.0, 6.0], [6.0, 6.0]])
    true = nominal + np.array([8.0, 5.0]) + np.array([[0.2, 0.1], [-0.3, 0.2], [0.1, -0.2], [0.0, 0.3]])
    chain = PadChain(
        kernel or GaussianKernel(6.0), np.array(values), np.array([1.0, 1.2, 0.8, 1.1]), 0.01 * np.arange(4), true
    )
    return SimulatedPad(chain, nominal, **changes)


def grid(low: float, high: float, n: int, dimensions: int) -> np.ndarray:
    """Regular locations in a box, (n**dimensions, dimensions)."""
    axis = np.linspace(low, high, n)
    return np.stack(np.meshgrid(*[axis] * dimensions, indexing="ij"), axis=-1).reshape(-1, dimensions)


def flattened(load: np.ndarray) -> np.ndarray:
    """Acting loads under a skin that carries 0.3 N before it touches, with a response that then flattens."""
    reached = np.maximum(load - 0.3, 0.0)
    return np.asarray(reached / (1 + 0.2 * reached))


def uneven(seed: int, *, touches: int = 120, samples: int = 3) -> DataSet:
    """A sound pad of five elements in a line, 8 mm apart, each with a width and a skewness of its own.

    No kernel that the elements share describes it, but a map does. Touches are in random order, under loads from 0.5 to
    4 N that a force sensor measures. Readings have a noise of 0.003, where the peaks are about 4.
    """
    rng, m = np.random.default_rng(seed), 5
    place = 8.0 * np.arange(m)
    width, skew = 6 * np.exp(0.12 * rng.standard_normal(m)), 0.1 * rng.standard_normal(m)
    gain, base = np.exp(0.15 * rng.standard_normal(m)), rng.uniform(2, 3, m)
    x, load = rng.uniform(-5, 37, touches), np.exp(rng.uniform(np.log(0.5), np.log(4), touches))
    u = (x[:, None] - place) / width
    shape = (1 + skew * u / (1 + u**2)) / (1 + u**2) ** 1.7 - 0.08 * u**2 / (1 + u**2) ** 3
    rows = np.repeat(np.arange(touches), samples)
    table = touches_from(
        rows,
        (base + load[:, None] * gain * shape)[rows] + 0.003 * rng.standard_normal((len(rows), m)),
        sample=np.tile(np.arange(samples), touches),
        x_mm=x[rows],
        load=load[rows] + 0.01 * rng.standard_normal(len(rows)),
    )
    body = Pad(tuple(place))
    sensor = Sensor(name="uneven pad", body=body, reading_unit="V", force_noise_sd=0.01, source={"note": "simulated"})
    return DataSet(sensor, None, table)


@cache
def flattening() -> tuple[SimulatedPad, Calibration]:
    """A pad with `flattened` loads, and its calibration, which has the effect; loads from 0.5 to 4 N."""
    rng, pad = np.random.default_rng(6), line()
    place, load = rng.uniform(7.0, 31.0, (200, 1)), rng.uniform(0.5, 4.0, 200)
    table = pad.touch(place, rng, load=load, measured=True, acting=flattened(load), samples=4)
    table = table.with_(load=table.load + FORCE_NOISE * rng.standard_normal(table.n_rows))
    dataset = replace(pad.dataset(table), sensor=replace(pad.sensor, force_noise_sd=FORCE_NOISE))
    model = StatedModel("pad", "", (("load_nonlinearity", {}),))
    return pad, bayestouch.calibrate(dataset, kernel="gaussian", model=model, draws=200)
