"""Lower bound of the shear modulus: on softer rubber the contact is wider than linear elasticity is valid for."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from bayestouch.contact.layer import LayerContact
from bayestouch.data.sensor import Finger

# Share of the range of the table of contacts that is used; this range increases with Poisson's ratio.
SHORT_OF_THE_END = 0.95


def softest(finger: Finger, largest_load: float, lowest_poisson_ratio: float, largest_radius_mm: float = 0.0) -> float:
    """Lower bound of log μ (MPa), at which a flat under the largest load has the widest contact with a solution.

    κ of this contact is 95 % of the smaller of two values: ``10 r_b²``, and κ at the end of the table of contacts.

    Parameters
    ----------
    finger : Finger
        The finger, with its nominal dimensions.
    largest_load : float
        Largest load, N/m.
    lowest_poisson_ratio : float
        Lower bound of σ.
    largest_radius_mm : float
        Largest composite radius, mm, if the surface may be flatter somewhere than the circle.
    """
    radii = (finger.core_radius_mm, finger.outer_radius_mm)
    radius = max(radii[1], largest_radius_mm)
    return float(np.log(largest_load / 1000 * radius / _widest_kappa(radii, lowest_poisson_ratio)))


@lru_cache(maxsize=8)
def _widest_kappa(radii_mm: tuple[float, float], poisson_ratio: float) -> float:
    """κ (mm²) of the widest contact, for a body with this Poisson's ratio or a higher one."""
    return SHORT_OF_THE_END * float(
        min(LayerContact.for_body(*radii_mm, poisson_ratio).kappas[-1], 10 * radii_mm[1] ** 2)
    )
