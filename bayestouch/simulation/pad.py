"""A simulated pad: sensor as built, plan of touches, body.

The response is the kernel of the bonded layer (`bayestouch.body.layer.layer_kernel_2d`) at the distance
between touch and element, times the load; contact is a disc of constant radius.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.data.sensor import Pad, Rubber, Sensor
from bayestouch.simulation.designs import PadDesign
from bayestouch.simulation.recording import Plan, SimulatedRecording


@dataclass(frozen=True, eq=False)
class BuiltPad:
    """A pad as it came out of the mould.

    Attributes
    ----------
    design : PadDesign
        What it should have been.
    place : tuple of (m,) arrays
        True places of the elements, mm: x, and y in two dimensions.
    gain : (m,) array
        Reading per MPa of mean stress, compression positive.
    """

    design: PadDesign
    place: tuple[FloatArray, ...]
    gain: FloatArray

    @classmethod
    def of(cls, design: PadDesign, rng: np.random.Generator) -> BuiltPad:
        """Draw places and gains."""
        m = len(design.element_x_mm)
        place = tuple(axis + design.position_error_mm * rng.standard_normal(m) for axis in _axes(design))
        nominal = cls(design, place, np.ones(m))
        gain = design.peak_reading / (nominal.response * nominal.reference_load)
        return cls(design, place, gain * np.exp(design.gain_spread * rng.standard_normal(m)))

    @cached_property
    def response(self) -> FloatArray:
        """Reading per N right above each element, shape (m,)."""
        return self.gain * self._stress(np.zeros(1))

    @property
    def reference_load(self) -> float:
        """Middle of the load range, N."""
        return float(np.mean(self.design.load_range))

    def press(self, recording: SimulatedRecording) -> SimulatedRecording:
        """Body and gain: the signal, without noise."""
        axes = zip(recording.place, self.place, strict=True)
        distance = np.sqrt(sum((touch[:, None] - element) ** 2 for touch, element in axes))
        return replace(recording, signal=recording.load[:, None] * self.gain * self._stress(distance))

    def _stress(self, distance_mm: FloatArray) -> FloatArray:
        """Mean stress at the base of the layer at a distance from a load, MPa per N."""
        from bayestouch.body.layer import layer_kernel_2d

        return layer_kernel_2d(
            distance_mm,
            self.design.thickness_mm,
            self.design.poisson_ratio,
            indenter_radius_mm=self.design.contact_radius_mm,
            quantity="mean_stress",
        )

    def sensor(self, source: dict[str, str]) -> Sensor:
        """The sensor as it was designed."""
        design = self.design
        return Sensor(
            name="simulated pad",
            body=Pad(design.element_x_mm, design.element_y_mm, design.thickness_mm, design.thickness_mm),
            rubber=Rubber(None, design.poisson_ratio),
            force_noise_sd=design.force_noise_sd or None,
            reading_unit="counts",
            reading_quantity="pressure (simulated)",
            source=source,
        )

    def truth(self) -> dict[str, Any]:
        """True calibration parameters, ready for JSON."""
        places = {name: axis.tolist() for name, axis in zip("xy", self.place, strict=False)}
        return places | {"gain": self.gain.tolist(), "response": self.response.tolist()}


def plan_touches(design: PadDesign, rng: np.random.Generator) -> Plan:
    """A grid to calibrate, then places at random over the same area; loads at random."""
    ends = [(axis.min() - design.margin_mm, axis.max() + design.margin_mm) for axis in _axes(design)]
    lines = [np.arange(low, high + 1e-9, design.calibration_step_mm) for low, high in ends]
    grid = [axis.ravel() for axis in np.meshgrid(*lines, indexing="ij")]
    reads = [rng.uniform(low, high, design.n_touches) for low, high in ends]
    n = len(grid[0]) + design.n_touches
    return Plan(
        indenter_radius_mm=np.full(n, np.nan),
        place=tuple(np.concatenate(pair) for pair in zip(grid, reads, strict=True)),
        load=rng.uniform(*design.load_range, size=n),
        n_calibration=len(grid[0]),
        samples=design.samples_per_touch,
    )


def _axes(design: PadDesign) -> list[FloatArray]:
    axes = [design.element_x_mm] + ([] if design.element_y_mm is None else [design.element_y_mm])
    return [np.asarray(axis, dtype=float) for axis in axes]
