"""A second reading of the paper's "squeezing and stretching a Hertz model": a constant width taken off."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bayestouch.contact.hertz import HertzContact, elliptic_spectrum


@dataclass(frozen=True)
class SqueezedHertz:
    """Hertz pressure squeezed by a constant width, whatever the touch. A `ContactModel`.

    A cruder reading of "squeezing and stretching a Hertz model": half-width ``ratio a_Hertz - squeeze``, not below
    zero, and the height that carries the load. The two contact models of Table 3 read the same readings, so their
    columns alone show the squeeze the authors used.

    Attributes
    ----------
    hertz : HertzContact
        What is squeezed.
    squeeze_mm : float
        Taken off the half-width, mm.
    ratio : float
        Share of the half-width that is kept before.
    """

    hertz: HertzContact
    squeeze_mm: float
    ratio: float = 1.0
    name: str = "squeezed hertz"

    def half_width(self, kappa: ArrayLike) -> NDArray[np.float64]:
        """Half-width in mm, shape of `kappa` (mm²)."""
        return np.asarray(np.maximum(self.ratio * self.hertz.half_width(kappa) - self.squeeze_mm, 0.0))

    def spectrum(self, kappa: ArrayLike, modes: ArrayLike) -> NDArray[np.float64]:
        """Spectrum ``2 J_1(kβ)/(kβ)``, shape ``kappa.shape + (n_modes,)``."""
        return elliptic_spectrum(self.half_width(kappa) / self.hertz.outer_radius_mm, modes)
