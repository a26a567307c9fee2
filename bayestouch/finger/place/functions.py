"""Smooth functions of place that a finger's readings may miss the model by: Gaussian processes on the circle.

Three kinds. ``map``: each element's E map errs by a function of the angle from element to load; a touch feels it
through its own pressure. ``place``: each element's readings err by a function of the place touched, whatever touches
it. ``surface``: the curvature of the surface is ``exp(f)/r_b`` with a function f of the place touched, and every touch
there has ``1/R = 1/r_c + exp(f)/r_b``. Under a flat f adds to log μ, whose effect on readings it has, so that a finger
that only flats have touched is a linear problem in both.

A process is a Fourier series with independent normal weights. On a circle these are the eigenfunctions of every
stationary process, so that length and size only change the weights' variances.

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
# Modes beyond this many over the length (rad) hold less than half a percent of the power of a Matérn 5/2 process.
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
    turn = angle[..., None] * np.arange(1, n_modes + 1)
    pairs = np.stack([np.cos(turn), np.sin(turn)], axis=-1).reshape(*angle.shape, 2 * n_modes)
    return np.concatenate([np.ones((*angle.shape, 1)), pairs], axis=-1)


def per_weight(by_mode: FloatArray) -> FloatArray:
    """Repeat values of modes (..., n + 1) for the weights of cosine and sine, (..., 2 n + 1)."""
    return np.concatenate([by_mode[..., :1], np.repeat(by_mode[..., 1:], 2, axis=-1)], axis=-1)


@dataclass(frozen=True)
class PlaceFunctions:
    """Which functions a discrepancy has.

    Attributes
    ----------
    kind : str
        Of each element's own functions, `MAP` or `PLACE`; empty without.
    own : Process or None
        Of each element's own functions.
    surface : Process or None
        Of the logarithm of the surface's curvature.
    """

    kind: str = ""
    own: Process | None = None
    surface: Process | None = None

    def own_columns(self, chain: FingerChain, radius_mm: FloatArray, angle: FloatArray, load: FloatArray) -> FloatArray:
        """Readings that each standard normal weight of an element adds to it, (t, m, k).

        For touches of composite radius R (mm), location (rad) and load (N/m), all (t,).
        """
        if self.own is None:
            return np.zeros((len(load), chain.n_elements, 0))
        n = self.own.n_modes
        through = per_weight(felt_modes(chain, self.kind, radius_mm, load, n)) * self.own.weight_sd
        columns = fourier(angle[:, None] - chain.angle, n)
        columns *= through[:, None, :]
        columns *= (load[:, None] * np.abs(chain.response))[:, :, None]
        return columns

    def surface_columns(
        self,
        chain: FingerChain,
        radius_mm: FloatArray,
        angle: FloatArray,
        load: FloatArray,
        log_curvature: FloatArray | float = 0.0,
    ) -> FloatArray:
        """Readings that each standard normal weight of the surface adds, (t, m, q).

        Arguments as of `own_columns`, but the radius is that with a curvature of ``exp(log_curvature)/r_b``.
        """
        if self.surface is None:
            return np.zeros((len(load), chain.n_elements, 0))
        weight = fourier(angle, self.surface.n_modes) * self.surface.weight_sd
        weight *= np.broadcast_to(np.exp(log_curvature) / chain.outer_radius_mm, angle.shape)[:, None]
        return np.asarray(by_curvature(chain, radius_mm, angle, load)[:, :, None] * weight[:, None, :])


def felt_modes(chain: FingerChain, kind: str, radius_mm: FloatArray, load: FloatArray, n_modes: int) -> FloatArray:
    """How much of each Fourier mode of the own functions touches feel, (t, n_modes + 1)."""
    if kind == PLACE:
        return np.ones((len(load), n_modes + 1))
    kappa = np.maximum(load / 1000 * radius_mm / chain.shear_modulus_MPa, 0.0)
    return chain.spectra.at(kappa, n_modes)


def by_curvature(chain: FingerChain, radius_mm: FloatArray, angle: FloatArray, load: FloatArray) -> FloatArray:
    """Derivative of the readings over the curvature 1/R, (t, m), reading mm; zero under an edge."""
    up, down = (chain.predict(radius_mm * np.exp(sign * STEP_LOG_RADIUS), angle, load) for sign in (1, -1))
    return np.asarray(-radius_mm[:, None] * (up - down) / (2 * STEP_LOG_RADIUS))
