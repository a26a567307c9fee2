"""The chain of a finger with functions of place: readings from touches."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray
from bayestouch.chain.finger import FingerChain
from bayestouch.finger.place.posterior import PlacePosterior


@dataclass(frozen=True, eq=False)
class FingerWithPlaces:
    """A calibrated finger with the mean of its functions of place.

    Attributes
    ----------
    elastic : FingerChain
        The finger without functions of place.
    places : PlacePosterior
        The functions.
    """

    elastic: FingerChain
    places: PlacePosterior

    @property
    def outer_radius_mm(self) -> float:
        """``r_b``, mm."""
        return self.elastic.outer_radius_mm

    @property
    def shear_modulus_MPa(self) -> float:
        """μ, MPa."""
        return self.elastic.shear_modulus_MPa

    @property
    def angle(self) -> FloatArray:
        """``θ_s`` of the elements, rad, (m,)."""
        return self.elastic.angle

    @property
    def contact(self) -> str:
        """Name of the contact model."""
        return self.elastic.contact

    @property
    def finite_strain(self) -> float:
        """Zero: functions of place are fitted to the linear chain."""
        return 0.0

    def beyond_linear(self, radius_mm: ArrayLike, angle: ArrayLike, load: ArrayLike) -> FloatArray:
        """Zero (..., m), see `finite_strain`."""
        shape = np.broadcast_shapes(np.shape(radius_mm), np.shape(angle), np.shape(load))
        return np.zeros((*shape, self.elastic.n_elements))

    def effective_radius(self, radius_mm: FloatArray, angle: FloatArray) -> FloatArray:
        """Composite radius (...), mm, with the mean curvature of the surface at locations (...) in rad."""
        return self.places.effective_radius(radius_mm, angle, self.outer_radius_mm)

    def predict(self, radius_mm: ArrayLike, angle: ArrayLike, load: ArrayLike) -> FloatArray:
        """Return the readings (..., m) under touches of composite radius R (mm) at θ_c (rad) with load P (N/m)."""
        arrays = np.broadcast_arrays(*(np.asarray(values, dtype=float) for values in (radius_mm, angle, load)))
        radius, place, pressed = (values.ravel() for values in arrays)
        radius = self.effective_radius(radius, place)
        readings = self.elastic.predict(radius, place, pressed)
        readings = readings + self.places.readings(self.elastic, radius, place, pressed)
        return np.asarray(readings.reshape(*arrays[0].shape, -1))
