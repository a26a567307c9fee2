"""A finger with an identified E map: the "empirical calibration" of Tables 3 and 4 of the paper."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray
from bayestouch.body.emap import traction_coefficients
from bayestouch.chain.response import KAPPA_KNOTS
from bayestouch.contact import contact_model
from bayestouch.data.sensor import Sensor, finger_of
from bayestouch.paper.simplex.empirical import EmpiricalTable


@dataclass(frozen=True, eq=False)
class EmpiricalFinger:
    """A finger with an identified E map, for reading touches; a `TouchPredictor`.

    Attributes
    ----------
    outer_radius_mm, shear_modulus_MPa, largest_load : float
        ``r_b``, μ of the contact model, and the largest load in N/m that can be predicted.
    angle : (m,) array
        ``θ_s`` as designed, rad.
    response : (m,) array
        Largest reading per N/m of a knife edge over all locations.
    map : (m, 2 n_c + 1) array
        E, readings per MPa of the traction coefficients.
    kappa_scale, coordinates, spectra
        Contact spectra over κ, as in `bayestouch.chain.response.ContactSpectra`.
    """

    outer_radius_mm: float
    shear_modulus_MPa: float
    largest_load: float
    angle: FloatArray
    response: FloatArray
    map: FloatArray
    kappa_scale: float
    coordinates: FloatArray
    spectra: FloatArray

    @classmethod
    def of(
        cls,
        table: EmpiricalTable,
        sensor: Sensor,
        *,
        shear_modulus_MPa: float,
        poisson_ratio: float,
        largest_load: float,
        contact: str = "layer",
    ) -> EmpiricalFinger:
        """Return the finger with an identified map and a contact model."""
        finger = finger_of(sensor, "the empirical map of Table 2")
        scale = 0.1 * (finger.outer_radius_mm - finger.core_radius_mm) ** 2
        largest_kappa = largest_load / 1000 * finger.outer_radius_mm / shear_modulus_MPa
        coordinates = np.linspace(0.0, np.log1p(largest_kappa / scale), KAPPA_KNOTS)
        model = contact_model(contact, (finger.core_radius_mm, finger.outer_radius_mm), poisson_ratio)
        modes = np.arange(table.map.shape[1] // 2 + 1)
        return cls(
            outer_radius_mm=finger.outer_radius_mm,
            shear_modulus_MPa=shear_modulus_MPa,
            largest_load=largest_load,
            angle=np.radians(finger.element_angles_deg),
            response=table.response,
            map=table.map,
            kappa_scale=scale,
            coordinates=coordinates,
            spectra=model.spectrum(np.expm1(coordinates) * scale, modes),
        )

    @property
    def gain(self) -> FloatArray:
        """Reading per unit of relative strain (1 at the peak), shape (m,)."""
        return self.response

    def predict(self, radius_mm: ArrayLike, angle: ArrayLike, load: ArrayLike) -> FloatArray:
        """Return the readings (..., m) under touches of composite radius R (mm) at θ_c (rad) with P (N/m)."""
        radius, theta, newtons = np.broadcast_arrays(
            np.asarray(radius_mm, float), np.asarray(angle, float), np.asarray(load, float)
        )
        kappa = newtons.ravel() / 1000 * radius.ravel() / self.shear_modulus_MPa
        place = np.log1p(np.maximum(kappa, 0.0) / self.kappa_scale) / self.coordinates[1]
        place = np.minimum(place, len(self.coordinates) - 1 - 1e-9)
        row = place.astype(np.int64)
        upper = (place - row)[:, None]
        spectrum = (1 - upper) * self.spectra[row] + upper * self.spectra[row + 1]
        p = traction_coefficients(
            spectrum,
            np.degrees(theta.ravel()),
            newtons.ravel() / 1000,
            outer_radius_mm=self.outer_radius_mm,
        )
        return np.asarray((self.map @ p).T.reshape(*radius.shape, len(self.map)))
