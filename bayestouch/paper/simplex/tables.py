"""Separate fits of all elements: Table 1 of the paper."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayestouch.data.averages import TouchMeans
from bayestouch.data.sensor import Sensor, finger_of
from bayestouch.errors import InputError
from bayestouch.paper.simplex.elements import FEWEST_TOUCHES, ElementFit, fit_element
from bayestouch.paper.simplex.pressure import KnownPressure
from bayestouch.paper.simplex.summary import summary


@dataclass(frozen=True)
class ElementTable:
    """Separate fits of the elements of a finger: Table 1.

    Attributes
    ----------
    fits : tuple of ElementFit
        One for each element that could be fitted.
    contact : str or None
        Contact model; None if only knife edges were fitted.
    left_out : tuple of str
        Reasons why elements have no fit, one sentence each.
    """

    fits: tuple[ElementFit, ...]
    contact: str | None
    left_out: tuple[str, ...] = ()

    def summary(self, quantity: str) -> tuple[float, float, float]:
        """Return minimum, mean and maximum over the elements of an attribute of `ElementFit`, without NaN."""
        return summary(np.array([getattr(fit, quantity) for fit in self.fits], dtype=float))


def table_1(means: TouchMeans, sensor: Sensor, shear_modulus_MPa: float, *, contact: str | None = None) -> ElementTable:
    """Return separate fits of all elements (section 3.1).

    Parameters
    ----------
    means : TouchMeans
        Averaged calibration touches with the no-contact reading subtracted.
    sensor : Sensor
        A finger.
    shear_modulus_MPa : float
        μ; without a contact model it only scales the gains.
    contact : str, optional
        With a contact model, flats and round tips are fitted together with the edges, as in the paper's comparison
        of 4.2 % (Hertz) and 2.2 % (frictionless on the layer).

    Raises
    ------
    InputError
        If no element can be fitted.
    """
    finger = finger_of(sensor, "the simplex fit of Table 1")
    pressure = KnownPressure.of(means, finger, shear_modulus_MPa, contact)
    fits, left_out = [], []
    for element in range(finger.n_elements):
        try:
            fits.append(fit_element(means, sensor, element, shear_modulus_MPa, contact=contact, pressure=pressure))
        except InputError as error:
            left_out.append(str(error))
    if not fits:
        raise InputError(f"no element has {FEWEST_TOUCHES} known touches around it: {left_out[0]}")
    return ElementTable(tuple(fits), contact, tuple(left_out))
