"""Reliability of other finger designs, as functions of element depth, element spacing, noise and rubber thickness.

The maps use `expected_finger` and `sweet_spots`. No touch is simulated, so a design takes only a second or two. A place
is a distance from an element in pitches: from 0 (above it) to 0.5 (halfway to its neighbour). On a finger built as
designed, all intervals between elements are equivalent, except those at the ends.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray
from bayestouch.errors import InputError, nearest
from bayestouch.output.summary import Summarised
from bayestouch.reliability.distinguishability import threshold_radii
from bayestouch.reliability.expected_calibration import expected_finger
from bayestouch.reliability.maps import SweetSpots, sweet_spots
from bayestouch.reliability.paper_criterion import Annulus
from bayestouch.simulation import FingerDesign

Vary = Literal["depth_mm", "spacing_mm", "noise_percent", "thickness_mm"]

INDENTERS_MM = (0.0, 3.9, 12.3, np.inf)
PLACES = tuple(np.linspace(0.0, 0.5, 6))


@dataclass(frozen=True, eq=False, repr=False)
class DesignMaps(Summarised):
    """Maps of reliability for v designs, k indenters and n places; R in mm, θ_c in degree, P in N/m.

    Attributes
    ----------
    vary : str
        Name of the quantity that varies.
    values : (v,) array
        Values of that quantity.
    designs : tuple of FingerDesign
        The designs.
    places : (n,) array
        Distances from an element (0) up to halfway to the next one (0.5), pitches.
    spots : tuple of SweetSpots
        Maps of each design, also by element.
    threshold_mm : (v, n) array
        Sharpest r_c that is distinguished from a knife edge with 95 %; NaN if not even a flat is.
    """

    vary: str
    values: FloatArray
    designs: tuple[FingerDesign, ...]
    places: FloatArray
    spots: tuple[SweetSpots, ...]
    threshold_mm: FloatArray

    def sd(self, name: str = "R") -> FloatArray:
        """Standard deviation of an estimate from noise and calibration together, (v, k, n)."""
        return np.stack([each.sd(name) for each in self.spots])

    def rms(self, name: str = "R") -> FloatArray:
        """Root mean square of `sd` over indenters and places, (v,)."""
        return np.asarray(np.sqrt((self.sd(name) ** 2).mean(axis=(1, 2))))


def design_maps(
    design: FingerDesign,
    vary: Vary,
    values: ArrayLike,
    *,
    indenters_mm: Sequence[float] = INDENTERS_MM,
    places: Sequence[float] = PLACES,
    samples: int = 1,
    use_load: bool = False,
    noise_of: Literal["peak", "strain"] = "peak",
    lack_of_fit_percent: float = 0.0,
) -> DesignMaps:
    """Reliability of a finger as a function of one quantity of its design.

    Parameters
    ----------
    design : FingerDesign
        The design with all other quantities.
    vary : {"depth_mm", "spacing_mm", "noise_percent", "thickness_mm"}
        Quantity that varies: depth of the elements below the surface; arc between them at their radius (the total arc
        is kept); noise of one reading in % of the peak; thickness of the rubber (height of the elements above the core
        is kept).
    values : (v,) array_like
        Values of that quantity.
    indenters_mm : sequence of float
        r_c of the k indenters.
    places : sequence of float
        Distances from an element (0) up to halfway to the next one (0.5), pitches.
    samples, use_load
        As in `sweet_spots`.
    noise_of : {"peak", "strain"}
        What is kept constant when the strain at the elements changes: noise in % of the peak, or noise as a strain.
    lack_of_fit_percent : float
        As in `expected_finger`.

    Raises
    ------
    InputError
        If there are no values; a value gives an impossible finger, one without noise, or one whose elements are too few
        for the unknowns of a touch; or `vary` is unknown.
    """
    wanted = np.atleast_1d(np.asarray(values, dtype=float))
    if not len(wanted):
        raise InputError("values: expected one at least")
    designs = tuple(changed_design(design, vary, float(value), noise_of=noise_of) for value in wanted)
    spots, thresholds = [], []
    for each in designs:
        known = expected_finger(each, lack_of_fit_percent=lack_of_fit_percent)
        angle = places_deg(each, places)
        spots.append(sweet_spots(known, indenters_mm, angle, samples=samples, use_load=use_load))
        thresholds.append(threshold_radii(known, angle, samples=samples, use_load=use_load))
    return DesignMaps(vary, wanted, designs, np.asarray(places, dtype=float), tuple(spots), np.stack(thresholds))


def changed_design(
    design: FingerDesign, vary: Vary, value: float, *, noise_of: Literal["peak", "strain"] = "peak"
) -> FingerDesign:
    """Design of `design_maps` for one value."""
    outer = design.outer_radius_mm
    if vary == "depth_mm":
        new = replace(design, sensing_radius_mm=outer - value)
    elif vary == "thickness_mm":
        above_core = design.sensing_radius_mm - design.core_radius_mm
        new = replace(design, core_radius_mm=outer - value, sensing_radius_mm=outer - value + above_core)
    elif vary == "spacing_mm":
        pitch = float(np.degrees(value / design.sensing_radius_mm)) if value > 0 else 0.0
        elements = max(1, round(design.n_elements * design.pitch_deg / pitch)) if pitch > 0 else 1
        new = replace(design, pitch_deg=pitch, n_elements=elements)
    elif vary == "noise_percent":
        return replace(design, noise_percent_peak=value)
    else:
        known = get_args(Vary)
        raise InputError(f"vary: expected {' or '.join(known)}, got {vary!r}{nearest(str(vary), known)}")
    if noise_of == "peak":
        return new
    return replace(new, noise_percent_peak=design.noise_percent_peak * _peak_strain(design) / _peak_strain(new))


def places_deg(design: FingerDesign, places: Sequence[float] = PLACES) -> FloatArray:
    """Angles of places, in pitches from the element nearest to the middle towards its neighbour below, degree."""
    element = design.element_angles_deg[design.n_elements // 2]
    return np.asarray(element - np.asarray(places, dtype=float) * design.pitch_deg)


def _peak_strain(design: FingerDesign) -> float:
    outer = design.outer_radius_mm
    finger = Annulus(
        design.core_radius_mm / outer,
        design.sensing_radius_mm / outer,
        outer_radius_mm=outer,
        poisson_ratio=design.poisson_ratio,
        shear_modulus_MPa=design.shear_modulus_MPa,
    )
    return float(finger.strain([0.0])[1].max())
