"""Errors of a model of a pad that look like another place, from predictions of touches that are left out.

Noise of the elements is independent. What a model lacks is not: places of the calibration that are a little off, or a
map that is too smooth, change the readings of all elements of a touch together. The part that looks like another load
is load scatter (`bayestouch.pad.noise`). The part that looks like another place moves touches that are read, however
small the noise of the elements is, and their regions would be too narrow. So it is estimated: as a displacement in mm,
normal, independent from touch to touch, with the same standard deviation s along each coordinate. The readings of a
touch then have the covariance ``C + s² T Tᵀ``, with the covariance C of noise, prediction and load, and the change T of
the readings per mm.
"""

from __future__ import annotations

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.noise import Noise
from bayestouch.pad.noise import LeftOut

# Log likelihood that the error must gain: by chance a right model gains as much in one of twenty calibrations (half a
# chi-square of one degree above 2.7). The touch that gains most does not count: one wrong touch shows no error of all.
CLEAR = 1.35
# Errors that are tried, over the largest one: a tenth of a percent to all, in steps of a fifth.
TRIED = np.exp(np.arange(np.log(1e-3), 1e-9, 0.2))


def place_error(left_out: LeftOut, slope: FloatArray, noise: Noise, load_spread: float, largest: float) -> float:
    """Standard deviation of the displacement of touches by errors of the model, mm; 0 if it is not clear.

    Parameters
    ----------
    left_out : LeftOut
        Predictions of the readings that are left out; n touches, m elements.
    slope : (n, D, m) array
        Change of the predicted readings per mm.
    noise : Noise
        Noise of the readings.
    load_spread : float
        Standard deviation of unmeasured loads over their mean; NaN where loads were measured.
    largest : float
        Largest error that is tried, mm.
    """
    gained = gain_by_touch(left_out, slope, noise, load_spread, largest * TRIED)
    total = gained.sum(axis=1) - gained.max(axis=1)
    best = int(total.argmax())
    return float(largest * TRIED[best]) if total[best] > CLEAR else 0.0


def gain_by_touch(
    left_out: LeftOut, slope: FloatArray, noise: Noise, load_spread: float, errors: FloatArray
) -> FloatArray:
    """Log likelihood of the readings of each touch with errors of the place (k,) in mm, minus that without, (k, n)."""
    here = np.isfinite(left_out.residual)
    sd2 = noise.mean_variance(np.maximum(left_out.counts, 1), np.where(here, left_out.signal, 0.0))
    diagonal = np.where(here, sd2 + left_out.variance, 1.0)
    load_sd = left_out.load_errors(noise, load_spread)
    by_load = np.where(here, load_sd[:, None] * left_out.signal, 0.0)
    m = here.shape[1]
    root = np.linalg.cholesky(diagonal[:, :, None] * np.eye(m) + by_load[:, :, None] * by_load[:, None])
    white = np.linalg.solve(root, np.where(here[:, None], slope, 0.0).swapaxes(1, 2))
    residual = np.linalg.solve(root, np.where(here, left_out.residual, 0.0)[:, :, None])
    information, axes = np.linalg.eigh(white.swapaxes(1, 2) @ white)
    along = (axes.swapaxes(1, 2) @ (white.swapaxes(1, 2) @ residual))[:, :, 0]
    square = errors[:, None, None] ** 2
    grown = 1 + square * np.maximum(information, 0.0)
    return np.asarray(0.5 * (square * along**2 / grown - np.log(grown)).sum(axis=2))
