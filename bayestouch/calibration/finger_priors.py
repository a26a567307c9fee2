"""Priors of a finger's calibration parameters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayestouch.parameters import LogNormal, Normal, Parameter
from bayestouch.sensor import Finger, Sensor

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class FingerPriors:
    """Priors centred on the finger as built.

    Attributes
    ----------
    sensing_radius : Normal
        ``r_s`` in mm, every element's.
    angle_sd_deg : float
        Standard deviation of an element's angle about the nominal one, degree.
    poisson_ratio : Normal
        σ.
    shear_modulus : LogNormal
        μ in MPa.
    response_factor : float
        The response of an element is normal about zero with this many times its apparent peak: all but flat.
    """

    sensing_radius: Normal
    angle_sd_deg: float
    poisson_ratio: Normal
    shear_modulus: LogNormal
    response_factor: float = 10.0

    @classmethod
    def of(cls, sensor: Sensor) -> tuple[FingerPriors, tuple[str, ...]]:
        """Default priors for a sensor, with what they assume, one sentence each."""
        finger = sensor.body
        assert isinstance(finger, Finger)
        notes = []
        thickness = finger.outer_radius_mm - finger.core_radius_mm
        margin = 1e-3 * thickness
        sigma = sensor.rubber.poisson_ratio
        mu = sensor.rubber.shear_modulus_MPa
        if sigma is None:
            notes.append("Poisson's ratio is not stated: its prior is wide (0.47 ± 0.03).")
        if mu is None:
            notes.append(
                "The shear modulus is not stated: its prior is wide (0.2 MPa within a factor of 3), and the scale of "
                "radii rests on the indenters alone."
            )
        # Hand-made fingers: depth within a tenth of the rubber (the paper built 9.9 mm and fitted 9.8 to 10.7),
        # angles within a quarter of the pitch.
        angles = np.sort(finger.element_angles_deg)
        pitch = float(np.min(np.diff(angles))) if len(angles) > 1 else 8.0
        return (
            cls(
                sensing_radius=Normal(
                    finger.sensing_radius_mm,
                    0.1 * thickness,
                    finger.core_radius_mm + margin,
                    finger.outer_radius_mm - margin,
                ),
                angle_sd_deg=min(0.25 * pitch, 5.0),
                poisson_ratio=Normal(0.47 if sigma is None else sigma, 0.03 if sigma is None else 0.02, 0.0, 0.4999),
                shear_modulus=LogNormal(0.2, np.log(3.0)) if mu is None else LogNormal(mu, np.log(1.35)),
            ),
            tuple(notes),
        )

    def flat(self, finger: Finger, response: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean and standard deviation of the flat vector: responses, depths, angles (rad), σ, log μ.

        Parameters
        ----------
        finger : Finger
            Nominal angles.
        response : (m,) array
            Apparent peak response of each element, which sets the width of its prior.
        """
        m = finger.n_elements
        mean = np.concatenate(
            [
                np.zeros(m),
                np.full(m, self.sensing_radius.mean),
                np.radians(finger.element_angles_deg),
                [self.poisson_ratio.mean, np.log(self.shear_modulus.median)],
            ]
        )
        spread = np.concatenate(
            [
                self.response_factor * np.abs(response),
                np.full(m, self.sensing_radius.sd),
                np.full(m, np.radians(self.angle_sd_deg)),
                [self.poisson_ratio.sd, self.shear_modulus.spread],
            ]
        )
        return mean, spread

    def bounds(self, finger: Finger, largest_load: float) -> tuple[FloatArray, FloatArray]:
        """Lower and upper bounds of the flat vector, for loads up to `largest_load` N/m.

        The rubber is at least so stiff that a flat under the largest load keeps to a quarter of the circumference,
        where linear contact has long lost its meaning.
        """
        free = np.full(finger.n_elements, np.inf)
        softest = np.log(largest_load / 1000 / (10 * finger.outer_radius_mm))
        depth, poisson = self.sensing_radius, self.poisson_ratio
        low = np.concatenate([-free, np.full(finger.n_elements, depth.low), -free, [poisson.low, softest]])
        high = np.concatenate([free, np.full(finger.n_elements, depth.high), free, [poisson.high, np.inf]])
        return low, high

    def parameters(self, finger: Finger, reading_unit: str) -> tuple[Parameter, ...]:
        """The unknowns, for tables and files."""
        angles = finger.element_angles_deg
        centre = float(np.mean(angles))
        return (
            Parameter("sigma", "σ", r"\sigma", "", self.poisson_ratio, "Poisson's ratio of the rubber"),
            Parameter("mu", "μ", r"\mu", "MPa", self.shear_modulus, "shear modulus of the rubber"),
            Parameter("r_s", "r_s", r"r_s", "mm", self.sensing_radius, "radius at which the element lies"),
            Parameter(
                "theta_s",
                "θ_s",
                r"\theta_s",
                "degree",
                Normal(centre, self.angle_sd_deg),
                "angle of the element (the prior is centred on each element's own nominal angle)",
            ),
            Parameter(
                "response",
                "ρ",
                r"\rho",
                f"{reading_unit}/(N/m)",
                Normal(0.0, self.response_factor),
                "reading per load of a knife edge above the element (prior in units of the apparent peak)",
            ),
        )
