"""Which touches may be at a distant location: a weak touch, or one beside the elements, may fit at several of them."""

from __future__ import annotations

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray
from bayestouch.finger.reading.modes import matches
from bayestouch.finger.reading.reader import FingerPosterior

# Distance of another location that fits about as well (rad), and how much worse it may fit (log density).
APART, AS_WELL = np.radians(6.0), 8.0


def distant_places(posterior: FingerPosterior, mode: FloatArray) -> FloatArray:
    """Place (w, θ_c, P), (t, 3), farther than `APART` from the mode (t, 3) of each touch, that fits best."""
    low, high = posterior.priors.location.support
    lightest, hardest = posterior.priors.load.support
    out, best = mode.copy(), np.full(len(mode), np.inf)
    for w, angles, load, misfit in matches(posterior):
        # On a finger that is a full ring, both ends of the prior are one location.
        off = (angles - mode[:, 1:2] + np.pi) % (2 * np.pi) - np.pi
        misfit = np.where(np.abs(off) > APART, misfit, np.inf)
        k = misfit.argmin(axis=1)
        rows = np.arange(len(k))
        better = misfit[rows, k] < best
        best = np.where(better, misfit[rows, k], best)
        out[better] = np.stack([np.full(len(k), w), angles[k], load[rows, k]], axis=1)[better]
    out[:, 1] = np.clip(out[:, 1], low + 1e-6, high - 1e-6)
    out[:, 2] = np.clip(out[:, 2], lightest + 1e-6, hardest - 1e-6)
    # As in the search for modes: the draws must not depend on the number of touches.
    return out.astype(np.float32).astype(np.float64)


def fits_as_well(posterior: FingerPosterior, mode: FloatArray, place: FloatArray) -> BoolArray:
    """Whether readings and load of each touch fit at a place (t, 3) about as well as at the mode (t, 3), (t,)."""
    x = np.stack([mode, place], axis=1)
    rest = posterior.residual(x, np.arange(len(x))).astype(np.float64)
    misfit = (rest**2).sum(axis=2)
    miss = np.nan_to_num((x[..., 2] - posterior.touches.load[:, None]) / posterior.touches.load_sd[:, None])
    misfit += miss**2
    return np.asarray(misfit[:, 1] - misfit[:, 0] < 2 * AS_WELL)
