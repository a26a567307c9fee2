"""What the paper does not print and all its tables share: the unknowns that explain them, and their priors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bayestouch.contact import composite_radius
from bayestouch.paper.published import TABLE_3
from bayestouch.paper.simplex.elements import WINDOW_DEG
from bayestouch.simulation import FingerDesign

FloatArray = NDArray[np.float64]

TAIL_FROM_DEG = WINDOW_DEG / 2
TAIL_EDGE_DEG = 5.0
POISSON_RATIOS = (0.46, 0.475, 0.49)
"""Between which the contact's width is interpolated: Table 1's mean, and nearly incompressible rubber."""


def tail_window(off_deg: ArrayLike) -> FloatArray:
    """Zero within Table 1's window about an element, one outside; half a cosine of 5° between."""
    beyond = (np.abs(np.asarray(off_deg, dtype=float)) - TAIL_FROM_DEG) / TAIL_EDGE_DEG
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * np.clip(beyond, 0.0, 1.0)))


@dataclass(frozen=True)
class Unknowns:
    """Shared unknowns; the defaults are those of the comparison before.

    Attributes
    ----------
    modulus_MPa : float
        Shear modulus μ of the rubber, with which the authors read, too.
    poisson_ratio : float
        Of the rubber, in its contact.
    squeeze_mm : float
        Width that the authors' approximate frictionless model takes off the half-width of Hertz's contact.
    odd_tip_R_mm : float
        Composite radius of the tip that is printed as 3.90 mm.
    tip_sd_mm : float
        Standard deviation of errors of the other tips' composite radii.
    map_error, place_error : float
        Errors of the elements' E maps within 25° of the touch and of the places touched, % of the peak.
    spread : float
        Standard deviation of the logarithm of the elements' error sizes.
    tail : float
        Error of the elements more than 25° from the touch, % of the peak: Table 1 does not see it, Table 2 takes it up.
    prober_deg : float
        Standard deviation of the prober's error of location at a place, the same for all tips.
    drift : float
        A factor of all readings that changes from touch to touch, %.
    jitter : float
        A factor of all readings that changes from sample to sample, %.
    load_by_place, push : float
        Standard deviations by place: of the load that reaches the rubber, and of a push along the surface; % of the
        load, the same for all tips.
    curvature_per_mm : float
        Root mean square of what the surface adds to 1/R, smooth over 10°.
    core_mm : float
        Distance of the core's axis from that of the surface.
    fine_map, touch_error : float
        Errors of every element, % of the peak: of an E map that changes from place to place, over which a contact takes
        the mean, and of each touch, whatever its place.
    length_mm : float
        Length of the tips; inf is plane strain.
    """

    ODD_TIP_MM: ClassVar[float] = 3.90

    modulus_MPa: float = 0.054
    poisson_ratio: float = POISSON_RATIOS[0]
    squeeze_mm: float = 0.0
    odd_tip_R_mm: float = float(composite_radius(3.90, FingerDesign().outer_radius_mm))
    tip_sd_mm: float = 0.0
    map_error: float = 2.9
    place_error: float = 1.57
    spread: float = 0.0
    tail: float = 0.0
    prober_deg: float = 0.0
    drift: float = 0.0
    jitter: float = 0.0
    load_by_place: float = 0.0
    push: float = 0.0
    curvature_per_mm: float = 0.0
    core_mm: float = 0.0
    fine_map: float = 0.0
    touch_error: float = 0.0
    length_mm: float = np.inf

    def element_scales(self, drawn: FloatArray) -> FloatArray:
        """Error sizes of the elements, mean 1, from normal numbers."""
        scale = np.exp(self.spread * drawn)
        return np.asarray(scale / scale.mean())


_NEIGHBOURS = composite_radius([TABLE_3[1].r_c, TABLE_3[3].r_c], FingerDesign().outer_radius_mm)
#: Uniform priors. The tip lies between its neighbours of the table; the others reach beyond what any table allows.
PRIOR = {
    "modulus_MPa": (0.04, 0.2),
    "poisson_ratio": (POISSON_RATIOS[0], POISSON_RATIOS[-1]),
    "squeeze_mm": (0.1, 0.5),
    "odd_tip_R_mm": (float(_NEIGHBOURS[0]), float(_NEIGHBOURS[1])),
    "tip_sd_mm": (0.0, 0.5),
    "map_error": (0.5, 4.0),
    "place_error": (0.2, 2.2),
    "spread": (0.0, 0.8),
    "tail": (0.0, 6.0),
    "prober_deg": (0.0, 0.3),
    "drift": (0.0, 5.0),
    "jitter": (0.0, 5.0),
    "load_by_place": (0.0, 5.0),
    "push": (0.0, 20.0),
    "curvature_per_mm": (0.0, 0.02),
    "core_mm": (0.0, 1.0),
    "fine_map": (0.0, 4.0),
    "touch_error": (0.0, 2.2),
}
OF_SURFACE = ("load_by_place", "push", "curvature_per_mm", "core_mm")
OF_PLACES = (*OF_SURFACE, "fine_map", "touch_error")
"""What may take the part of errors that every element has of its own at a place (`place_error`): `place_mixtures`."""
