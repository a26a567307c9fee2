"""Posterior of the shear modulus on a grid, and what it implies for anything that is a function of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bayestouch.errors import InputError

FloatArray = NDArray[np.float64]

TAU_SCALE_MM = 0.5
GRID_POINTS, TAU_POINTS = 400, 60


@dataclass(frozen=True, eq=False)
class ModulusPosterior:
    """A distribution of μ.

    Attributes
    ----------
    modulus_MPa : (k,) array
        Grid, equally spaced in log μ.
    weight : (k,) array
        Probability of each point; they sum to one.
    log_evidence : float
        Log of the mean likelihood under the prior.
    extra_sd_mm : float
        Posterior mean of τ, the independent error of each printed mean beyond what is simulated.
    """

    modulus_MPa: FloatArray
    weight: FloatArray
    log_evidence: float
    extra_sd_mm: float

    @property
    def mean_MPa(self) -> float:
        """Posterior mean."""
        return float(self.weight @ self.modulus_MPa)

    def interval(self, probability: float = 0.9) -> tuple[float, float]:
        """Equal-tailed interval, MPa."""
        low, high = self.quantile([(1 - probability) / 2, (1 + probability) / 2])
        return float(low), float(high)

    def quantile(self, probability: Sequence[float] | FloatArray) -> FloatArray:
        """Quantiles of μ, MPa."""
        below = np.concatenate([[0.0], np.cumsum(self.weight)])
        middle = (below[1:] + below[:-1]) / 2
        return np.asarray(np.exp(np.interp(probability, middle, np.log(self.modulus_MPa))))

    def implied(self, moduli_MPa: ArrayLike, values: ArrayLike, probability: float = 0.9) -> tuple[float, float, float]:
        """Mean and interval of a quantity known at some moduli, interpolated by a cubic spline in log μ."""
        from scipy.interpolate import CubicSpline

        spline = CubicSpline(np.log(np.asarray(moduli_MPa, float)), np.asarray(values, float))
        on_grid = spline(np.log(self.modulus_MPa))
        order = np.argsort(on_grid)
        below = np.cumsum(self.weight[order]) - self.weight[order] / 2
        low, high = np.interp([(1 - probability) / 2, (1 + probability) / 2], below, on_grid[order])
        return float(self.weight @ on_grid), float(low), float(high)


def infer_modulus(
    observed_mm: ArrayLike,
    emulator: Callable[[FloatArray], tuple[FloatArray, FloatArray]],
    support_MPa: tuple[float, float],
    *,
    tau_scale_mm: float = TAU_SCALE_MM,
) -> ModulusPosterior:
    """Posterior of μ from columns of radii, uniform in log μ over its support.

    Parameters
    ----------
    observed_mm : (columns, tips) array_like
        Composite radii; the columns' errors are independent of each other.
    emulator : callable
        Moduli (k,) to expected radii (k, columns, tips) and covariances (k, columns, tips, tips).
    support_MPa : (float, float)
        Ends of the prior.
    tau_scale_mm : float
        Scale of the half-normal prior of τ, the sd of a further independent error of each radius; one for all columns.

    Raises
    ------
    InputError
        If a radius is not finite.
    """
    data = np.asarray(observed_mm, dtype=float)
    if not np.all(np.isfinite(data)):
        raise InputError("radii to infer a modulus from must be finite")
    moduli = np.geomspace(*support_MPa, GRID_POINTS)
    expected, covariance = emulator(moduli)
    variance, axes = np.linalg.eigh(covariance)
    along = np.einsum("kctu,kct->kcu", axes, data - expected)
    tau = (np.arange(TAU_POINTS) + 0.5) / TAU_POINTS * 4 * tau_scale_mm
    total = np.maximum(variance, 0.0)[..., None] + tau**2
    log_likelihood = -0.5 * (along[..., None] ** 2 / total + np.log(2 * np.pi * total)).sum(axis=(1, 2))
    log_prior = -0.5 * (tau / tau_scale_mm) ** 2
    joint = log_likelihood + log_prior - np.logaddexp.reduce(log_prior)
    top = joint.max()
    mass = np.exp(joint - top)
    total_mass = float(mass.sum())
    return ModulusPosterior(
        moduli,
        mass.sum(axis=1) / total_mass,
        float(top + np.log(total_mass / GRID_POINTS)),
        float((mass * tau).sum() / total_mass),
    )
