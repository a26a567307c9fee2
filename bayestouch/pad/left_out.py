"""Touches that are left out together, so that their prediction from the others shows the noise of later touches."""

from __future__ import annotations

import numpy as np

from bayestouch.array_types import FloatArray, IntArray

# Number of blocks. Touches that follow each other have similar errors, for example if a zero drifts or the rubber has
# not recovered: a single left-out touch would be predicted better than a touch of another day is.
BLOCKS = 40


def blocks_left_out(time_s: FloatArray) -> list[IntArray]:
    """Blocks of touches that follow each other in time (t,), as indices; single touches if there are few."""
    return np.array_split(np.argsort(time_s, kind="stable"), min(BLOCKS, len(time_s)))


def without_block(precision: FloatArray, weights: FloatArray, noise: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Reading minus its prediction from all other blocks, and variance of the prediction, of b readings of an element.

    With the precision Q of all readings and their residuals r, the residuals of a block b given all other readings are
    ``Q_bb⁻¹ (Q r)_b``, and their covariance is ``Q_bb⁻¹``.

    Parameters
    ----------
    precision : (b, b) array
        Part of the block in Q.
    weights : (b,) array
        Part of the block in ``Q r``.
    noise : (b,) array
        Noise variance of the readings, which is subtracted from the variance that is returned.
    """
    left = np.linalg.inv(precision)
    return left @ weights, np.maximum(np.diag(left) - noise, 0.0)
