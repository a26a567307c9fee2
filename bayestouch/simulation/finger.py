"""A simulated finger: sensor as built, plan of touches, contact and body.

The strain is the sum of the Fourier series itself at every touch, not the interpolated response table with
which the package calibrates and infers. Summed half as far again as the table's modes it is off by less than
1e-8 of the peak; the contact's own approximation (8 terms) is within 1e-5 of it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.body.annulus import solve_annulus
from bayestouch.chain.response import modes_needed
from bayestouch.contact import composite_radius, contact_model
from bayestouch.data.sensor import Finger, Rubber, Sensor
from bayestouch.simulation.designs import REFERENCE_LOAD, FingerDesign
from bayestouch.simulation.recording import Plan, SimulatedRecording


@dataclass(frozen=True, eq=False)
class BuiltFinger:
    """A finger as it came out of the mould.

    Attributes
    ----------
    design : FingerDesign
        What it should have been.
    sensing_radius_mm, angle_deg, gain : (m,) arrays
        True ``r_s``, ``θ_s`` and reading per unit of compressive strain.
    """

    design: FingerDesign
    sensing_radius_mm: FloatArray
    angle_deg: FloatArray
    gain: FloatArray
    reference_load: float = REFERENCE_LOAD

    @classmethod
    def of(cls, design: FingerDesign, rng: np.random.Generator) -> BuiltFinger:
        """Draw depths, angles and gains."""
        m = design.n_elements
        nominal = cls(design, np.full(1, design.sensing_radius_mm), np.zeros(1), np.ones(1))
        depth = design.sensing_radius_mm + design.depth_spread_mm * rng.standard_normal(m)
        # An element cannot lie in the core or stick out, whatever the spread.
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

    @cached_property
    def response(self) -> FloatArray:
        """Reading per N/m of a knife edge right above each element, shape (m,)."""
        edges = np.zeros_like(self.angle_deg)
        return np.asarray(self.gain * np.diagonal(self.strain(edges, self.angle_deg, edges + 1)))

    def strain(
        self,
        indenter_radius_mm: FloatArray,
        angle_deg: FloatArray,
        load: FloatArray,
        aperture_mm: float = 0.0,
    ) -> FloatArray:
        """Compressive strain at the elements.

        Parameters
        ----------
        indenter_radius_mm, angle_deg, load : (t,) arrays
            r_c (mm), θ_c (degree), P (N/m).
        aperture_mm : float
            Width over which each element averages, along the arc at its own radius.

        Returns
        -------
        (t, m) array
        """
        design = self.design
        radii = (design.core_radius_mm, design.outer_radius_mm)
        modes = np.arange(1.5 * modes_needed(float(self.sensing_radius_mm.max()), radii[1]))
        body = solve_annulus(
            modes, core_radius_mm=radii[0], outer_radius_mm=radii[1], poisson_ratio=design.poisson_ratio
        )
        kappa = load / 1000 * composite_radius(indenter_radius_mm, radii[1]) / design.shear_modulus_MPa
        if kappa.any():
            spectrum = contact_model(design.contact, radii, design.poisson_ratio).spectrum(kappa, modes)
        else:  # knife edges need no contact solved
            spectrum = np.ones((len(kappa), len(modes)))
        weights = np.where(modes == 0, 1.0, 2.0) * body.radial_strain(self.sensing_radius_mm)
        # The mean of cos kθ over a width w is cos kθ times sin(kw/2)/(kw/2).
        weights = weights * np.sinc(modes * (aperture_mm / self.sensing_radius_mm[:, None]) / (2 * np.pi))
        # cos k(θ_s - θ_c) in two products, so that no (touch, element, mode) array is needed.
        touch, element = np.outer(np.radians(angle_deg), modes), np.outer(np.radians(self.angle_deg), modes)
        series = (spectrum * np.cos(touch)) @ (weights * np.cos(element)).T
        series += (spectrum * np.sin(touch)) @ (weights * np.sin(element)).T
        scale = load / 1000 / design.shear_modulus_MPa / (2 * np.pi * radii[1])
        return np.asarray(scale[:, None] * series)

    def press(self, recording: SimulatedRecording) -> SimulatedRecording:
        """Contact, body and gain: the signal, without noise. Equal touches are worked out once."""
        touches = np.stack([recording.indenter_radius_mm, recording.angle_deg, recording.load], axis=1)
        distinct, row = np.unique(touches, axis=0, return_inverse=True)
        radius, angle, load = distinct.T
        strain = self.strain(radius, angle, load, recording.aperture_mm)
        return replace(recording, signal=(self.gain * strain)[row.ravel()])

    def sensor(self, source: dict[str, str]) -> Sensor:
        """The sensor as it was designed."""
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


def plan_touches(design: FingerDesign, rng: np.random.Generator) -> Plan:
    """Edges and flats to calibrate, then every radius at every location; loads at random."""
    edges = _locations(design.calibration_span_deg, design.edge_step_deg)
    flats = _locations(design.calibration_span_deg, design.flat_step_deg)
    reads = _locations(design.touch_span_deg, design.touch_step_deg)
    radii = np.asarray(design.touch_radii_mm, dtype=float)
    angle = np.concatenate([edges, flats, np.tile(reads, len(radii))])
    return Plan(
        indenter_radius_mm=np.concatenate(
            [np.zeros(len(edges)), np.full(len(flats), np.inf), np.repeat(radii, len(reads))]
        ),
        place=(angle,),
        load=rng.uniform(*design.load_range, size=len(angle)),
        n_calibration=len(edges) + len(flats),
        samples=design.samples_per_touch,
    )


def _locations(span: float, step: float) -> FloatArray:
    half = np.floor(span / step + 1e-9)
    return np.asarray(np.arange(-half, half + 1) * step)
