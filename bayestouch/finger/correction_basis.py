"""Basis of the empirical correction of a finger: smooth functions of the angle from element to touch, and of the load.

It has five parts. Three are proportional to the load P: a function shared by all elements; an error of the E map of
each element, which the pressure of a touch smooths; and a function for each element that is the same for all indenters.
The fourth is a shared function proportional to P² R, since contacts widen with P R. The fifth is a function for each
element for errors that are not proportional to the load.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.finger import FingerChain
from bayestouch.chain.recording import Recording
from bayestouch.chain.smooth import SmoothBasis
from bayestouch.finger.felt_map import FeltMap
from bayestouch.model.fitting import spread_over_elements

# Correlation lengths of the functions, degree: features of the strain are about 10° wide.
SHARED_LENGTH, OWN_LENGTH, WIDE_LENGTH = 5.0, 9.0, 7.0
# Range about an element, degree, of the function for errors that are not proportional to the load.
LOADED_REACH = 30.0
# This function is left out if the relative standard deviation of the loads is smaller.
LEAST_LOAD_SD = 0.02


@dataclass(frozen=True, eq=False)
class FingerCorrectionBasis:
    """Basis of the correction for one finger.

    Attributes
    ----------
    element_deg : (m,) array
        Angles of the elements, degree.
    peak : (m,) array
        Absolute reading of each element under the reference load.
    reference_load : float
        Reference load, N/m.
    widest : float
        R of a flat, mm, the unit of R in the part that depends on P R.
    load_mean, load_sd : float
        Mean and sd of the loads over the reference load. The last part of the basis is zero at the mean load.
    shared, wide, loaded : SmoothBasis
        Functions of the angle from element to touch, degree.
    own : tuple of SmoothBasis
        Functions of this angle for each element, over the angles of its touches.
    felt : FeltMap
        Errors of each element's E map, on the whole circle.
    """

    element_deg: FloatArray
    peak: FloatArray
    reference_load: float
    widest: float
    load_mean: float
    load_sd: float
    shared: SmoothBasis
    wide: SmoothBasis
    loaded: SmoothBasis
    own: tuple[SmoothBasis, ...]
    felt: FeltMap

    @classmethod
    def of(
        cls,
        element_deg: FloatArray,
        peak: FloatArray,
        reference_load: float,
        chain: FingerChain,
        recording: Recording,
    ) -> FingerCorrectionBasis:
        """Basis over the angles that the touches of a recording cover."""
        angle, share = recording.place[0], recording.load / reference_load
        low, high = float(angle.min()), float(angle.max())
        return cls(
            element_deg=element_deg,
            peak=peak,
            reference_load=reference_load,
            widest=chain.outer_radius_mm,
            load_mean=float(share.mean()),
            load_sd=float(share.std()),
            shared=SmoothBasis.of(low - element_deg.max(), high - element_deg.min(), SHARED_LENGTH, most=90),
            wide=SmoothBasis.of(low - element_deg.max(), high - element_deg.min(), WIDE_LENGTH, most=60),
            loaded=SmoothBasis.of(-LOADED_REACH, LOADED_REACH, OWN_LENGTH),
            own=_over_the_same_range(low - element_deg, high - element_deg),
            felt=FeltMap.of(chain, OWN_LENGTH, float(recording.load.max())),
        )

    def columns(self, *where: FloatArray) -> dict[str, FloatArray]:
        """Change of the readings per unit weight, by name of the part.

        `where` is composite radius (mm), location (degree) and load (N/m) of the touches, all (t,). The arrays are
        (k, t, m), for size 1.
        """
        radius, angle, load = where
        away, share = angle[:, None] - self.element_deg, load / self.reference_load
        scale = share[:, None] * self.peak
        own = np.stack([basis(away[:, e]) for e, basis in enumerate(self.own)], axis=-1)
        felt = self.felt(radius, load, away)
        parts = {
            "shared": spread_over_elements(np.moveaxis(self.shared(away), -1, 0), scale, own=False),
            "map": spread_over_elements(np.moveaxis(felt, -1, 0), scale, own=True),
            "own": spread_over_elements(np.moveaxis(own, 1, 0), scale, own=True),
            "wide": spread_over_elements(
                np.moveaxis(self.wide(away), -1, 0), scale * (radius / self.widest * share)[:, None], own=False
            ),
        }
        if self.load_sd > LEAST_LOAD_SD:
            more = ((share - self.load_mean) / self.load_sd)[:, None]
            parts["loaded"] = spread_over_elements(np.moveaxis(self.loaded(away), -1, 0), scale * more, own=True)
        return parts


def _over_the_same_range(low: FloatArray, high: FloatArray) -> tuple[SmoothBasis, ...]:
    """A function for each element over its range of angles (m,), all with the same number of knots.

    The ranges have the same width up to rounding, which changes the number where the width is a multiple of the spacing
    of knots. Then all elements have the larger number.
    """
    alone = [SmoothBasis.of(*ends, OWN_LENGTH) for ends in zip(low, high, strict=True)]
    count = max(len(each.knots) for each in alone)
    return tuple(SmoothBasis.of(*ends, OWN_LENGTH, least=count) for ends in zip(low, high, strict=True))
