"""Parts of a simulation: a design, the sensor built from it, and the plan of touches."""

from __future__ import annotations

from dataclasses import Field, dataclass
from typing import Any, ClassVar, Protocol, Self

import numpy as np

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.chain.recording import Recording
from bayestouch.data.sensor import Sensor
from bayestouch.data.touches import Touches, touches_from
from bayestouch.effects import Effect, Setting, Values

#: Effects with the values of their parameters, in the order in which they act.
EffectValues = tuple[tuple[Effect, Values], ...]

SAMPLE_INTERVAL_S = 0.25
LIFT_INTERVAL_S = 4.0
"""Time from the last sample of a touch to the first of the next, in addition to a sample interval."""


class Built(Protocol):
    """A simulated sensor with its true properties, as each body implements it."""

    location_names: ClassVar[tuple[str, ...]]
    """Coordinates of a touch, with the names that posteriors use."""

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

    def setting(self, plan: Plan) -> Setting:
        """What effects need about sensor and touches."""
        ...

    def with_effects(self, effects: EffectValues) -> Self:
        """The same sensor with effects on its body."""
        ...

    def press(self, recording: Recording) -> FloatArray:
        """Readings (n, m) from contact, body and gain, without noise."""
        ...

    def sensor(self, source: dict[str, str]) -> Sensor:
        """Description of the sensor as designed."""
        ...

    def truth(self) -> dict[str, Any]:
        """True calibration parameters, ready for JSON."""
        ...


class Design(Protocol):
    """Design of a sensor with any body, and of its touches: a dataclass."""

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]

    @property
    def peak_reading(self) -> float:
        """Reading of an element built as designed, right under the reference load."""
        ...

    @property
    def noise_percent_peak(self) -> float:
        """Noise of one reading in % of `peak_reading`."""
        ...

    @property
    def force_noise_sd(self) -> float:
        """Noise of one load reading, N/m or N."""
        ...

    def build(self, rng: np.random.Generator) -> Built:
        """A sensor with random deviations from the design."""
        ...

    def plan(self, rng: np.random.Generator) -> Plan:
        """Touches for the calibration and touches to be inferred; loads are random."""
        ...


@dataclass(frozen=True, eq=False)
class Plan:
    """Commanded touches, one row a touch; the first `n_calibration` are for the calibration.

    Attributes
    ----------
    indenter_radius_mm, load : (t,) arrays
        r_c (NaN on a pad), and load as measured by the force sensor, without its noise.
    place : tuple of (t,) arrays
        Commanded location, in the unit of the touch table (degree or mm).
    n_calibration, samples : int
        Number of calibration touches; number of samples of a touch.
    """

    indenter_radius_mm: FloatArray
    place: tuple[FloatArray, ...]
    load: FloatArray
    n_calibration: int
    samples: int

    @property
    def n_rows(self) -> int:
        """Number of samples of the whole recording."""
        return len(self.load) * self.samples

    @property
    def touch(self) -> IntArray:
        """Number of the touch in every row, shape (t * samples,)."""
        return np.repeat(np.arange(len(self.load)), self.samples)

    @property
    def sample(self) -> IntArray:
        """Number of the sample in every row."""
        return np.tile(np.arange(self.samples), len(self.load))

    @property
    def time_s(self) -> FloatArray:
        """Time of every row, s."""
        cycle = self.samples * SAMPLE_INTERVAL_S + LIFT_INTERVAL_S
        return self.touch * cycle + self.sample * SAMPLE_INTERVAL_S

    def rows(self, values: FloatArray) -> FloatArray:
        """Values by touch (t, ...) as values by row (t * samples, ...)."""
        return np.asarray(np.repeat(values, self.samples, axis=0))

    def setting(
        self,
        element_place: tuple[FloatArray, ...],
        reference_load: float,
        load_unit: str,
        *,
        finger: bool = False,
        contact: str = "",
        radii_mm: tuple[float, float] = (0.0, 0.0),
    ) -> Setting:
        """What effects need about sensor and touches; the parameters have the names of `Setting`.

        `contact` and `radii_mm` are those of a finger.
        """
        return Setting(
            finger=finger,
            n_elements=len(element_place[0]),
            element_place=element_place,
            place_range=tuple((float(axis.min()), float(axis.max())) for axis in self.place),
            reference_load=reference_load,
            load_unit=load_unit,
            contact=contact,
            has_edges=bool((self.indenter_radius_mm == 0).any()),
            hold_s=(self.samples - 1) * SAMPLE_INTERVAL_S,
            gap_s=LIFT_INTERVAL_S + SAMPLE_INTERVAL_S,
            span_s=float(self.time_s[-1] - self.time_s[0]),
            radii_mm=radii_mm,
            any_rest=False,
        )

    def commanded(self, sensor: Built) -> Recording:
        """Every sample of every touch as commanded and measured, before any effect acts."""
        return Recording(
            indenter_radius_mm=self.rows(self.indenter_radius_mm),
            place=tuple(self.rows(axis) for axis in self.place),
            load=self.rows(self.load),
            time_s=self.time_s,
            held_s=np.asarray(self.sample * SAMPLE_INTERVAL_S),
            element_place=sensor.place,
            peak=sensor.response * sensor.reference_load,
            reference_load=sensor.reference_load,
            signal=np.zeros((self.n_rows, len(sensor.response))),
        )

    def tables(self, readings: FloatArray, load: FloatArray, columns: tuple[str, ...]) -> tuple[Touches, Touches]:
        """Tables of calibration touches and of touches to infer: commanded places, loads (n,), readings (n, m)."""
        rows = self.touch
        split = self.n_calibration
        tables = []
        for mask, first in ((rows < split, 0), (rows >= split, split)):
            tables.append(
                touches_from(
                    rows[mask] - first,
                    readings[mask],
                    sample=self.sample[mask],
                    time_s=self.time_s[mask],
                    indenter_radius_mm=self.indenter_radius_mm[rows[mask]],
                    load=load[mask],
                    **{name: axis[rows[mask]] for name, axis in zip(columns, self.place, strict=True)},
                )
            )
        return tables[0], tables[1]

    def true_touches(self, true: Recording, names: tuple[str, ...]) -> dict[str, dict[str, list[float]]]:
        """True location and load of every touch, by table and name."""
        first = self.sample == 0
        columns = dict(zip(names, true.place, strict=False)) | {"P": true.load}
        split = self.n_calibration
        return {
            table: {name: values[first][part].tolist() for name, values in columns.items()}
            for table, part in (("calibration", slice(None, split)), ("touches", slice(split, None)))
        }
