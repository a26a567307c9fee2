"""A recording on its way through the chain: what the stages and the effects pass on to each other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.data.sensor import Sensor
from bayestouch.data.touches import Touches, touches_from

SAMPLE_INTERVAL_S = 0.25
LIFT_INTERVAL_S = 4.0
"""From the last sample of a touch to the first of the next, on top of a sample's interval."""


@dataclass(frozen=True, eq=False)
class SimulatedRecording:
    """Every sample of every touch, calibration first; n rows, m elements.

    Attributes
    ----------
    touch, sample : (n,) int arrays
        Number of the touch, counted over the whole recording, and of the sample within it.
    time_s : (n,) array
        When taken.
    indenter_radius_mm : (n,) array
        True r_c; on a pad NaN.
    place : tuple of (n,) arrays
        True location: θ_c in degree on a finger; x and, in two dimensions, y in mm on a pad.
    load : (n,) array
        True load, N/m or N.
    load_reading : (n,) array
        What the force sensor reads.
    element_place : tuple of (m,) arrays
        True places of the elements, as `place`.
    peak : (m,) array
        Reading of each element right under the reference load.
    signal : (n, m) array
        Reading so far; zero before the body stage.
    aperture_mm : float
        Width of the elements along the line they lie on.
    """

    touch: IntArray
    sample: IntArray
    time_s: FloatArray
    indenter_radius_mm: FloatArray
    place: tuple[FloatArray, ...]
    load: FloatArray
    load_reading: FloatArray
    element_place: tuple[FloatArray, ...]
    peak: FloatArray
    signal: FloatArray
    aperture_mm: float = 0.0

    @property
    def held_s(self) -> FloatArray:
        """Time since the first sample of the touch, shape (n,)."""
        return np.asarray(self.sample * SAMPLE_INTERVAL_S)

    @property
    def angle_deg(self) -> FloatArray:
        """Location θ_c on a finger, degree, shape (n,)."""
        return self.place[0]


class Built(Protocol):
    """A sensor as it came out of the mould: what a body offers to the simulation."""

    @property
    def place(self) -> tuple[FloatArray, ...]:
        """True places of the elements in the unit of the touch table (degree or mm), (m,) arrays."""
        ...

    @property
    def response(self) -> FloatArray:
        """Reading per unit of load right above each element, shape (m,)."""
        ...

    @property
    def reference_load(self) -> float:
        """Load to which peak readings and noise refer, N/m or N."""
        ...

    def press(self, recording: SimulatedRecording) -> SimulatedRecording:
        """Contact, body and gain: the signal, without noise."""
        ...

    def sensor(self, source: dict[str, str]) -> Sensor:
        """The sensor as it was designed."""
        ...

    def truth(self) -> dict[str, Any]:
        """True calibration parameters, ready for JSON."""
        ...


@dataclass(frozen=True, eq=False)
class Plan:
    """Touches as commanded, one row a touch; the first `n_calibration` calibrate.

    Attributes
    ----------
    indenter_radius_mm, load : (t,) arrays
        r_c (NaN on a pad) and true load.
    place : tuple of (t,) arrays
        Commanded location, in the unit of the touch table (degree or mm).
    n_calibration, samples : int
        Calibration touches; samples a touch.
    """

    indenter_radius_mm: FloatArray
    place: tuple[FloatArray, ...]
    load: FloatArray
    n_calibration: int
    samples: int

    @property
    def n_rows(self) -> int:
        """Samples of the whole recording."""
        return len(self.load) * self.samples

    @property
    def touch(self) -> IntArray:
        """Number of the touch of every row, shape (t * samples,)."""
        return np.repeat(np.arange(len(self.load)), self.samples)

    @property
    def sample(self) -> IntArray:
        """Number of the sample of every row."""
        return np.tile(np.arange(self.samples), len(self.load))

    @property
    def time_s(self) -> FloatArray:
        """Time of every row, s."""
        cycle = self.samples * SAMPLE_INTERVAL_S + LIFT_INTERVAL_S
        return self.touch * cycle + self.sample * SAMPLE_INTERVAL_S

    def start(self, sensor: Built) -> SimulatedRecording:
        """Recording of this plan before the first stage."""
        load = np.repeat(self.load, self.samples)
        return SimulatedRecording(
            touch=self.touch,
            sample=self.sample,
            time_s=self.time_s,
            indenter_radius_mm=np.repeat(self.indenter_radius_mm, self.samples),
            place=tuple(np.repeat(axis, self.samples) for axis in self.place),
            load=load,
            load_reading=load,
            element_place=sensor.place,
            peak=sensor.response * sensor.reference_load,
            signal=np.zeros((len(load), len(sensor.response))),
        )

    def tables(self, recording: SimulatedRecording, columns: tuple[str, ...]) -> tuple[Touches, Touches]:
        """Touch tables of calibration and of touches to be read: commanded places, read loads, signals."""
        rows = recording.touch
        split = self.n_calibration
        tables = []
        for mask, first in ((rows < split, 0), (rows >= split, split)):
            tables.append(
                touches_from(
                    rows[mask] - first,
                    recording.signal[mask],
                    sample=recording.sample[mask],
                    time_s=recording.time_s[mask],
                    indenter_radius_mm=self.indenter_radius_mm[rows[mask]],
                    load=recording.load_reading[mask],
                    **{name: axis[rows[mask]] for name, axis in zip(columns, self.place, strict=True)},
                )
            )
        return tables[0], tables[1]

    def true_touches(self, recording: SimulatedRecording, names: tuple[str, ...]) -> dict[str, dict[str, list[float]]]:
        """True location and load of every touch, by table and name."""
        first = recording.sample == 0
        columns = dict(zip(names, recording.place, strict=False)) | {"P": recording.load}
        split = self.n_calibration
        return {
            table: {name: values[first][part].tolist() for name, values in columns.items()}
            for table, part in (("calibration", slice(None, split)), ("touches", slice(split, None)))
        }
