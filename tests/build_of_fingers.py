"""Fingers of one build, drawn from a population with known sds and touched, by the independent simulator."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from independent.body import Annulus
from independent.finger import REFERENCE_LOAD, Finger, Press

from bayestouch.data.dataset import DataSet
from bayestouch.data.sensor import Finger as Geometry
from bayestouch.data.sensor import Rubber, Sensor
from bayestouch.data.touches import Touches, touches_from

PITCH, CORE, OUTER, DEPTH = 8.8, 9.4, 12.7, 9.9
FORCE_NOISE, SAMPLES = 1.0, 4
LOADS = 160.0, 240.0


@dataclass(frozen=True)
class Build:
    """Means and sds of a build of fingers.

    Sds are between fingers and, for `depth_within` and `response_within`, between elements of a finger; those of μ,
    response and noise are of the logarithm. The stated rubber is 0.15 MPa and 0.47, the radius as built 9.9 mm.
    """

    n_elements: int = 4
    sigma: float = 0.475
    sigma_sd: float = 0.002
    mu: float = 0.14
    mu_sd: float = 0.05
    depth: float = 10.0
    depth_sd: float = 0.03
    depth_within: float = 0.06
    angle_sd: float = 0.5
    response: float = 4.5
    response_sd: float = 0.08
    response_within: float = 0.15
    noise: float = 12.0
    noise_sd: float = 0.1

    @property
    def angles(self) -> np.ndarray:
        """Angles of the elements as built, degree."""
        return np.asarray((np.arange(self.n_elements) - (self.n_elements - 1) / 2) * PITCH)

    @property
    def sensor(self) -> Sensor:
        """What is stated of every finger."""
        body = Geometry(CORE, OUTER, DEPTH, tuple(self.angles))
        return Sensor("finger of a build", body, Rubber(0.15, 0.47), FORCE_NOISE, "counts", "capacitance", {})

    def draw(self, rng: np.random.Generator, *, off: float = 0.0) -> Built:
        """Draw a finger; σ, log μ and the depths are moved by `off` of their sds between fingers."""
        m, normal = self.n_elements, rng.standard_normal
        response = self.response * np.exp(self.response_sd * normal() + self.response_within * normal(m))
        depth = self.depth + self.depth_sd * (normal() + off) + self.depth_within * normal(m)
        sigma = self.sigma + self.sigma_sd * (float(normal()) + off)
        mu = self.mu * float(np.exp(self.mu_sd * (normal() + off)))
        angle = self.angles + self.angle_sd * normal(m)
        # the gain with which a knife edge above the element reads `response` per N/m
        unit = Finger(Annulus(CORE, OUTER, sigma), mu, depth, angle, np.ones(m)).peak / REFERENCE_LOAD
        finger = Finger(Annulus(CORE, OUTER, sigma), mu, depth, angle, response / unit)
        return Built(self, finger, response, self.noise * float(np.exp(self.noise_sd * normal())))


@dataclass(frozen=True, eq=False)
class Built:
    """A finger of a build: the simulated finger, its responses (counts per N/m) and the noise of one reading."""

    build: Build
    finger: Finger
    response: np.ndarray
    noise: float

    @property
    def truth(self) -> dict[str, np.ndarray]:
        """True values by name of the parameter."""
        finger = self.finger
        values = {
            "sigma": finger.body.poisson,
            "mu": finger.modulus,
            "r_s": finger.depth,
            "theta_s": finger.angle,
            "response": self.response,
            "noise_sd": np.full(len(finger.depth), self.noise),
        }
        return {name: np.asarray(value, dtype=float) for name, value in values.items()}

    def touched(
        self,
        rng: np.random.Generator,
        tip: np.ndarray,
        angle: np.ndarray,
        samples: int = SAMPLES,
        load: np.ndarray | None = None,
    ) -> Touches:
        """Touches with tips of these radii (mm) at these angles (degree), with these loads (N/m) or random ones."""
        load = rng.uniform(*LOADS, len(tip)) if load is None else load
        index = np.repeat(np.arange(len(tip)), samples)
        clean = self.finger.signal(Press(tip, angle, load))[index]
        return touches_from(
            touch=index,
            readings=clean + self.noise * rng.standard_normal(clean.shape),
            indenter_radius_mm=tip[index],
            angle_deg=angle[index],
            load=load[index] + FORCE_NOISE * rng.standard_normal(len(index)),
        )

    def dataset(self, rng: np.random.Generator, n_touches: int = 45) -> DataSet:
        """Calibration touches at equal distances over the elements: two knife edges for each flat."""
        flats = n_touches // 3
        reach = PITCH * (self.build.n_elements / 2 + 0.5)
        places = [np.linspace(-reach, reach, n) for n in (n_touches - flats, flats)]
        tip = np.repeat([0.0, np.inf], [n_touches - flats, flats])
        touches = self.touched(rng, tip, np.concatenate(places))
        return DataSet(self.build.sensor, touches, touches, None, ())
