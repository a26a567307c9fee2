"""Posterior of the shear modulus on a grid, and what it implies for anything that is a function of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bayestouch.errors import InputError

FloatArray = NDArray[np.float64]

TAU_SCALE_MM = 0.5
GRID_POINTS, TAU_POINTS = 200, 24


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
    extra_sd : float
        Posterior mean of τ, the error of the printed numbers beyond what is simulated.
    """

    modulus_MPa: FloatArray
    weight: FloatArray
    log_evidence: float
    extra_sd: float

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

    def updated(self, log_likelihood: ArrayLike) -> ModulusPosterior:
        """The posterior with one more, independent datum, given its log likelihood (k,) at each modulus of the grid."""
        more = np.asarray(log_likelihood, dtype=float)
        top = float(more.max())
        weight = self.weight * np.exp(more - top)
        total = float(weight.sum())
        return replace(self, weight=weight / total, log_evidence=self.log_evidence + top + float(np.log(total)))

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
    observed: ArrayLike,
    emulator: Callable[[FloatArray], tuple[FloatArray, FloatArray]],
    support_MPa: tuple[float, float],
    *,
    shared: ArrayLike | None = None,
    tau_scale: float = TAU_SCALE_MM,
) -> ModulusPosterior:
    """Posterior of μ from printed numbers, uniform in log μ over its support.

    Parameters
    ----------
    observed : (n,) array_like
        Printed numbers, such as the composite radii of one or more columns.
    emulator : callable
        Moduli (k,) to expected numbers (k, n) and the covariance of their errors (k, n, n).
    support_MPa : (float, float)
        Ends of the prior.
    shared : (n, n) array_like, optional
        Pattern of a further error of unknown variance τ²: ones where two numbers share it. By default each number has
        its own.
    tau_scale : float
        Scale of the half-normal prior of τ.

    Raises
    ------
    InputError
        If a number is not finite.
    """
    data = np.asarray(observed, dtype=float)
    if not np.all(np.isfinite(data)):
        raise InputError("numbers to infer a modulus from must be finite")
    moduli = np.geomspace(*support_MPa, GRID_POINTS)
    pattern = np.eye(len(data)) if shared is None else np.asarray(shared, dtype=float)
    expected, covariance = emulator(moduli)
    tau = (np.arange(TAU_POINTS) + 0.5) / TAU_POINTS * 3 * tau_scale
    log_prior = -0.5 * (tau / tau_scale) ** 2
    joint = np.stack([_log_normal(data - expected, covariance + t**2 * pattern) for t in tau], axis=1)
    joint += log_prior - np.logaddexp.reduce(log_prior)
    top = joint.max()
    mass = np.exp(joint - top)
    total = float(mass.sum())
    return ModulusPosterior(
        moduli,
        mass.sum(axis=1) / total,
        float(top + np.log(total / GRID_POINTS)),
        float((mass * tau).sum() / total),
    )


def _log_normal(off: FloatArray, covariance: FloatArray) -> FloatArray:
    """Log density of deviations (k, n) under normal distributions (k, n, n)."""
    factor = np.linalg.cholesky(covariance)
    white = np.linalg.solve(factor, off[..., None])[..., 0]
    log_determinant = 2 * np.log(np.diagonal(factor, axis1=-2, axis2=-1)).sum(axis=-1)
    return np.asarray(-0.5 * ((white**2).sum(axis=-1) + log_determinant + off.shape[-1] * np.log(2 * np.pi)))
