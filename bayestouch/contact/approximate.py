"""The paper's "approximate frictionless contact model": a Hertz pressure squeezed to the true width.

Nicolson and Fearing (1995), section 4, "approximated it by squeezing and stretching a Hertz model" and made
Table 3 and all later results with it. Squeezed: the ellipse gets the half-width that the bonded layer gives.
Stretched: its height is increased so that it carries the same load. On the paper's finger the spectrum is within 0.3 %
of the exact one for any round indenter at P/μ = 2/3 mm, and within 2.2 % at 4 mm (where Hertz is 25 % off).
The paper does not print the details; this is the only ellipse with the given width and load.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bayestouch.contact.hertz import elliptic_spectrum
from bayestouch.contact.layer import LayerContact


@dataclass(frozen=True)
class ApproximateFrictionless:
    """Elliptic pressure on the contact width of the bonded layer. A `ContactModel`.

    Attributes
    ----------
    layer : LayerContact
        The exact contact, which determines the half-width.
    """

    layer: LayerContact
    name: str = "approximate frictionless"

    def half_width(self, kappa: ArrayLike) -> NDArray[np.float64]:
        """Half-width in mm, shape of `kappa` (mm²)."""
        return self.layer.half_width(kappa)

    def spectrum(self, kappa: ArrayLike, modes: ArrayLike) -> NDArray[np.float64]:
        """Spectrum ``2 J_1(kβ)/(kβ)`` at the layer's half-angle β, shape ``kappa.shape + (n_modes,)``."""
        return elliptic_spectrum(self.layer.half_angle(kappa), modes)
