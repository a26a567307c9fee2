"""Criterion of the paper for distinguishing two indenters: section 2.1 and Figure 4.

"The round and edge indenters can be distinguished at a 95 % level when the square root of the mean square error
exceeds 2 standard deviations of the noise". Location, load and sensor are assumed to be known, and the error is a mean
over angle, not a sum over elements. The paper does not state the range of angles; here it is `span_deg`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray
from bayestouch.body.finger import solve_body
from bayestouch.chain.response import modes_needed
from bayestouch.contact import ContactModel, composite_radius, contact_model
from bayestouch.errors import InputError
from bayestouch.output.summary import Summarised

#: Two indenters count as distinguished if their difference exceeds the noise by this factor.
NOISE_FACTOR = 2.0
#: Possible ranges of the "mean square": the circumference, or the arcs of the standard errors of sections 3.2 and 3.1.
SPANS_DEG = {"circumference": 360.0, "touched half": 180.0, "50 degrees": 50.0}
ANGLES = 2048


@dataclass(frozen=True, repr=False)
class Annulus(Summarised):
    """A finger without elements, as Figure 4 needs it.

    Attributes
    ----------
    alpha : float
        ``α = r_a/r_b``, above 0 and below 1.
    sensing_radius : float
        ``r_s/r_b``, between α and 1.
    outer_radius_mm : float
        ``r_b``.
    poisson_ratio, shear_modulus_MPa : float
        σ and μ.
    load_N_per_m : float
        P, the same for every indenter.
    contact : str
        Contact model, see `bayestouch.contact.contact_model`.
    """

    alpha: float
    sensing_radius: float
    outer_radius_mm: float = 12.7
    poisson_ratio: float = 0.46
    shear_modulus_MPa: float = 0.054
    load_N_per_m: float = 200.0
    contact: str = "layer"

    def __post_init__(self) -> None:
        if not 0 < self.alpha < self.sensing_radius < 1:
            raise InputError(
                "a finger's radii must be in order, 0 < r_a/r_b < r_s/r_b < 1: "
                f"got {self.alpha:g} and {self.sensing_radius:g}"
            )
        if not (0 < self.shear_modulus_MPa < np.inf and 0 < self.load_N_per_m < np.inf):
            raise InputError("shear modulus and load must be above zero")

    def strain(self, indenter_radius_mm: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Angles around the finger, and compressive strain there under indenters at angle zero.

        Parameters
        ----------
        indenter_radius_mm : (n,) array_like
            Indenter radii r_c: 0 knife edge, inf flat.

        Returns
        -------
        angle : (a,) array
            Angles in rad, from -π.
        strain : (n, a) array
            Strain ``-e_rr`` at ``r_s``.
        """
        outer = self.outer_radius_mm
        radii = (self.alpha * outer, outer)
        modes = np.arange(modes_needed(self.sensing_radius * outer, outer) + 1)
        body = solve_body(
            modes, core_radius_mm=radii[0], outer_radius_mm=outer, poisson_ratio=self.poisson_ratio
        ).radial_strain(self.sensing_radius * outer)
        scale = self.load_N_per_m / 1000 / self.shear_modulus_MPa
        kappa = scale * composite_radius(np.atleast_1d(indenter_radius_mm), outer)
        spectrum = _contact(self.contact, radii, self.poisson_ratio).spectrum(kappa, modes)
        angle = 2 * np.pi * np.arange(ANGLES) / ANGLES - np.pi
        weights = np.where(modes == 0, 1.0, 2.0) * np.ravel(body)
        series = (spectrum * weights) @ np.cos(np.outer(modes, angle))
        return angle, np.asarray(scale / (2 * np.pi * outer) * series)


@lru_cache(maxsize=32)
def _contact(name: str, radii: tuple[float, float], poisson_ratio: float) -> ContactModel:
    """Contact model of a body, cached: it is solved once for all loads, moduli and indenters."""
    return contact_model(name, radii, poisson_ratio)


def strain_difference(finger: Annulus, indenter_radius_mm: ArrayLike, *, span_deg: float = 360.0) -> FloatArray:
    """Root mean square difference from the strain profile of a knife edge, relative to its peak strain (Figure 4).

    Parameters
    ----------
    finger : Annulus
        The sensor.
    indenter_radius_mm : (n,) array_like
        r_c of the indenters.
    span_deg : float
        Arc about the contact for the mean; 360 is the whole circumference.

    Returns
    -------
    (n,) array
        Relative differences.

    Raises
    ------
    InputError
        If the arc is not above 0 and at most 360°.
    """
    if not 0 < span_deg <= 360:
        raise InputError(f"span_deg: expected above 0 and at most 360, got {span_deg:g}")
    radii = np.concatenate([[0.0], np.atleast_1d(np.asarray(indenter_radius_mm, dtype=float))])
    angle, strain = finger.strain(radii)
    inside = np.abs(angle) <= np.radians(span_deg) / 2
    difference = (strain[1:, inside] - strain[0, inside]) / strain[0].max()
    return np.asarray(np.sqrt((difference**2).mean(axis=1)))


def tolerable_noise(finger: Annulus, *, indenter_radius_mm: float = np.inf, span_deg: float = 360.0) -> float:
    """Largest noise (share of the peak strain) for which the criterion distinguishes an indenter from a knife edge.

    The paper gives 3.7 % for the flat at α = 0.70.
    """
    return float(strain_difference(finger, [indenter_radius_mm], span_deg=span_deg)[0]) / NOISE_FACTOR


def smallest_radius(finger: Annulus, noise: float, *, span_deg: float = 360.0) -> float:
    """Smallest r_c (mm) that the criterion distinguishes from a knife edge at this noise (share of the peak strain).

    The paper gives ``0.16 r_b`` at 1 % and α = 0.70. inf if not even a flat is distinguished; 0 without noise.

    Raises
    ------
    InputError
        If the noise is negative or not a number, or the arc is not above 0 and at most 360°.
    """
    if not noise >= 0:
        raise InputError(f"noise: expected zero or more, as a share of the peak, got {noise:g}")
    outer = finger.outer_radius_mm
    # Equal steps in R, the scale on which strains change; the limits are edge and flat.
    composite = np.linspace(0.0, outer, 97)
    with np.errstate(divide="ignore"):
        radius = 1 / (1 / composite[1:] - 1 / outer)
    radius[-1] = np.inf
    error = np.concatenate([[0.0], strain_difference(finger, radius, span_deg=span_deg)])
    if error.max() < NOISE_FACTOR * noise:
        return float(np.inf)
    first = int(np.argmax(error >= NOISE_FACTOR * noise))
    if first == 0:
        return 0.0
    share = (NOISE_FACTOR * noise - error[first - 1]) / (error[first] - error[first - 1])
    at = composite[first - 1] + share * (composite[first] - composite[first - 1])
    return float(1 / (1 / at - 1 / outer)) if at < outer else float(np.inf)
