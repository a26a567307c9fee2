"""Correlation length, size and noise of the empirical map of a pad, by the marginal likelihood."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.noise import Noise
from bayestouch.chain.smooth import distances
from bayestouch.pad.noise import FLOOR_SPREAD
from bayestouch.pad.residual_map import MapDiscrepancy, matern_5_2, matern_5_2_by_length

# Largest number of touches from which the hyper-parameters are estimated: they are shared by all elements, and this
# number of touches determines a length of several spacings.
_MOST_TOUCHES = 250

# Upper bound of the noise as a share of the signal; with a larger share the noise could replace the map.
_LARGEST_SHARE = 0.1


def fit_misfit(
    base: MapDiscrepancy,
    residual: FloatArray,
    signal: FloatArray,
    counts: FloatArray,
    noise: Noise,
    *,
    spacing_mm: float,
    seed: int,
    warm: bool = False,
) -> MapDiscrepancy:
    """Discrepancy with the length, sizes and noise of the largest marginal likelihood.

    Parameters
    ----------
    base : MapDiscrepancy
        Locations, loads, amplitudes and shapes; also the starting hyper-parameters if `warm`.
    residual : (n, m) array
        Reading minus kernel, in the unit of the readings.
    signal : (n, m) array
        Expected reading minus offset.
    counts : (n, m) array
        Number of raw reads with the noise of each mean; 0 where missing.
    noise : Noise
        Noise of the readings. Its tactile noise is known from repeats; discrepancy and share of the signal are fitted
        too.
    spacing_mm : float
        Distance between neighbouring touches; the length is between half of it and the extent of the pad.
    seed : int
        Seed of the choice of touches if there are too many.
    warm : bool
        Start only from the length and the sizes of `base`.

    Returns
    -------
    MapDiscrepancy
        `base` with the fitted hyper-parameters and the variance of each reading.
    """
    from scipy.optimize import minimize

    n = len(base.location)
    chosen = np.arange(n)
    if n > _MOST_TOUCHES:
        chosen = np.sort(np.random.default_rng(seed).choice(n, _MOST_TOUCHES, replace=False))
    part = base.select(chosen)
    residual, seen, some = residual[chosen], signal[chosen], counts[chosen]
    m = residual.shape[1]
    extent = float(np.ptp(base.location, axis=0).max())
    # Length, A, B, share of the signal, common floor (over the amplitude), floor of each element over the common one.
    low = np.log(np.r_[0.5 * spacing_mm, 1e-5, 1e-5, 1e-5, 1e-6, np.full(m, 0.1)])
    high = np.log(np.r_[max(extent, spacing_mm), 10.0, 10.0, _LARGEST_SHARE, 1.0, np.full(m, 10.0)])

    def noise_at(vector: FloatArray) -> Noise:
        floor = np.exp(vector[4] + vector[5:]) * base.amplitude * float(np.median(base.load))
        return replace(noise, discrepancy_sd=floor, signal_share=float(np.exp(vector[3])))

    def at(vector: FloatArray, which: MapDiscrepancy, counts: FloatArray, signal: FloatArray) -> MapDiscrepancy:
        length, misfit, relative = np.exp(vector[:3])
        return replace(
            which,
            length_mm=float(length),
            misfit=float(misfit),
            relative=float(relative),
            variance=noise_at(vector).mean_variance(counts, signal),
        )

    def cost(vector: FloatArray) -> tuple[float, FloatArray]:
        value, gradient = _evidence(at(vector, part, some, seen), residual, seen, noise_at(vector))
        departure = vector[5:] / FLOOR_SPREAD
        gradient[5:] -= departure / FLOOR_SPREAD
        return 0.5 * float(departure @ departure) - value, -gradient

    solutions = [
        minimize(
            cost,
            np.clip(np.r_[np.log(start), np.zeros(m)], low, high),
            jac=True,
            method="L-BFGS-B",
            bounds=list(zip(low, high, strict=True)),
            options={"maxiter": 60, "ftol": 1e-7},
        )
        for start in _starts(base, spacing_mm, warm)
    ]
    best = min(solutions, key=lambda each: float(each.fun))
    return at(np.asarray(best.x), base, counts, signal)


def _starts(base: MapDiscrepancy, spacing_mm: float, warm: bool) -> tuple[tuple[float, ...], ...]:
    """Starting values of length, A, B, share of the signal, floor."""
    if warm:
        return ((base.length_mm, base.misfit, base.relative, 0.003, 0.005),)
    length = 3 * spacing_mm
    if np.ptp(base.shape) == 0:
        # Without a kernel the map is the whole signal.
        return ((length, 0.3, 0.01, 0.01, 0.005), (length, 0.3, 0.01, 0.001, 0.001))
    # Errors near the peaks may be fitted as noise or as a part of the map: one start for each.
    return ((length, 0.01, 0.01, 0.01, 0.005), (length, 0.01, 0.1, 0.001, 0.005))


@dataclass(frozen=True, eq=False)
class _Inverse:
    """Log density of errors with a covariance C, and its derivatives.

    Attributes
    ----------
    log_density : float
        Up to a constant.
    weights : (n,) array
        ``C⁻¹`` times the errors.
    precision : (n, n) array
        Lower triangle of ``C⁻¹``; zero above.
    """

    log_density: float
    weights: FloatArray
    precision: FloatArray

    @classmethod
    def of(cls, covariance: FloatArray, variance: FloatArray, errors: FloatArray) -> _Inverse:
        """Of the errors (n,), from a part (n, n) of their covariance, which is overwritten, and independent variances.

        Raises
        ------
        numpy.linalg.LinAlgError
            The covariance is not positive definite.
        """
        from scipy.linalg.lapack import dpotrf, dpotri, dpotrs

        np.einsum("ii->i", covariance)[:] += variance
        # Rows of C are columns for LAPACK: its upper triangle is the lower one here.
        root, failed = dpotrf(covariance.T, lower=0, clean=1, overwrite_a=1)
        if failed:
            raise np.linalg.LinAlgError("the covariance is not positive definite")
        weights, _ = dpotrs(root, errors, lower=0)
        log_density = -0.5 * float(errors @ weights) - float(np.log(np.diag(root)).sum())
        precision, _ = dpotri(root, lower=0, overwrite_c=1)
        return cls(log_density, weights, precision.T)

    def slope(self, change: FloatArray) -> float:
        """Twice the derivative of the log density along a symmetric change (n, n) of the covariance."""
        trace = 2 * np.vdot(self.precision, change) - np.diag(self.precision) @ np.diag(change)
        return float(self.weights @ change @ self.weights - trace)


def _evidence(
    misfit: MapDiscrepancy, residual: FloatArray, signal: FloatArray, noise: Noise
) -> tuple[float, FloatArray]:
    """Log marginal likelihood, up to a constant, and its gradient over the logarithms used in `fit_misfit`."""
    r = distances(misfit.location, misfit.location) / misfit.length_mm
    rho, by_length = matern_5_2(r), matern_5_2_by_length(r)
    loads = misfit.load[:, None] * misfit.load
    rho, by_length = rho * loads, by_length * loads
    m = len(misfit.amplitude)
    value, gradient = 0.0, np.zeros(5 + m)
    for e in range(m):
        here = misfit.present[:, e]
        if not here.any():
            continue
        # of an element that read all touches, no copy
        correlation, longer = (each if here.all() else each[np.ix_(here, here)] for each in (rho, by_length))
        even = (misfit.misfit * misfit.amplitude[e]) ** 2
        share = misfit.relative * misfit.amplitude[e] * misfit.shape[here, e]
        of_even, of_share = even * correlation, share[:, None] * correlation * share
        found = _Inverse.of(of_even + of_share, misfit.variance[here, e], residual[here, e])
        value += found.log_density
        gradient[0] += 0.5 * (even * found.slope(longer) + found.slope(share[:, None] * longer * share))
        gradient[1] += found.slope(of_even)
        gradient[2] += found.slope(of_share)
        diagonal = found.weights**2 - np.diag(found.precision)
        of_floor = float(diagonal.sum() * noise.discrepancy_sd[e] ** 2)
        gradient[3] += float(diagonal @ (noise.signal_share * signal[here, e]) ** 2)
        gradient[4] += of_floor
        gradient[5 + e] += of_floor
    return value, gradient
