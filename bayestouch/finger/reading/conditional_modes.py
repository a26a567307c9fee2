"""Modes and curvatures of location and load for given indenters, for many touches and indenters at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.finger.reading.reader import FingerPosterior

# Steps of the derivatives: two cells of the reading table (rad), and a share of the load.
ANGLE_STEP, LOAD_STEP = 3e-3, 3e-3
LEAST_WEIGHT = 1e-3
# Newton steps: longest step and step at which the search ends (both in sd), largest number; and distance below the peak
# of the log density at which an indenter is negligible.
LONGEST_STEP, SETTLED, MOST_STEPS, NEGLIGIBLE = 3.0, 1.0, 12, 12.0
# Number of touches evaluated together; their readings fit into the cache.
PART = 64


def conditional_modes(
    posterior: FingerPosterior, w: FloatArray, start: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Mode of (θ_c, P) given w, for several w of every touch.

    One Newton step is enough for most touches. If load or location are not linear in w, e.g. beyond the end of the
    array without a force reading, further steps are made until none improves a w that is not negligible.

    Parameters
    ----------
    posterior : FingerPosterior
        Posterior with its reading table.
    w, start : (t, g), (t, g, 2) arrays
        Coordinates of the indenters, and starting values of (θ_c, P), rad and N/m.

    Returns
    -------
    mode, value, curvature : (t, g, 2), (t, g), (3, t, g) arrays
        Mode, log density at the mode (both from the last expansion), and minus its Hessian as 11, 12, 22.
    """
    low, high = np.array([posterior.priors.location.support, posterior.priors.load.support]).T
    here, kept, best = start.copy(), start.copy(), np.full(w.shape, -np.inf)
    mode, value, curvature = start.copy(), np.full(w.shape, -np.inf), np.empty((3, *w.shape))
    active = np.arange(len(w))
    for _ in range(MOST_STEPS):
        at, gradient, bend = _expansion(posterior, w[active], here[active], active)
        step, length = _newton_step(gradient, bend)
        # The expansion is not valid over a step longer than three sd: limit it.
        step *= np.minimum(1.0, LONGEST_STEP / np.maximum(length, 1e-12))[..., None]
        better = (at > best[active]) | np.isneginf(best[active])
        wide = better[..., None]
        kept[active] = np.where(wide, here[active], kept[active])
        best[active] = np.where(better, at, best[active])
        curvature[:, active] = np.where(better, bend, curvature[:, active])
        mode[active] = np.where(wide, here[active] + step, kept[active])
        value[active] = best[active] + np.where(better, 0.5 * np.minimum(length, LONGEST_STEP) ** 2, 0.0)
        # A step that decreased the density is repeated with half its length.
        here[active] = np.where(wide, mode[active], 0.5 * (here[active] + kept[active]))
        here[active] = np.clip(here[active], low + 1e-9, np.minimum(high, 1e12) - 1e-9)
        hope = np.where(better, best[active] + 0.5 * length**2, value[active])
        matters = hope > value[active].max(axis=1, keepdims=True) - NEGLIGIBLE
        active = active[(matters & (length > SETTLED)).any(axis=1)]
        if not len(active):
            break
    return mode, value, curvature


# Formulas for 2 x 2 matrices are written out: LAPACK needs ten times as long.


def bounded_product(product: FloatArray, one: FloatArray, other: FloatArray) -> FloatArray:
    """Scalar products (...) of vectors, from their scalar products and those of each with itself, all (...).

    Where one reading alone is present the vectors are parallel, and rounding errors of numbers of 32 bits make the
    product larger than that of the lengths: the matrix of the three then has no inverse.
    """
    most = np.sqrt(one * other)
    return np.asarray(np.minimum(np.maximum(product, -most), most))


def root_of_inverse(curvature: FloatArray) -> FloatArray:
    """Lower Cholesky factor ``l11, l21, l22`` of the inverse, (t, g, 3), of matrices as 11, 12, 22, (3, t, g)."""
    c11, c12, c22 = curvature
    determinant = c11 * c22 - c12 * c12
    l11 = np.sqrt(c22 / determinant)
    return np.stack([l11, -c12 / (determinant * l11), 1 / np.sqrt(c22)], axis=-1)


def _newton_step(gradient: FloatArray, curvature: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Newton step (t, g, 2) and its length in sd (t, g)."""
    d1, d2 = gradient
    c11, c12, c22 = curvature
    step = np.stack([c22 * d1 - c12 * d2, c11 * d2 - c12 * d1], axis=-1) / (c11 * c22 - c12 * c12)[..., None]
    return step, np.sqrt(np.maximum(step[..., 0] * d1 + step[..., 1] * d2, 0.0))


def _expansion(
    posterior: FingerPosterior, w: FloatArray, rest: FloatArray, blocks: IntArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Log density (t, g), its gradient (2, t, g) and minus its Gauss-Newton Hessian (3, t, g) in (θ_c, P)."""
    parts = [slice(first, first + PART) for first in range(0, len(w), PART)]
    joined = np.concatenate([_expand(posterior, w[part], rest[part], blocks[part]) for part in parts], axis=1)
    return joined[0], joined[1:3], joined[3:]


def _expand(posterior: FingerPosterior, w: FloatArray, rest: FloatArray, blocks: IntArray) -> FloatArray:
    """Log density, gradient and curvature of some touches, (6, t, g)."""
    t, g = w.shape
    steps = np.stack([np.full(w.shape, ANGLE_STEP), LOAD_STEP * np.maximum(rest[..., 1], 1e-3)], axis=-1)
    moves = np.array([[0.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    places = rest[:, :, None] + moves * steps[:, :, None]
    x = np.concatenate([np.broadcast_to(w[:, :, None, None], (t, g, 5, 1)), places], axis=-1).reshape(t, g * 5, 3)
    z = posterior.residual(x, blocks).reshape(t, g, 5, -1)
    prior = posterior.log_factor(x, blocks).reshape(t, g, 5)
    by_angle, by_load = z[:, :, 1] - z[:, :, 2], z[:, :, 3] - z[:, :, 4]

    def product(one: NDArray[np.floating], other: NDArray[np.floating]) -> FloatArray:
        return np.asarray(np.einsum("tgm,tgm->tg", one, other), dtype=np.float64)

    of_angle, of_load = product(by_angle, by_angle), product(by_load, by_load)
    inside: NDArray[np.bool_] = np.all(np.isfinite(prior), axis=-1, keepdims=True)
    safe = np.where(inside, prior, 0.0)
    bend = np.maximum((2 * safe[..., :1] - safe[..., [1, 3]] - safe[..., [2, 4]]) / steps**2, 0.0)
    # A minimum of information, a thousandth of that of the prior, avoids a singular matrix.
    low, high = posterior.priors.location.support
    bend[..., 0] += 1 / (high - low) ** 2
    bend[..., 1] += LEAST_WEIGHT / np.maximum(rest[..., 1], 1e-3) ** 2
    half = np.moveaxis(0.5 / steps, -1, 0)
    return np.stack(
        [
            prior[..., 0] - 0.5 * product(z[:, :, 0], z[:, :, 0]),
            half[0] * (safe[..., 1] - safe[..., 2] - product(by_angle, z[:, :, 0])),
            half[1] * (safe[..., 3] - safe[..., 4] - product(by_load, z[:, :, 0])),
            half[0] ** 2 * of_angle + bend[..., 0],
            half[0] * half[1] * bounded_product(product(by_angle, by_load), of_angle, of_load),
            half[1] ** 2 * of_load + bend[..., 1],
        ]
    )
