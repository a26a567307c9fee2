"""Noise of a pad by maximum likelihood, from predictions of readings that are left out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray
from bayestouch.chain.noise import Noise
from bayestouch.pad.added_noise import NoiseByEffects
from bayestouch.sampling.rank_one import DiagonalPlusRankOne, shared_directions

# Prior sd of the logarithm of each element's noise over the common one (a factor 1.6): equal elements are similar.
FLOOR_SPREAD = 0.5
# Shares in proportion to the signal at which the fit starts. From one of them alone it may end in a maximum that is
# lower by a hundred nats (tests/pad/test_noise.py). In 263 fits to the eight channels in studies/data the better
# of these two was the best of seven starts.
START_SHARES = (0.3, 0.01)
# Shared error over the load at which the fit starts.
START_ERROR = 0.01


@dataclass(frozen=True, eq=False)
class LeftOut:
    """Predictions of each reading from all others, or from all other blocks of touches; n touches, m elements.

    Attributes
    ----------
    residual : (n, m) array
        Reading minus prediction; NaN missing.
    variance : (n, m) array
        Variance of the prediction, without the noise of the reading itself.
    signal : (n, m) array
        Expected reading minus offset.
    counts : (n, m) array
        Number of raw reads with the noise of each mean.
    load : (n,) array
        Loads; all are 1 if none was measured.
    load_share : (n,) array
        Standard error of each measured load, over the load; NaN if loads were not measured (then it is estimated).
    """

    residual: FloatArray
    variance: FloatArray
    signal: FloatArray
    counts: FloatArray
    load: FloatArray
    load_share: FloatArray

    def load_errors(self, noise: Noise, load_spread: float) -> FloatArray:
        """Standard deviation of the error that the readings of a touch share, over its load, (n,)."""
        return shared_load_errors(self.load_share, self.load, noise, load_spread)


def shared_load_errors(load_share: FloatArray, load: FloatArray, noise: Noise, load_spread: float) -> FloatArray:
    """Standard deviation of the error that the readings of each touch share, over its load, (n,).

    Of a measured load it is its standard error `load_share` and the load scatter, else `load_spread`.
    """
    return np.where(np.isnan(load_share), load_spread, np.hypot(load_share, noise.load_scatter / load))


def left_out_density(left_out: LeftOut, noise: Noise, load_spread: float) -> FloatArray:
    """Joint log predictive density of the readings of each touch, shape (n,).

    An error of the load changes all readings of a touch in proportion to their signal v: the covariance is
    ``diag(sd² + variance) + s² v vᵀ``, s from `shared_load_errors`, and ``Σ c cᵀ`` of the errors c of
    `Noise.shared_errors`.
    """
    return _density_with_slopes(left_out, noise, load_spread)[0]


def _density_with_slopes(
    left_out: LeftOut, noise: Noise, load_spread: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """`left_out_density` (n,), and its derivatives over the variance of each reading (n, m) and over ln s (n,)."""
    here = np.isfinite(left_out.residual)
    sd2 = noise.own_sd(left_out.counts, np.where(here, left_out.signal, 0.0)) ** 2
    diagonal = np.where(here, sd2 + left_out.variance, 1.0)
    errors = left_out.load_errors(noise, load_spread)
    by_load = np.where(here, errors[:, None] * left_out.signal, 0.0)
    residual = np.where(here, left_out.residual, 0.0)
    shared = noise.shared_errors(left_out.counts)
    if len(shared):
        return _with_shared_errors(here, diagonal, by_load, residual, np.moveaxis(shared, 0, 1))
    covariance = DiagonalPlusRankOne(np.sqrt(diagonal), by_load)
    square, grown = covariance.squared_distance(residual), 1 + covariance.length2
    logs = np.log(diagonal).sum(axis=1) + np.log(grown) + here.sum(axis=1) * np.log(2 * np.pi)
    # Inverse covariance times residual, and its diagonal.
    load_weight = by_load / diagonal
    along = (load_weight * residual).sum(axis=1) / grown
    weighted = residual / diagonal - load_weight * along[:, None]
    precision = 1 / diagonal - load_weight**2 / grown[:, None]
    by_variance = np.where(here, 0.5 * (weighted**2 - precision), 0.0)
    by_spread = along**2 - covariance.length2 / grown
    return np.asarray(-0.5 * (square + logs)), by_variance, by_spread


def _with_shared_errors(
    here: BoolArray, diagonal: FloatArray, by_load: FloatArray, residual: FloatArray, shared: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """`_density_with_slopes` with errors (n, q, m) that elements share; of variances, errors of the load, residuals."""
    directions, log_grown = shared_directions(
        np.where(here, 1 / diagonal, 0.0), np.concatenate([shared, by_load[:, None]], axis=1)
    )
    along = np.einsum("nqm,nm->nq", directions, residual)
    weighted = residual / diagonal - np.einsum("nq,nqm->nm", along, directions)
    precision = 1 / diagonal - (directions**2).sum(axis=1)
    square = (residual**2 / diagonal).sum(axis=1) - (along**2).sum(axis=1)
    logs = np.log(diagonal).sum(axis=1) + log_grown + here.sum(axis=1) * np.log(2 * np.pi)
    by_variance = np.where(here, 0.5 * (weighted**2 - precision), 0.0)
    pulled = np.einsum("nm,nm->n", weighted, by_load)
    known = np.einsum("nm,nm->n", by_load / diagonal, by_load) - (
        np.einsum("nqm,nm->nq", directions, by_load) ** 2
    ).sum(axis=1)
    return np.asarray(-0.5 * (square + logs)), by_variance, pulled**2 - known


def fit_noise(
    left_out: LeftOut,
    read_variance: FloatArray,
    force_sd: float,
    *,
    scattered: bool = False,
    by_effects: NoiseByEffects | None = None,
) -> tuple[Noise, float]:
    """Noise of the elements, with the share in proportion to the signal; load scatter, or spread of unmeasured loads.

    The error that the elements share in a touch shows in the correlation of their residuals. Of a single element it
    cannot be distinguished from its own noise, and is zero.

    The noise of one raw reading is that of repeated samples within touches, or else of rest readings; the rest of the
    noise at zero signal is the discrepancy. Where it is not known, the two cannot be distinguished: all noise counts as
    discrepancy, which averaging does not reduce.

    Parameters
    ----------
    left_out : LeftOut
        Predictions of the readings that are left out.
    read_variance : (m,) array
        Variance of one raw reading; NaN unknown.
    force_sd : float
        Noise of the force sensor, N; it is only copied to the result.
    scattered : bool
        Whether measured loads have a scatter. Touches are read with it. Models are fitted and chosen without it: the
        errors of a wrong model are common to the elements too, and a fit would take them for scatter.
    by_effects : NoiseByEffects, optional
        What effects of the noise add to it; they are known.

    Returns
    -------
    Noise, float
        The noise, and the standard deviation s of an unmeasured load over the mean of the calibration; NaN if measured.
    """
    from scipy.optimize import minimize

    m = left_out.residual.shape[1]
    tactile = np.sqrt(np.where(np.isfinite(read_variance), read_variance, 0.0))
    here = np.isfinite(left_out.residual)
    size = np.where(here, np.abs(left_out.signal), 0.0).max(axis=0)
    size = np.where(size > 0, size, 1.0)
    absolute = np.where(here, np.abs(left_out.residual), np.nan)
    typical = np.array([np.nanmedian(each) if np.isfinite(each).any() else 0.0 for each in absolute.T])
    common = float(np.clip(np.median(typical / size) / 0.67, 1e-5, 1.0))
    measured = not bool(np.isnan(left_out.load_share).any())
    several = int(here.any(axis=0).sum()) > 1
    signal, mean_load = np.where(here, left_out.signal, 0.0), float(left_out.load.mean())

    def unpack(vector: FloatArray) -> tuple[Noise, float]:
        share, error, floor = np.exp(vector[:3])
        discrepancy = floor * np.exp(vector[3:]) * size
        scatter = float(error) * mean_load if scattered and measured and several else 0.0
        noise = Noise(tactile, discrepancy, float(share), force_sd, scatter)
        return noise if by_effects is None else by_effects.to(noise), np.nan if measured else float(error)

    def cost(vector: FloatArray) -> tuple[float, FloatArray]:
        noise, spread = unpack(vector)
        density, by_variance, by_error = _density_with_slopes(left_out, noise, spread)
        departure = vector[3:] / FLOOR_SPREAD
        # Derivatives of a variance over the logarithms of its share and of its floor.
        by_floor = 2 * noise.discrepancy_sd**2 * by_variance.sum(axis=0)
        by_share = 2 * noise.signal_share**2 * float((by_variance * signal**2).sum())
        # Of the variance of the shared error, the part that is estimated: all of it if loads were not measured.
        part = (noise.load_scatter / left_out.load / left_out.load_errors(noise, spread)) ** 2 if measured else 1.0
        gradient = np.r_[by_share, (by_error * part).sum(), by_floor.sum(), by_floor - departure / FLOOR_SPREAD]
        return 0.5 * float(departure @ departure) - float(density.sum()), -gradient

    # Lower bounds: a share or a load scatter of 1e-5 and a floor of 1e-6 of the signal are negligible; no calibration
    # shows that unmeasured loads repeat to better than 1e-3.
    low = np.r_[np.log([1e-5, 1e-5 if measured else 1e-3, 1e-6]), np.full(m, -3.0)]
    high = np.r_[np.log([1.0, 1.0, 1.0]), np.full(m, 3.0)]
    solutions = [
        minimize(
            cost,
            np.r_[np.log([share, START_ERROR, common]), np.zeros(m)],
            jac=True,
            method="L-BFGS-B",
            bounds=list(zip(low, high, strict=True)),
        )
        for share in START_SHARES
    ]
    best = min(solutions, key=lambda each: float(each.fun))
    return unpack(np.asarray(best.x))
