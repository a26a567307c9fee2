"""A simulated finger: its design, plan of touches, true sensor, contact and body."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.finger import FingerChain
from bayestouch.chain.recording import Recording
from bayestouch.contact import CONTACT_MODELS, composite_radius
from bayestouch.data.sensor import Finger, Rubber, Sensor
from bayestouch.effects import Setting
from bayestouch.errors import InputError, number_array, require_whole, unknown_name
from bayestouch.output.summary import Summarised
from bayestouch.paper.published import TABLE_3
from bayestouch.simulation.checks import check_not_negative, check_positive, check_range, check_ratio
from bayestouch.simulation.plan import EffectValues, Plan
from bayestouch.simulation.series import summed_strain

#: Line load (N/m) of the paper's touches. The peak reading of a finger, and noise in % of it, refer to this load.
REFERENCE_LOAD = 200.0


@dataclass(frozen=True, repr=False)
class FingerDesign(Summarised):
    """A cylindrical finger and the touches made on it; by default the paper's finger and the paper's touches.

    Attributes
    ----------
    core_radius_mm, sensing_radius_mm, outer_radius_mm : float
        ``r_a``, designed ``r_s``, ``r_b``.
    n_elements : int
        Number of elements; they are centred on 0°.
    pitch_deg : float
        Angle between neighbouring elements: 1.52 mm at 9.9 mm.
    depth_spread_mm, angle_error_deg : float
        Standard deviation of the true ``r_s`` and ``θ_s`` about the design.
    shear_modulus_MPa, poisson_ratio : float
        μ (not printed in the paper) and σ.
    peak_reading : float
        Reading of an element built as designed, under a knife edge of 200 N/m right above it.
    gain_spread : float
        Standard deviation of the logarithm of the gains.
    noise_percent_peak : float
        Noise of one reading in % of `peak_reading`; the same number of counts for every element, so that its
        share of an element's own peak varies with the gain, as in Table 1.
    force_noise_sd : float
        Noise of one load reading, N/m: 0.5 % of 200 N/m.
    samples_per_touch : int
        Number of samples of a touch.
    calibration_span_deg, edge_step_deg, flat_step_deg : float
        Calibration touches range from minus to plus the span: knife edges and flats with these steps.
    touch_radii_mm : tuple of float
        Indenter radii r_c of the touches to be inferred (0 knife edge, inf flat); those of Table 3.
    touch_span_deg, touch_step_deg : float
        Locations of these touches, from minus to plus the span.
    load_range : (float, float)
        Measured loads without noise are uniform in this range, N/m; without effects of the rig they are true.
    contact : str
        Contact model, see `bayestouch.contact.contact_model`.

    Raises
    ------
    InputError
        A number is not finite, has the wrong sign, or does not fit the others; or the contact model is unknown.

    Examples
    --------
    >>> import bayestouch
    >>> bayestouch.FingerDesign(n_elements=8, touch_radii_mm=(0.0, 3.9)).touch_radii_mm
    (0.0, 3.9)
    """

    internal: ClassVar[frozenset[str]] = frozenset({"build", "plan"})

    core_radius_mm: float = 9.4
    sensing_radius_mm: float = 9.9
    outer_radius_mm: float = 12.7
    n_elements: int = 16
    pitch_deg: float = 8.8
    depth_spread_mm: float = 0.1
    angle_error_deg: float = 0.5
    shear_modulus_MPa: float = 0.15
    poisson_ratio: float = 0.46
    peak_reading: float = 1000.0
    gain_spread: float = 0.15
    noise_percent_peak: float = 1.72
    force_noise_sd: float = 1.0
    samples_per_touch: int = 20
    calibration_span_deg: float = 90.0
    edge_step_deg: float = 1.0
    flat_step_deg: float = 3.0
    touch_radii_mm: tuple[float, ...] = tuple(row.r_c for row in TABLE_3)
    touch_span_deg: float = 20.0
    touch_step_deg: float = 1.0
    load_range: tuple[float, float] = (160.0, 240.0)
    contact: str = "layer"

    def __post_init__(self) -> None:
        require_whole("n_elements", self.n_elements, 1)
        require_whole("samples_per_touch", self.samples_per_touch, 1)
        check_positive(
            core_radius_mm=self.core_radius_mm,
            sensing_radius_mm=self.sensing_radius_mm,
            outer_radius_mm=self.outer_radius_mm,
            pitch_deg=self.pitch_deg,
            shear_modulus_MPa=self.shear_modulus_MPa,
            peak_reading=self.peak_reading,
            edge_step_deg=self.edge_step_deg,
            flat_step_deg=self.flat_step_deg,
            touch_step_deg=self.touch_step_deg,
        )
        check_not_negative(
            depth_spread_mm=self.depth_spread_mm,
            angle_error_deg=self.angle_error_deg,
            gain_spread=self.gain_spread,
            noise_percent_peak=self.noise_percent_peak,
            force_noise_sd=self.force_noise_sd,
            calibration_span_deg=self.calibration_span_deg,
            touch_span_deg=self.touch_span_deg,
        )
        check_ratio(self.poisson_ratio)
        check_range(self.load_range)
        if self.contact not in CONTACT_MODELS:
            raise unknown_name("contact model", self.contact, CONTACT_MODELS)
        if not self.core_radius_mm < self.sensing_radius_mm < self.outer_radius_mm:
            radii = f"{self.core_radius_mm:g}, {self.sensing_radius_mm:g} and {self.outer_radius_mm:g} mm"
            raise InputError(f"expected core_radius_mm < sensing_radius_mm < outer_radius_mm, got {radii}")
        radii_mm = number_array("touch_radii_mm", self.touch_radii_mm, 1)
        if not len(radii_mm) or not (radii_mm >= 0).all():
            raise InputError("touch_radii_mm: expected radii of zero and larger, and at least one")

    @property
    def element_angles_deg(self) -> FloatArray:
        """Designed angles θ_s, shape (n_elements,)."""
        return np.asarray((np.arange(self.n_elements) - (self.n_elements - 1) / 2) * self.pitch_deg)

    def build(self, rng: np.random.Generator) -> BuiltFinger:
        """A finger with random depths, angles and gains."""
        return BuiltFinger.of(self, rng)

    def plan(self, rng: np.random.Generator) -> Plan:
        """Edges and flats for the calibration, then every radius at every location; loads are random."""
        edges = _locations(self.calibration_span_deg, self.edge_step_deg)
        flats = _locations(self.calibration_span_deg, self.flat_step_deg)
        reads = _locations(self.touch_span_deg, self.touch_step_deg)
        radii = np.asarray(self.touch_radii_mm, dtype=float)
        angle = np.concatenate([edges, flats, np.tile(reads, len(radii))])
        return Plan(
            indenter_radius_mm=np.concatenate(
                [np.zeros(len(edges)), np.full(len(flats), np.inf), np.repeat(radii, len(reads))]
            ),
            place=(angle,),
            load=rng.uniform(*self.load_range, size=len(angle)),
            n_calibration=len(edges) + len(flats),
            samples=self.samples_per_touch,
        )


@dataclass(frozen=True, eq=False)
class BuiltFinger:
    """A finger with its true dimensions and gains after manufacture.

    Attributes
    ----------
    design : FingerDesign
        The design.
    sensing_radius_mm, angle_deg, gain : (m,) arrays
        True ``r_s``, ``θ_s`` and reading per unit of compressive strain.
    reference_load : float
        Load to which peak readings refer, N/m.
    effects : tuple of (Effect, values)
        Effects on the finger itself. Gains of the elements stay the same if the strain changes.
    """

    design: FingerDesign
    sensing_radius_mm: FloatArray
    angle_deg: FloatArray
    gain: FloatArray
    reference_load: float = REFERENCE_LOAD
    effects: EffectValues = ()

    location_names: ClassVar[tuple[str, ...]] = ("theta_c",)

    @classmethod
    def of(cls, design: FingerDesign, rng: np.random.Generator) -> BuiltFinger:
        """A finger with random depths, angles and gains."""
        m = design.n_elements
        nominal = cls(design, np.full(1, design.sensing_radius_mm), np.zeros(1), np.ones(1))
        depth = design.sensing_radius_mm + design.depth_spread_mm * rng.standard_normal(m)
        # An element cannot be in the core or outside the rubber, whatever the spread.
        room = 0.05 * (design.outer_radius_mm - design.core_radius_mm)
        angle = design.element_angles_deg + design.angle_error_deg * rng.standard_normal(m)
        gain = design.peak_reading / (nominal.response[0] * REFERENCE_LOAD)
        return cls(
            design,
            sensing_radius_mm=np.clip(depth, design.core_radius_mm + room, design.outer_radius_mm - room),
            angle_deg=angle,
            gain=gain * np.exp(design.gain_spread * rng.standard_normal(m)),
        )

    @property
    def place(self) -> tuple[FloatArray, ...]:
        """Angles of the elements, degree."""
        return (self.angle_deg,)

    @property
    def response(self) -> FloatArray:
        """Reading per N/m under a knife edge right above each element, shape (m,), for strain linear in the load."""
        return self._chain_and_gain[0].response

    def strain(self, indenter_radius_mm: FloatArray, angle_deg: FloatArray, load: FloatArray) -> FloatArray:
        """Compressive strain (t, m), linear in the load, under touches (t,): r_c (mm), θ_c (degree), P (N/m)."""
        return summed_strain(self._chain_and_gain[0], indenter_radius_mm, np.radians(angle_deg), load)

    def press(self, recording: Recording) -> FloatArray:
        """Readings (n, m) from contact, body and gain, without noise. Equal touches are computed once."""
        touches = np.stack([recording.indenter_radius_mm, recording.place[0], recording.load], axis=1)
        distinct, row = np.unique(touches, axis=0, return_inverse=True)
        radius, angle, load = distinct.T
        chain, gain = self._chain_and_gain
        readings = chain.offset + gain * self.strain(radius, angle, load)
        if chain.finite_strain:
            composite = composite_radius(radius, chain.outer_radius_mm)
            readings += chain.beyond_linear(composite, np.radians(angle), load)
        return np.asarray(readings[row.ravel()])

    @cached_property
    def _chain_and_gain(self) -> tuple[FingerChain, FloatArray]:
        """Model of the finger with its effects, and readings per strain (m,)."""
        design = self.design
        plain = FingerChain(
            core_radius_mm=design.core_radius_mm,
            outer_radius_mm=design.outer_radius_mm,
            response=np.ones_like(self.gain),
            sensing_radius_mm=self.sensing_radius_mm,
            angle=np.radians(self.angle_deg),
            offset=np.zeros_like(self.gain),
            poisson_ratio=design.poisson_ratio,
            shear_modulus_MPa=design.shear_modulus_MPa,
            largest_load=design.load_range[1],
            contact=design.contact,
        )
        chain = plain = plain.with_(response=self.gain * _peak_strain(plain))
        for effect, values in self.effects:
            chain = effect.finger(chain, values)
        # A change of the responses by an effect is a change of the gains; effects such as aperture keep them.
        gain = self.gain * (chain.response / plain.response)
        return chain.with_(response=gain * _peak_strain(chain)), gain

    def with_effects(self, effects: EffectValues) -> BuiltFinger:
        """The same finger with effects on the body itself."""
        return replace(self, effects=effects)

    def setting(self, plan: Plan) -> Setting:
        """What effects need about sensor and touches."""
        design = self.design
        return plan.setting(
            (design.element_angles_deg,),
            self.reference_load,
            Finger.load_unit,
            finger=True,
            contact=design.contact,
            radii_mm=(design.core_radius_mm, design.outer_radius_mm),
        )

    def sensor(self, source: dict[str, str]) -> Sensor:
        """Description of the sensor as designed."""
        design = self.design
        return Sensor(
            name="simulated finger",
            body=Finger(
                core_radius_mm=design.core_radius_mm,
                outer_radius_mm=design.outer_radius_mm,
                sensing_radius_mm=design.sensing_radius_mm,
                element_angles_deg=tuple(np.round(design.element_angles_deg, 9).tolist()),
            ),
            rubber=Rubber(design.shear_modulus_MPa, design.poisson_ratio),
            force_noise_sd=design.force_noise_sd or None,
            reading_unit="counts",
            reading_quantity="radial strain (simulated)",
            source=source,
        )

    def truth(self) -> dict[str, Any]:
        """True calibration parameters, ready for JSON."""
        return {
            "sigma": self.design.poisson_ratio,
            "mu": self.design.shear_modulus_MPa,
            "r_s": self.sensing_radius_mm.tolist(),
            "theta_s": self.angle_deg.tolist(),
            "gain": self.gain.tolist(),
            "response": self.response.tolist(),
        }


def _peak_strain(chain: FingerChain) -> FloatArray:
    """Compressive strain of each element under a knife edge of 1 N/m right above it, (m,)."""
    edges = np.zeros(chain.n_elements)
    return np.asarray(np.diagonal(summed_strain(chain, edges, chain.angle, edges + 1)))


def _locations(span: float, step: float) -> FloatArray:
    half = np.floor(span / step + 1e-9)
    return np.asarray(np.arange(-half, half + 1) * step)
