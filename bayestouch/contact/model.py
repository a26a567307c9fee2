"""Protocol of the contact models of round indenters, and checks of their arguments."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray
from bayestouch.errors import InputError


class ContactModel(Protocol):
    """Contact of a rigid parabola with the finger, a function of ``κ = P R/μ`` (mm²) alone.

    P is the load in N/mm, R the composite radius in mm, μ the shear modulus in MPa. κ = 0 is a knife edge.
    """

    @property
    def name(self) -> str:
        """Name of the model in `contact_model`."""
        ...

    def half_width(self, kappa: ArrayLike) -> FloatArray:
        """Half-width a of the contact, mm along the surface; shape of `kappa`."""
        ...

    def spectrum(self, kappa: ArrayLike, modes: ArrayLike) -> FloatArray:
        """Normalised pressure spectrum ``q_k`` (``q_0 = 1``), shape ``kappa.shape + (len(modes),)``.

        ``p(θ) = P/(2π r_b) [q_0 + 2 Σ q_k cos k(θ - θ_c)]``, compression positive.
        """
        ...


def checked_kappa(kappa: ArrayLike) -> FloatArray:
    """Return `kappa` as an array; raises `InputError` if a value is negative or not finite."""
    values = np.asarray(kappa, dtype=float)
    if not np.all((values >= 0) & (values < np.inf)):
        raise InputError("load times composite radius over shear modulus must be finite and not negative")
    return values


def checked_body(core_radius_mm: float, outer_radius_mm: float, poisson_ratio: float) -> None:
    """Raise `InputError` unless ``0 < r_a < r_b`` (mm) and ``-1 < σ <= 0.5``."""
    if not 0 < core_radius_mm < outer_radius_mm < np.inf:
        raise InputError(
            f"expected 0 < core radius < outer radius, got {core_radius_mm:g} mm and {outer_radius_mm:g} mm"
        )
    checked_poisson_ratio(poisson_ratio)


def checked_poisson_ratio(poisson_ratio: float) -> None:
    """Raise `InputError` unless ``-1 < σ <= 0.5``."""
    if not -1 < poisson_ratio <= 0.5:
        raise InputError(f"Poisson's ratio must be above -1 and at most 0.5, got {poisson_ratio:g}")
