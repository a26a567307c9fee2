"""What to simulate: a sensor, how well it is built, and where it is touched."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.errors import InputError
from bayestouch.output.summary import Summarised
from bayestouch.paper.published import TABLE_3

#: Line load (N/m) of the paper's touches: a finger's peak reading and its noise in % of peak refer to it.
REFERENCE_LOAD = 200.0


@dataclass(frozen=True, repr=False)
class FingerDesign(Summarised):
    """A cylindrical finger and the touches made on it; by default the paper's finger and the paper's touches.

    Attributes
    ----------
    core_radius_mm, sensing_radius_mm, outer_radius_mm : float
        ``r_a``, ``r_s`` as designed, ``r_b``.
    n_elements : int
        Elements, centred on 0°.
    pitch_deg : float
        Angle between neighbours: 1.52 mm at 9.9 mm.
    depth_spread_mm, angle_error_deg : float
        Standard deviation of the true ``r_s`` and ``θ_s`` about the design.
    shear_modulus_MPa, poisson_ratio : float
        μ (not printed in the paper) and σ.
    peak_reading : float
        Reading of an element built as designed under a knife edge of 200 N/m right above it.
    gain_spread : float
        Standard deviation of the logarithm of the gains.
    noise_percent_peak : float
        Noise of one reading in % of `peak_reading`; the same number of counts for every element, so that its
        share of an element's own peak varies with the gain, as in Table 1.
    force_noise_sd : float
        Noise of one load reading, N/m: 0.5 % of 200 N/m.
    samples_per_touch : int
        Samples a touch.
    calibration_span_deg, edge_step_deg, flat_step_deg : float
        Calibration touches reach from minus to plus the span: knife edges and flats at these steps.
    touch_radii_mm : tuple of float
        Indenter radii r_c of the touches to be read (0 a knife edge, inf a flat); those of Table 3.
    touch_span_deg, touch_step_deg : float
        Their locations, from minus to plus the span.
    load_range : (float, float)
        True loads are uniform between these, N/m.
    contact : str
        Contact model, see `bayestouch.contact.contact_model`.
    """

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
        _check_counts(n_elements=self.n_elements, samples_per_touch=self.samples_per_touch)
        _check_positive(
            pitch_deg=self.pitch_deg,
            shear_modulus_MPa=self.shear_modulus_MPa,
            peak_reading=self.peak_reading,
            edge_step_deg=self.edge_step_deg,
            flat_step_deg=self.flat_step_deg,
            touch_step_deg=self.touch_step_deg,
            lowest_load=self.load_range[0],
        )
        _check_not_negative(
            depth_spread_mm=self.depth_spread_mm,
            angle_error_deg=self.angle_error_deg,
            gain_spread=self.gain_spread,
            noise_percent_peak=self.noise_percent_peak,
            force_noise_sd=self.force_noise_sd,
            calibration_span_deg=self.calibration_span_deg,
            touch_span_deg=self.touch_span_deg,
        )
        _check_range(self.load_range)
        if not self.touch_radii_mm or not all(radius >= 0 for radius in self.touch_radii_mm):
            raise InputError("touch_radii_mm: expected radii of zero and larger, and at least one")

    @property
    def element_angles_deg(self) -> FloatArray:
        """Design angles θ_s, shape (n_elements,)."""
        return np.asarray((np.arange(self.n_elements) - (self.n_elements - 1) / 2) * self.pitch_deg)


@dataclass(frozen=True, repr=False)
class PadDesign(Summarised):
    """A flat pad of rubber on a board with pressure sensors, touched by a probe of constant contact size.

    Attributes
    ----------
    element_x_mm : tuple of float
        Places of the elements; by default two rows of four at the pitch of 6.75 mm.
    element_y_mm : tuple of float or None
        None for a line of elements, touched along the line.
    thickness_mm : float
        Layer thickness; the elements lie at its base.
    poisson_ratio : float
        σ.
    contact_radius_mm : float
        Radius of the disc over which the load is spread (Hertz pressure).
    peak_reading : float
        Reading right under the middle of the load range, at nominal gain.
    gain_spread, noise_percent_peak, samples_per_touch
        As in `FingerDesign`.
    position_error_mm : float
        Standard deviation of the true places of the elements about the design.
    force_noise_sd : float
        Noise of one load reading, N.
    margin_mm, calibration_step_mm : float
        Calibration touches lie on a grid that reaches this far beyond the elements, at this step.
    n_touches : int
        Touches to be read, uniformly at random over the same area.
    load_range : (float, float)
        True loads are uniform between these, N.
    """

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
        _check_counts(
            n_elements=len(self.element_x_mm),
            samples_per_touch=self.samples_per_touch,
            n_touches=self.n_touches,
        )
        _check_positive(
            thickness_mm=self.thickness_mm,
            peak_reading=self.peak_reading,
            calibration_step_mm=self.calibration_step_mm,
            lowest_load=self.load_range[0],
        )
        _check_not_negative(
            contact_radius_mm=self.contact_radius_mm,
            gain_spread=self.gain_spread,
            position_error_mm=self.position_error_mm,
            noise_percent_peak=self.noise_percent_peak,
            force_noise_sd=self.force_noise_sd,
            margin_mm=self.margin_mm,
        )
        _check_range(self.load_range)


def _check_counts(**values: int) -> None:
    for name, value in values.items():
        if value < 1 or value != int(value):
            raise InputError(f"{name}: expected a whole number above zero, got {value}")


def _check_positive(**values: float) -> None:
    for name, value in values.items():
        if not 0 < value < np.inf:
            raise InputError(f"{name}: expected a finite number above zero, got {value:g}")


def _check_not_negative(**values: float) -> None:
    for name, value in values.items():
        if not 0 <= value < np.inf:
            raise InputError(f"{name}: expected a finite number, zero or larger, got {value:g}")


def _check_range(load_range: tuple[float, float]) -> None:
    if not load_range[0] <= load_range[1] < np.inf:
        raise InputError(f"load_range: expected two finite loads in order, got {load_range}")
