"""Priors of the calibration parameters of a finger: defaults, and those stated by the user."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.finger import FingerChain
from bayestouch.data.sensor import Finger, Sensor, finger_of
from bayestouch.errors import InputError, nearest
from bayestouch.finger.known_touches import KnownTouches
from bayestouch.finger.layout import FlatPrior, normal_approximation
from bayestouch.finger.softest_rubber import softest
from bayestouch.priors.parameters import LogNormal, Normal, Parameter, Prior, moved, truncated
from bayestouch.priors.stated import check_holds

# Range of Poisson's ratio of a rubber; at 0.5 a bonded layer does not deform.
POISSON_BOUNDS = 0.0, 0.4999
# The model error is smaller than the noise of the mean of a touch, about equal, or (probability 1 %) more than four
# times as large.
DISCREPANCY = LogNormal(0.3, float(np.log(3.0)))
# How the description of a parameter says that its prior has another unit than the parameter.
IN_UNITS = "prior in units of"


@dataclass(frozen=True)
class FingerPriors:
    """Priors of a finger; all are proper.

    Attributes
    ----------
    sensing_radius : Prior
        ``r_s`` of each element, mm.
    angle : Prior
        Difference between the angle of an element and its nominal angle, degree; normal or uniform.
    poisson_ratio, shear_modulus : Prior
        σ, and μ in MPa.
    response : Prior or None
        Absolute reading per N/m of a knife edge directly above an element. None: log-normal within a factor of 3 about
        `apparent_response`.
    noise : Prior or None
        Standard deviation of one raw reading. None: log-normal within a factor of 10 about 1 % of the peak reading.
    discrepancy : Prior or None
        Model error of an element's mean reading, as a multiple of the noise of this mean. None: no model error.
    force_noise : Prior or None
        Standard deviation of one reading of the force sensor, N/m. None: log-normal within a factor of 3 about 0.5 % of
        the mean load.
    """

    sensing_radius: Prior
    angle: Prior
    poisson_ratio: Prior
    shear_modulus: Prior
    response: Prior | None = None
    noise: Prior | None = None
    discrepancy: Prior | None = DISCREPANCY
    force_noise: Prior | None = None

    @classmethod
    def of(cls, sensor: Sensor) -> tuple[FingerPriors, tuple[str, ...]]:
        """Default priors for a sensor, and their assumptions, one sentence each.

        Raises
        ------
        InputError
            If two elements have the same nominal angle.
        """
        finger = finger_of(sensor)
        notes = []
        sigma, mu, force = sensor.rubber.poisson_ratio, sensor.rubber.shear_modulus_MPa, sensor.force_noise_sd
        if sigma is None:
            notes.append("Poisson's ratio is not stated: its prior is wide (0.47 ± 0.03).")
        if mu is None:
            notes.append(
                "The shear modulus is not stated: its prior is wide (0.2 MPa within a factor of 3), and the scale of "
                "radii depends on the indenters only."
            )
        if force is None:
            notes.append(
                "The force sensor's noise is not stated: its prior is wide (0.5 % of the load within a factor of 3)."
            )
        # Fingers made by hand: r_s within a tenth of the rubber (the paper has 9.9 mm nominal, 9.8 to 10.7 mm fitted),
        # angles within a quarter of the pitch.
        places = np.asarray(finger.element_angles_deg, dtype=float)
        order = np.argsort(places, kind="stable")
        angles = places[order]
        if (same := np.flatnonzero(np.diff(angles) == 0)).size:
            one, other = (f"e{i + 1:02d}" for i in order[same[0] : same[0] + 2])
            raise InputError(
                f"elements {one} and {other} have the same angle, {angles[same[0]]:g} degrees: state two angles"
            )
        pitch = float(np.min(np.diff(angles))) if len(angles) > 1 else 8.0
        return (
            cls(
                sensing_radius=Normal(
                    finger.sensing_radius_mm,
                    0.1 * (finger.outer_radius_mm - finger.core_radius_mm),
                    *_depth_bounds(finger),
                ),
                angle=Normal(0.0, min(0.25 * pitch, 5.0)),
                poisson_ratio=Normal(
                    0.47 if sigma is None else sigma, 0.03 if sigma is None else 0.02, *POISSON_BOUNDS
                ),
                shear_modulus=LogNormal(0.2, np.log(3.0)) if mu is None else LogNormal(mu, np.log(1.35)),
                force_noise=None if force is None else LogNormal(force, np.log(1.5)),
            ),
            tuple(notes),
        )

    def with_stated(self, stated: Mapping[str, Prior], finger: Finger) -> FingerPriors:
        """The priors with those stated by the user, by name of the parameter (see `FIELDS`).

        Raises
        ------
        InputError
            If a name is unknown, or a prior contradicts the possible range or the nominal geometry.
        """
        changes: dict[str, Prior] = {}
        for name, prior in stated.items():
            if name not in FIELDS:
                hint = " (it follows from response, r_s, sigma and mu)" if name == "gain" else nearest(name, FIELDS)
                raise InputError(f"prior of {name}: not a parameter{hint}; expected one of {', '.join(FIELDS)}")
            try:
                changes[FIELDS[name]] = _possible(name, prior, finger)
            except InputError as error:
                raise InputError(f"prior of {name}: {error}") from None
        return replace(self, **changes)

    def apparent_response(self, finger: Finger, known: KnownTouches) -> FloatArray:
        """Response of each element for the start of a fit, (m,), see `KnownTouches.apparent_response`."""
        depth, turn, sigma, log_mu = (
            normal_approximation(prior, logarithmic)[0]
            for prior, logarithmic in (
                (self.sensing_radius, False),
                (self.angle, False),
                (self.poisson_ratio, False),
                (self.shear_modulus, True),
            )
        )
        m, load = finger.n_elements, float(known.load.max())
        chain = FingerChain(
            core_radius_mm=finger.core_radius_mm,
            outer_radius_mm=finger.outer_radius_mm,
            response=np.ones(m),
            sensing_radius_mm=np.full(m, depth),
            angle=np.radians(finger.element_angles_deg) + np.radians(turn),
            offset=np.zeros(m),
            poisson_ratio=sigma,
            shear_modulus_MPa=float(np.exp(max(log_mu, softest(finger, load, sigma)))),
            largest_load=load,
        )
        return known.apparent_response(finger, chain.predict(known.radius_mm, known.angle, known.load))

    def flat(self, finger: Finger, known: KnownTouches, apparent: FloatArray) -> FlatPrior:
        """Priors of all coordinates of the flat vector, for these touches and their `apparent_response` (m,)."""
        m, apparent = finger.n_elements, np.abs(apparent)
        nominal = np.radians(finger.element_angles_deg)
        response = [self.response or LogNormal(float(one), np.log(3.0)) for one in apparent]
        peak = apparent * known.typical_load
        noise = [self.noise or LogNormal(float(0.01 * one), np.log(10.0)) for one in peak]
        force = self.force_noise or LogNormal(0.005 * known.typical_load, np.log(3.0))
        return FlatPrior.of(
            n_elements=m,
            priors=(
                *response,
                *[self.sensing_radius] * m,
                *(moved(self.angle, np.pi / 180, float(place)) for place in nominal),
                self.poisson_ratio,
                self.shear_modulus,
                *noise,
                *([self.discrepancy] * m if known.repeated and self.discrepancy is not None else []),
                force,
            ),
        )

    def parameters(self, reading_unit: str, *, discrepancy: bool) -> tuple[Parameter, ...]:
        """The parameters with their descriptions, for tables and files."""
        wide = LogNormal(1.0, np.log(3.0))
        own = "reading per load of a knife edge above the element"
        noise = "noise of one raw reading"
        force = "noise of one reading of the force sensor"
        return (
            Parameter("sigma", "σ", r"\sigma", "", self.poisson_ratio, "Poisson's ratio of the rubber"),
            Parameter("mu", "μ", r"\mu", "MPa", self.shear_modulus, "shear modulus of the rubber"),
            Parameter("r_s", "r_s", r"r_s", "mm", self.sensing_radius, "radius at which the element lies"),
            Parameter(
                "theta_s",
                "θ_s",
                r"\theta_s",
                "degree",
                self.angle,
                "angle of the element (the prior is of its departure from the nominal angle)",
                relative=True,
            ),
            Parameter(
                "response",
                "ρ",
                r"\rho",
                f"{reading_unit}/(N/m)",
                self.response or wide,
                own if self.response else f"{own} ({IN_UNITS} its largest reading over load)",
                relative=self.response is None,
            ),
            Parameter(
                "noise_sd",
                "s",
                "s",
                reading_unit,
                self.noise or LogNormal(1.0, np.log(10.0)),
                noise if self.noise else f"{noise} ({IN_UNITS} 1 % of the element's peak)",
                relative=self.noise is None,
            ),
            *(
                [
                    Parameter(
                        "discrepancy_sd",
                        "d",
                        "d",
                        reading_unit,
                        self.discrepancy,
                        f"model error beyond noise ({IN_UNITS} the noise of a touch's mean)",
                        relative=True,
                    )
                ]
                if discrepancy and self.discrepancy is not None
                else []
            ),
            Parameter(
                "force_noise_sd",
                "s_F",
                "s_F",
                "N/m",
                self.force_noise or wide,
                force if self.force_noise else f"{force} ({IN_UNITS} 0.5 % of the mean load)",
                relative=self.force_noise is None,
            ),
        )


#: Parameters whose priors a user may state, and their fields in `FingerPriors`.
FIELDS = {
    "sigma": "poisson_ratio",
    "mu": "shear_modulus",
    "r_s": "sensing_radius",
    "theta_s": "angle",
    "response": "response",
    "noise_sd": "noise",
    "discrepancy_sd": "discrepancy",
    "force_noise_sd": "force_noise",
}


def _depth_bounds(finger: Finger) -> tuple[float, float]:
    """Range of r_s, mm: inside the rubber by a thousandth of its thickness."""
    margin = 1e-3 * (finger.outer_radius_mm - finger.core_radius_mm)
    return finger.core_radius_mm + margin, finger.outer_radius_mm - margin


def _possible(name: str, prior: Prior, finger: Finger) -> Prior:
    """The prior truncated to the possible range; raises `InputError` if it contradicts the nominal geometry."""
    if name == "sigma":
        return truncated(prior, *POISSON_BOUNDS)
    if name == "r_s":
        low, high = _depth_bounds(finger)
        inside = truncated(prior, low, high)
        return check_holds(
            inside, finger.sensing_radius_mm, f"the sensing radius as built, {finger.sensing_radius_mm:g} mm"
        )
    if name == "theta_s":
        moved(prior, 1.0, 0.0)
        return check_holds(prior, 0.0, "the angles as built (it is the prior of the departure from them, in degrees)")
    return truncated(prior, 0.0, np.inf)
