"""Spectra tabulated over κ for a fixed set of modes, for loops that evaluate the contact many times.

The spectrum oscillates in ``kβ``, so the number of knots grows with the highest mode. Cubic splines in
``log(1 + β_Hertz/β_1)``, exact at κ = 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bayestouch.contact.layer import LayerContact
from bayestouch.contact.table import spline, table_coordinate
from bayestouch.errors import InputError

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class TabulatedSpectrum:
    """A `LayerContact` with its spectrum tabulated. A `ContactModel`; make it with `LayerContact.tabulated`.

    Attributes
    ----------
    layer : LayerContact
        The contact that was tabulated.
    modes : (n_modes,) array
        Fourier modes of the table.
    coordinates : (n,) array
        Knots, in `table_coordinate` of the Hertz half-angle.
    spectra : (n, n_modes) array
        ``q_k`` at the knots.
    """

    layer: LayerContact
    modes: NDArray[np.int64]
    coordinates: FloatArray
    spectra: FloatArray

    @classmethod
    def of(cls, layer: LayerContact, modes: ArrayLike, *, knots: int | None = None) -> TabulatedSpectrum:
        """Tabulate.

        Parameters
        ----------
        layer : LayerContact
            Contact to tabulate, over its whole range of κ.
        modes : (n_modes,) array_like of int
            Fourier modes.
        knots : int, optional
            By default enough for an interpolation error of 1e-5 in every ``q_k``: ``120 + 2 k β`` at the
            table's end.
        """
        wanted = np.asarray(modes, dtype=np.int64)
        if wanted.ndim != 1 or wanted.size == 0:
            raise InputError("modes must be a list of whole numbers")
        if knots is None:
            knots = 120 + int(np.ceil(2 * wanted.max() * layer.half_angles[-1]))
        hertz = layer.half_angles[-1] * np.sqrt(layer.coefficients[-1, 0])
        coordinates = np.linspace(0, float(table_coordinate(hertz)), knots)
        fraction = np.expm1(coordinates) / np.expm1(coordinates[-1])
        kappas = np.minimum(fraction**2, 1) * layer.kappas[-1]
        return cls(layer, wanted, coordinates, layer.spectrum(kappas, wanted))

    @property
    def name(self) -> str:
        """Name of the contact model."""
        return self.layer.name

    def half_width(self, kappa: ArrayLike) -> FloatArray:
        """Half-width in mm, shape of `kappa` (mm²)."""
        return self.layer.half_width(kappa)

    def spectrum(self, kappa: ArrayLike, modes: ArrayLike | None = None) -> FloatArray:
        """Spectrum ``q_k``, shape ``kappa.shape + (n_modes,)``.

        Parameters
        ----------
        kappa : array_like
            ``P R/μ`` in mm².
        modes : array_like, optional
            Must be the modes of the table.

        Raises
        ------
        InputError
            If κ is out of range or the modes are not those of the table.
        """
        if modes is not None and not np.array_equal(modes, self.modes):
            raise InputError("spectrum was tabulated for other modes")
        return np.asarray(self._spline(table_coordinate(self.layer.hertz_half_angle(kappa))))

    @cached_property
    def _spline(self) -> CubicSpline:
        return spline(self.coordinates, self.spectra)
