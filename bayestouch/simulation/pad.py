"""A simulated pad: its design, plan of touches, true sensor, body.

The response is the kernel of the bonded layer (`bayestouch.body.layer.layer_kernel_2d`) at the distance
between touch and element, times the load; contact is a disc of constant radius.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.recording import Recording
from bayestouch.data.sensor import Pad, Rubber, Sensor
from bayestouch.effects import Setting
from bayestouch.errors import InputError, number_array, require_whole
from bayestouch.output.summary import Summarised
from bayestouch.simulation.checks import check_not_negative, check_positive, check_range, check_ratio
from bayestouch.simulation.plan import EffectValues, Plan


@dataclass(frozen=True, repr=False)
class PadDesign(Summarised):
    """A flat pad of rubber on a board with pressure sensors, touched by a probe of constant contact size.

    Attributes
    ----------
    element_x_mm : tuple of float
        Places of the elements; by default two rows of four, 6.75 mm apart.
    element_y_mm : tuple of float or None
        None for a line of elements, which is touched along the line.
    thickness_mm : float
        Thickness of the layer; the elements are at its base.
    poisson_ratio : float
        Poisson's ratio σ.
    contact_radius_mm : float
        Radius of the disc over which the load is spread (Hertz pressure).
    peak_reading : float
        Reading right under a load in the middle of the load range, with nominal gain.
    gain_spread, noise_percent_peak, samples_per_touch
        As in `FingerDesign`.
    position_error_mm : float
        Standard deviation of the true places of the elements from the design.
    force_noise_sd : float
        Noise of one load reading, N.
    margin_mm, calibration_step_mm : float
        Calibration touches are on a grid with this step, which extends by the margin beyond the elements.
    n_touches : int
        Number of touches to be inferred, uniformly random over the same area.
    load_range : (float, float)
        Measured loads without noise are uniform in this range, N; without effects of the rig they are true.

    Raises
    ------
    InputError
        A number is not finite, has the wrong sign, or does not fit the others.

    Examples
    --------
    >>> import bayestouch
    >>> bayestouch.PadDesign(element_x_mm=(0.0, 6.0, 12.0), element_y_mm=None).margin_mm
    3.0
    """

    internal: ClassVar[frozenset[str]] = frozenset({"build", "plan"})

    element_x_mm: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0, 6.75, 6.75, 6.75, 6.75)
    element_y_mm: tuple[float, ...] | None = (0.0, 6.75, 13.5, 20.25, 0.0, 6.75, 13.5, 20.25)
    thickness_mm: float = 6.0
    poisson_ratio: float = 0.48
    contact_radius_mm: float = 1.0
    peak_reading: float = 1000.0
    gain_spread: float = 0.15
    position_error_mm: float = 0.05
    noise_percent_peak: float = 1.0
    force_noise_sd: float = 0.01
    samples_per_touch: int = 3
    margin_mm: float = 3.0
    calibration_step_mm: float = 1.5
    n_touches: int = 150
    load_range: tuple[float, float] = (1.0, 3.0)

    def __post_init__(self) -> None:
        axes = {"element_x_mm": number_array("element_x_mm", self.element_x_mm, 1)}
        if self.element_y_mm is not None:
            axes["element_y_mm"] = number_array("element_y_mm", self.element_y_mm, 1)
        require_whole("n_elements", len(self.element_x_mm), 1)
        require_whole("samples_per_touch", self.samples_per_touch, 1)
        require_whole("n_touches", self.n_touches, 1)
        check_positive(
            thickness_mm=self.thickness_mm,
            peak_reading=self.peak_reading,
            calibration_step_mm=self.calibration_step_mm,
        )
        check_not_negative(
            contact_radius_mm=self.contact_radius_mm,
            gain_spread=self.gain_spread,
            position_error_mm=self.position_error_mm,
            noise_percent_peak=self.noise_percent_peak,
            force_noise_sd=self.force_noise_sd,
            margin_mm=self.margin_mm,
        )
        check_ratio(self.poisson_ratio)
        check_range(self.load_range)
        for name, places in axes.items():
            if len(places) != len(self.element_x_mm) or not np.isfinite(places).all():
                raise InputError(f"{name}: expected a finite place for each of {len(self.element_x_mm)} elements")

    def build(self, rng: np.random.Generator) -> BuiltPad:
        """A pad with random places and gains of the elements."""
        return BuiltPad.of(self, rng)

    def plan(self, rng: np.random.Generator) -> Plan:
        """A grid of calibration touches, then random places over the same area; loads are random."""
        ends = [(axis.min() - self.margin_mm, axis.max() + self.margin_mm) for axis in _axes(self)]
        lines = [np.arange(low, high + 1e-9, self.calibration_step_mm) for low, high in ends]
        grid = [axis.ravel() for axis in np.meshgrid(*lines, indexing="ij")]
        reads = [rng.uniform(low, high, self.n_touches) for low, high in ends]
        n = len(grid[0]) + self.n_touches
        return Plan(
            indenter_radius_mm=np.full(n, np.nan),
            place=tuple(np.concatenate(pair) for pair in zip(grid, reads, strict=True)),
            load=rng.uniform(*self.load_range, size=n),
            n_calibration=len(grid[0]),
            samples=self.samples_per_touch,
        )


@dataclass(frozen=True, eq=False)
class BuiltPad:
    """A pad with its true dimensions and gains after manufacture.

    Attributes
    ----------
    design : PadDesign
        The design.
    place : tuple of (m,) arrays
        True places of the elements, mm: x, and y in two dimensions.
    gain : (m,) array
        Reading per MPa of mean stress, compression positive.
    """

    design: PadDesign
    place: tuple[FloatArray, ...]
    gain: FloatArray

    location_names: ClassVar[tuple[str, ...]] = ("x", "y")

    @classmethod
    def of(cls, design: PadDesign, rng: np.random.Generator) -> BuiltPad:
        """A pad with random places and gains of the elements."""
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

    def press(self, recording: Recording) -> FloatArray:
        """Readings (n, m) from body and gain, without noise."""
        axes = zip(recording.place, self.place, strict=True)
        distance = np.sqrt(sum((touch[:, None] - element) ** 2 for touch, element in axes))
        return np.asarray(recording.load[:, None] * self.gain * self._stress(distance))

    def with_effects(self, effects: EffectValues) -> BuiltPad:
        """The same pad, because no effect changes its body."""
        return self

    def setting(self, plan: Plan) -> Setting:
        """What effects need about sensor and touches."""
        return plan.setting(tuple(_axes(self.design)), self.reference_load, Pad.load_unit)

    def _stress(self, distance_mm: FloatArray) -> FloatArray:
        """Mean stress at the base of the layer at given distances from a load, MPa per N."""
        from bayestouch.body.layer import layer_kernel_2d

        return layer_kernel_2d(
            distance_mm,
            self.design.thickness_mm,
            self.design.poisson_ratio,
            indenter_radius_mm=self.design.contact_radius_mm,
            quantity="mean_stress",
        )

    def sensor(self, source: dict[str, str]) -> Sensor:
        """Description of the sensor as designed."""
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
        # the gain of a pad's calibration is the reading per N, not per MPa
        return places | {"gain": self.response.tolist(), "response": self.response.tolist()}


def _axes(design: PadDesign) -> list[FloatArray]:
    axes = [design.element_x_mm] + ([] if design.element_y_mm is None else [design.element_y_mm])
    return [np.asarray(axis, dtype=float) for axis in axes]
