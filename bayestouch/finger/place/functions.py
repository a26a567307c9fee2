"""Model error of a finger as smooth functions of place (the location of a touch): Gaussian processes on the circle.

There are three kinds. ``map``: the error of the E map of each element is a function of the angle from element to load;
the pressure of a touch smooths it. ``place``: the error of the readings of each element is a function of the location,
the same for all indenters. ``surface``: the curvature of the surface is ``exp(f)/r_b`` with a function f of the
location, so that ``1/R = 1/r_c + exp(f)/r_b``. Under a flat, f has the same effect on the readings as an addition to
log μ.

A process is a Fourier series with independent normal weights. Its terms are the eigenfunctions of every stationary
process on the circle; length and size of the process only change the variances of the weights.

Source: A. Solin and S. Särkkä (2020), Statistics and Computing 30, doi:10.1007/s11222-019-09886-w (Gaussian processes
by series of eigenfunctions); M. C. Kennedy and A. O'Hagan (2001), doi:10.1111/1467-9868.00294 (discrepancy).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.finger import FingerChain

#: Kinds of functions that each element has of its own.
MAP, PLACE = "map", "place"
# Highest mode times the length (rad): higher modes have less than 0.5 % of the variance of a Matérn 5/2 process.
MODES_A_LENGTH = 5.0
# Step of the derivative over log R.
STEP_LOG_RADIUS = 0.02


@dataclass(frozen=True)
class Process:
    """A stationary process on the circle with Matérn 5/2 correlation.

    Attributes
    ----------
    length_deg : float
        Correlation length, degree.
    sd : float
        Standard deviation: share of the peak response, or of the logarithm of the curvature.
    """

    length_deg: float
    sd: float

    @property
    def n_modes(self) -> int:
        """Highest Fourier mode."""
        return process_modes(self.length_deg)

    @property
    def weight_sd(self) -> FloatArray:
        """Standard deviation of each weight, (2 n_modes + 1,), in the order of `fourier`."""
        return self.sd * np.sqrt(spectrum(self.length_deg))


def process_modes(length_deg: float) -> int:
    """Highest Fourier mode of a process of this length."""
    return int(np.ceil(MODES_A_LENGTH / np.radians(length_deg)))


def spectrum(length_deg: float) -> FloatArray:
    """Variances of the weights of a process of variance one, in the order of `fourier`."""
    modes = np.arange(process_modes(length_deg) + 1)
    power = (1 + (modes * np.radians(length_deg)) ** 2 / 5) ** -3.0
    power[0] /= 2
    power /= power.sum()
    return np.asarray(np.repeat(power, np.where(modes == 0, 1, 2)))


def fourier(angle: FloatArray, n_modes: int) -> FloatArray:
    """``1, cos x, sin x, cos 2x, …`` of angles in rad, (...) to (..., 2 n_modes + 1)."""
    # Powers of exp(ix): a product for each mode in place of a cosine and a sine, which take five times as long.
    turn = np.broadcast_to(np.exp(1j * angle)[..., None], (*angle.shape, n_modes))
    values = np.ones((*angle.shape, 2 * n_modes + 1))
    values[..., 1:] = np.multiply.accumulate(turn, axis=-1).view(np.float64)
    return values


def turned_back(weights: FloatArray, angle: FloatArray) -> FloatArray:
    """Weights (m, 2 n + 1) of functions of ``x - angle`` as weights of functions of x, in the order of `fourier`.

    `angle` (m,) is in rad.
    """
    n_modes = weights.shape[1] // 2
    pairs = np.ascontiguousarray(weights[:, 1:]).view(np.complex128)
    moved = pairs * np.exp(1j * angle[:, None] * np.arange(1, n_modes + 1))
    return np.concatenate([weights[:, :1], moved.view(np.float64)], axis=1)


def per_weight(by_mode: FloatArray) -> FloatArray:
    """Repeat values of modes (..., n + 1) for the weights of cosine and sine, (..., 2 n + 1)."""
    return np.concatenate([by_mode[..., :1], np.repeat(by_mode[..., 1:], 2, axis=-1)], axis=-1)


@dataclass(frozen=True)
class PlaceFunctions:
    """The functions of a discrepancy.

    Attributes
    ----------
    kind : str
        Kind of the own functions of the elements, `MAP` or `PLACE`; empty if there are none.
    own : Process or None
        Process of the own functions of each element.
    surface : Process or None
        Process of the logarithm of the curvature of the surface.
    """

    kind: str = ""
    own: Process | None = None
    surface: Process | None = None

    def own_columns(self, chain: FingerChain, radius_mm: FloatArray, angle: FloatArray, load: FloatArray) -> FloatArray:
        """Change of the readings of each element for each of its standard normal weights, (t, m, k).

        For touches of composite radius R (mm), location (rad) and load (N/m), all (t,).
        """
        if self.own is None:
            return np.zeros((len(load), chain.n_elements, 0))
        columns = fourier(angle[:, None] - chain.angle, self.own.n_modes)
        columns *= self._felt(self.own, chain, radius_mm, load)[:, None, :]
        columns *= (load[:, None] * np.abs(chain.response))[:, :, None]
        return columns

    def own_readings(
        self, chain: FingerChain, radius_mm: FloatArray, angle: FloatArray, load: FloatArray, weights: FloatArray
    ) -> FloatArray:
        """Change of the readings (t, m) by own functions of weights (m, k): `own_columns` times them.

        It takes the functions at the location only, and not at the angles between location and elements.
        """
        if self.own is None:
            return np.zeros((len(load), chain.n_elements))
        felt = fourier(angle, self.own.n_modes) * self._felt(self.own, chain, radius_mm, load)
        return np.asarray(felt @ turned_back(weights, chain.angle).T * (load[:, None] * np.abs(chain.response)))

    def _felt(self, own: Process, chain: FingerChain, radius_mm: FloatArray, load: FloatArray) -> FloatArray:
        """Standard deviation of each own weight as a touch of this radius and load feels it, (t, k)."""
        return per_weight(felt_modes(chain, self.kind, radius_mm, load, own.n_modes)) * own.weight_sd

    def surface_columns(
        self,
        chain: FingerChain,
        radius_mm: FloatArray,
        angle: FloatArray,
        load: FloatArray,
        log_curvature: FloatArray | float = 0.0,
    ) -> FloatArray:
        """Change of the readings for each standard normal weight of the surface, (t, m, q).

        Parameters are as in `own_columns`; the radius is that with the curvature ``exp(log_curvature)/r_b``.
        """
        if self.surface is None:
            return np.zeros((len(load), chain.n_elements, 0))
        weight = fourier(angle, self.surface.n_modes) * self.surface.weight_sd
        weight *= np.broadcast_to(np.exp(log_curvature) / chain.outer_radius_mm, angle.shape)[:, None]
        return np.asarray(by_curvature(chain, radius_mm, angle, load)[:, :, None] * weight[:, None, :])


def felt_modes(chain: FingerChain, kind: str, radius_mm: FloatArray, load: FloatArray, n_modes: int) -> FloatArray:
    """Factor by which the pressure of each touch reduces each Fourier mode of the own functions, (t, n_modes + 1)."""
    if kind == PLACE:
        return np.ones((len(load), n_modes + 1))
    kappa = np.maximum(load / 1000 * radius_mm / chain.shear_modulus_MPa, 0.0)
    return chain.spectra.at(kappa, n_modes)


def by_curvature(chain: FingerChain, radius_mm: FloatArray, angle: FloatArray, load: FloatArray) -> FloatArray:
    """Derivative of the readings over the curvature 1/R, (t, m), reading mm; zero under an edge."""
    up, down = (chain.predict(radius_mm * np.exp(sign * STEP_LOG_RADIUS), angle, load) for sign in (1, -1))
    return np.asarray(-radius_mm[:, None] * (up - down) / (2 * STEP_LOG_RADIUS))
