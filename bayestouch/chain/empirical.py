"""The measuring chain of a finger with an identified E map: readings from touches.

Only the contact is computed from elasticity. The map from pressure to readings is a matrix E with one row of
``2 n_c + 1`` numbers per element, in the order and units of `bayestouch.body.emap`: readings per MPa of the traction
coefficients ``p_0, p_1^s, p_1^c, …`` (tension positive), equations (1) and (2) of Nicolson and Fearing (1995) with the
gain in E.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bayestouch.array_types import FloatArray
from bayestouch.body.emap import fourier_basis, per_coefficient, traction_coefficients
from bayestouch.chain.finger import FingerChain
from bayestouch.chain.response import ContactSpectra, ResponseTable
from bayestouch.errors import InputError


def modes_of(chain: FingerChain) -> int:
    """Highest Fourier mode n_c in the sums of an elastic finger."""
    return int(chain.spectra.body.modes[-1])


def elastic_amplitudes(chain: FingerChain, n_coefficients: int) -> NDArray[np.complex128]:
    """Response of each element to the modes ``0 … n_c`` of the traction, readings per MPa, shape (m, n_c + 1).

    Negative if a compressed element reads positive, because traction is tension positive. Real without friction, see
    `bayestouch.chain.response.mode_strain`.
    """
    strain = chain.mode_strain
    if n_coefficients >= strain.shape[1]:
        raise InputError(f"this finger sums Fourier modes up to {strain.shape[1] - 1}, got n_c = {n_coefficients}")
    # The response is the reading per N/m of a knife edge above the element; a line load excites all modes equally.
    peak = strain[:, :1].real + 2 * strain[:, 1:].real.sum(axis=1, keepdims=True)
    line = 2 * np.pi * chain.outer_radius_mm * 1000
    return np.asarray(-line * chain.response[:, None] / peak * strain[:, : n_coefficients + 1])


def elastic_e_matrix(chain: FingerChain, n_coefficients: int) -> FloatArray:
    """E of an elastic finger, readings per MPa of the traction coefficients, shape (m, 2 n_c + 1).

    What is not in proportion to the pressure (`FingerChain.beyond_linear`) is no part of it.
    """
    amplitudes = elastic_amplitudes(chain, n_coefficients)
    basis = fourier_basis(np.degrees(chain.angle), n_coefficients)
    e_matrix = per_coefficient(amplitudes.real) * basis
    if chain.friction:
        # An imaginary amplitude turns a mode by a quarter of its wave: sines become cosines, cosines minus sines.
        turned = np.zeros_like(basis)
        turned[:, 1::2], turned[:, 2::2] = basis[:, 2::2], -basis[:, 1::2]
        e_matrix = e_matrix + per_coefficient(amplitudes.imag) * turned
    return np.asarray(e_matrix)


def pressure_matrix(
    chain: FingerChain, radius_mm: ArrayLike, angle: ArrayLike, load: ArrayLike, n_coefficients: int
) -> FloatArray:
    """Traction coefficients of touches under the contact of an elastic finger: ``Pᵀ`` of the paper.

    Parameters
    ----------
    chain : FingerChain
        Finger of which the contact model, σ and μ are used.
    radius_mm, angle, load : (t,) array_like
        Composite radius R (mm), location (rad), line load (N/m).
    n_coefficients : int
        n_c.

    Returns
    -------
    (t, 2 n_c + 1) array
        MPa, tension positive.
    """
    load, radius = np.asarray(load, dtype=float), chain.effective_radius(radius_mm, angle)
    kappa = np.maximum(load / 1000 * radius / chain.shear_modulus_MPa, 0.0)
    # Interpolated as in `ResponseTable`, so that both give the same prediction.
    spectrum = chain.spectra.at(kappa, n_coefficients)
    return traction_coefficients(spectrum, np.degrees(angle), load / 1000, outer_radius_mm=chain.outer_radius_mm).T


@dataclass(frozen=True, eq=False)
class EmpiricalFingerChain:
    """A finger with an identified E map; it predicts as `bayestouch.chain.finger.FingerChain` does.

    Attributes
    ----------
    elastic : FingerChain
        The elastic finger of which geometry and contact (model, σ, μ) are used, but not its E.
    e_matrix : (m, 2 n_c + 1) array
        E, readings per MPa of the traction coefficients.
    """

    elastic: FingerChain
    e_matrix: FloatArray

    @property
    def n_elements(self) -> int:
        """Number of elements."""
        return len(self.e_matrix)

    @property
    def n_coefficients(self) -> int:
        """Highest Fourier coefficient n_c."""
        return int(self.e_matrix.shape[1]) // 2

    @property
    def outer_radius_mm(self) -> float:
        """``r_b``, mm."""
        return self.elastic.outer_radius_mm

    @property
    def shear_modulus_MPa(self) -> float:
        """μ of the contact, MPa."""
        return self.elastic.shear_modulus_MPa

    @property
    def contact(self) -> str:
        """Name of the contact model."""
        return self.elastic.contact

    @property
    def angle(self) -> FloatArray:
        """``θ_s`` of the elastic fit, rad, (m,): angle of the largest reading, roughly; not used in predictions."""
        return self.elastic.angle

    @property
    def offset(self) -> FloatArray:
        """Reading without touch, (m,)."""
        return self.elastic.offset

    @property
    def finite_strain(self) -> float:
        """Fraction of the finite strain of the elastic finger in `predict`."""
        return self.elastic.finite_strain

    def effective_radius(self, radius_mm: ArrayLike, angle: ArrayLike) -> FloatArray:
        """Return the composite radius (...) in mm on the surface as it is, see `FingerChain.effective_radius`."""
        return self.elastic.effective_radius(radius_mm, angle)

    @property
    def spectra(self) -> ContactSpectra:
        """Pressure spectra of the contact."""
        return self.elastic.spectra

    @cached_property
    def response(self) -> FloatArray:
        """Reading per N/m of a knife edge at the angle of the element, (m,)."""
        unit = pressure_matrix(
            self.elastic, np.zeros(self.n_elements), self.angle, np.ones(self.n_elements), self.n_coefficients
        )
        return np.asarray(np.einsum("ek,ek->e", unit, self.e_matrix))

    @cached_property
    def mode_weights(self) -> NDArray[np.complex128]:
        """``w_k``, (m, n_c + 1): reading under 1 N/m at θ_c is ``Re Σ_k d_k q_k w_k exp(-i k θ_c)``.

        ``d_0 = 1`` and ``d_k = 2``, as in a real inverse Fourier transform over ``-θ_c``.
        """
        e = self.e_matrix
        cosine = np.concatenate([e[:, :1], e[:, 2::2]], axis=1)
        sine = np.concatenate([np.zeros((len(e), 1)), e[:, 1::2]], axis=1)
        return np.asarray(-(cosine + 1j * sine) / (2 * np.pi * self.outer_radius_mm * 1000))

    @cached_property
    def table(self) -> ResponseTable:
        """Table of the reading divided by `response`, over κ and the angle from touch to element."""
        modes = np.arange(self.n_coefficients + 1)
        turned = self.mode_weights * np.exp(-1j * modes * self.angle[:, None]) / self.response[:, None]
        # The same resolution as in the table of an elastic finger.
        n_angles = 1 << int(np.ceil(np.log2(max(512, 4 * modes[-1]))))
        weights = turned[:, None, :] * self.spectra.spectra[:, : len(modes)]
        values = np.fft.irfft(weights, n=n_angles) * n_angles
        slopes = np.fft.irfft(1j * modes * weights, n=n_angles) * (2 * np.pi)
        return ResponseTable(
            self.spectra.kappa_scale, self.spectra.coordinates, values, slopes, np.ones(self.n_elements)
        )

    def predict(self, radius_mm: ArrayLike, angle: ArrayLike, load: ArrayLike) -> FloatArray:
        """Return the readings (..., m) under touches of composite radius R (mm) at θ_c (rad) with load P (N/m)."""
        return self.elastic.readings(self.table, self.response, radius_mm, angle, load)

    def series(self, radius_mm: ArrayLike, angle: ArrayLike, load: ArrayLike) -> FloatArray:
        """Signals (t, m), as `predict` without `offset`, of touches (t,), by the sum over modes: no table is made."""
        linear = pressure_matrix(self.elastic, radius_mm, angle, load, self.n_coefficients) @ self.e_matrix.T
        return linear + self.beyond_linear(radius_mm, angle, load) if self.finite_strain else np.asarray(linear)

    def beyond_linear(self, radius_mm: ArrayLike, angle: ArrayLike, load: ArrayLike) -> FloatArray:
        """Part of the readings due to finite strain, which E does not hold: that of the elastic finger, (..., m)."""
        return self.elastic.beyond_linear(radius_mm, angle, load)
