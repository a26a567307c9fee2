"""What presses on the paper's finger and what its elements then read: the layer's contact, and effects beyond it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from bayestouch.body.annulus import solve_annulus
from bayestouch.body.finite_strain import FiniteStrainResponse, FiniteStrainTable, Measure
from bayestouch.contact import LayerContact, composite_radius
from bayestouch.contact.compliance import SurfaceCompliance
from bayestouch.paper.published import TABLE_1, number
from bayestouch.simulation import FingerDesign
from bayestouch.simulation.finger import REFERENCE_LOAD
from nicolson_fearing.finite_length import length_ratio_of_compliance, length_ratio_of_strain

FloatArray = NDArray[np.float64]

N_MODES = 110
COMPLIANCE_MODES = 1200  # a finite length changes mode k by a share of order 1/k


@dataclass(frozen=True)
class Physics:
    """How the finger is made and what is true of its contacts; by default linear, long indenters and ideal edges.

    Attributes
    ----------
    sensing_radius_mm, poisson_ratio : float
        r_s as built and σ; the averages fitted in Table 1 unless told otherwise.
    finite_strain : float
        Share of `bayestouch.body.finite_strain` that is added: 0 linear, 1 neo-Hookean.
    measure : {"projected", "stretch", "stuck"}
        What the elements read, or projected strain under tips that stick.
    length_mm : float
        Length of the indenters and the elements along the axis; inf is plane strain, the paper's tips have 4 mm.
    edge_radius_mm : float
        Radius of the edges that calibrate, which the authors take for ideal.
    location_error_deg : float
        Standard deviation of the prober's error in each edge's location.
    noisy : bool
        With noise of both sensors and model error.
    """

    sensing_radius_mm: float = TABLE_1[1].average
    poisson_ratio: float = TABLE_1[0].average
    finite_strain: float = 0.0
    measure: Measure = "projected"
    length_mm: float = float(np.inf)
    edge_radius_mm: float = 0.0
    location_error_deg: float = 0.0
    noisy: bool = True

    @property
    def linear_in_load(self) -> bool:
        """Whether the edges' readings are the same at every modulus, but for the gain."""
        return self.finite_strain == 0 and self.edge_radius_mm == 0


LINEAR = Physics()
#: The sensing radius that was built, and the indenters' length.
BUILT_RADIUS_MM = number("sensing_radius").value
TIP_LENGTH_MM = number("tips.length").value


@dataclass(frozen=True, eq=False)
class TrueFinger:
    """A finger with its elements as they came out, at one modulus.

    Attributes
    ----------
    physics : Physics
        What is true.
    design : FingerDesign
        The paper's finger; its spreads of depth, angle and gain.
    shear_modulus_MPa : float
        μ.
    sensing_radius_mm, angle_deg, gain_factor : (m,) arrays
        Of the elements as built.
    """

    physics: Physics
    design: FingerDesign
    shear_modulus_MPa: float
    sensing_radius_mm: FloatArray
    angle_deg: FloatArray
    gain_factor: FloatArray

    @classmethod
    def of(cls, physics: Physics, design: FingerDesign, shear_modulus_MPa: float, seed: int) -> TrueFinger:
        """Draw the elements; the seed gives the same at every modulus."""
        rng = np.random.default_rng([seed, 0])
        m = design.n_elements
        return cls(
            physics,
            design,
            shear_modulus_MPa,
            physics.sensing_radius_mm + design.depth_spread_mm * rng.standard_normal(m).clip(-2, 2),
            design.element_angles_deg + design.angle_error_deg * rng.standard_normal(m),
            np.exp(design.gain_spread * rng.standard_normal(m)),
        )

    def readings(self, indenter_radius_mm: FloatArray, angle_deg: FloatArray, load: FloatArray) -> FloatArray:
        """Silent readings (t, m): strain times gain, an ideal edge of 200 N/m reading the design's peak on average.

        Parameters
        ----------
        indenter_radius_mm, angle_deg, load : (t,) arrays
            r_c (mm), θ_c (degree), P (N/m).
        """
        radius = composite_radius(indenter_radius_mm, self.design.outer_radius_mm)
        pressed = load / 1000 / self.shear_modulus_MPa
        modes = np.arange(N_MODES)
        if np.any(radius > 0):
            contact = _contact(self.design, self.physics.poisson_ratio, self.physics.length_mm)
            kappa, of_touch = np.unique(pressed * radius, return_inverse=True)
            spectrum = contact.spectrum(kappa, modes)[of_touch.ravel()]
        else:
            spectrum = np.ones((len(radius), N_MODES))
        turn = np.radians(angle_deg[:, None] - self.angle_deg)
        shape = np.empty(turn.shape)
        for i, weights in enumerate(self._weights):
            shape[:, i] = (spectrum * weights * np.cos(turn[:, i, None] * modes)).sum(axis=1)
        if self.physics.finite_strain:
            shape += self.physics.finite_strain * self._added(pressed, radius, turn)
        peak = self.design.peak_reading / REFERENCE_LOAD
        return np.asarray(peak * self.gain_factor * load[:, None] * shape)

    @cached_property
    def _weights(self) -> FloatArray:
        """Response of each element to each mode of the pressure, one for an ideal long edge right above."""
        design, physics, modes = self.design, self.physics, np.arange(N_MODES)
        body = {
            "core_radius_mm": design.core_radius_mm,
            "outer_radius_mm": design.outer_radius_mm,
            "poisson_ratio": physics.poisson_ratio,
        }
        solved = solve_annulus(
            modes,
            core_radius_mm=design.core_radius_mm,
            outer_radius_mm=design.outer_radius_mm,
            poisson_ratio=physics.poisson_ratio,
        )
        strain = np.where(modes == 0, 1.0, 2.0) * solved.radial_strain(self.sensing_radius_mm)
        strain /= strain.sum(axis=1, keepdims=True)
        if np.isfinite(physics.length_mm):
            strain *= length_ratio_of_strain(
                modes, physics.length_mm, sensing_radius_mm=physics.sensing_radius_mm, **body
            )
        return np.asarray(strain)

    @cached_property
    def _added(self) -> FiniteStrainResponse:
        return FiniteStrainTable.load(self.physics.measure).for_elements(self.sensing_radius_mm)


def contact_of(design: FingerDesign, physics: Physics) -> LayerContact:
    """The frictionless contact on the bonded layer, of indenters of that length."""
    return _contact(design, physics.poisson_ratio, physics.length_mm)


@lru_cache(maxsize=8)
def _contact(design: FingerDesign, poisson_ratio: float, length_mm: float) -> LayerContact:
    radii = (design.core_radius_mm, design.outer_radius_mm)
    if np.isinf(length_mm):
        return LayerContact.for_body(*radii, poisson_ratio)
    ratio = length_ratio_of_compliance(
        np.arange(1, COMPLIANCE_MODES + 1),
        length_mm,
        core_radius_mm=radii[0],
        outer_radius_mm=radii[1],
        poisson_ratio=poisson_ratio,
    )
    compliance = SurfaceCompliance.for_body(*radii, poisson_ratio, COMPLIANCE_MODES).scaled(ratio)
    return LayerContact.for_body(*radii, poisson_ratio, terms=12, compliance=compliance)
