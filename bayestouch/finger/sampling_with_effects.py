"""Draws of the calibration parameters of a finger with effects, with emcee."""

from __future__ import annotations

from typing import Any

import numpy as np

from bayestouch.finger.fit_with_effects import EffectFit
from bayestouch.finger.sampling import DEAR, THIN, Budget, draw_points
from bayestouch.sampling import BlockDraws

# On a ridge the normal approximation in the new coordinates is worse.
ON_RIDGES = Budget(THIN, enough=0.5)
# With drifts or a correction an evaluation takes milliseconds, and a round of refinement some hundred evaluations. From
# log ratios with an sd of 0.8 a further round saves fewer evaluations than it takes. With a correction whose columns
# have more than MANY numbers an evaluation takes longer: 15 ms for 16 elements and 468 touches.
TIED, DEAREST, MANY = Budget((3, 12), enough=0.8), Budget((2, 4), 2, 0.5), 1_000_000


def sample_effects(fit: EffectFit, draws: int, seed: int, moves: Any = None) -> BlockDraws:
    """Draw flat vectors (see `FlatLayout`) from the exact posterior, as `bayestouch.finger.sampling.sample_fit`."""
    at, density = fit.posterior.layout, fit.density
    covariance = np.eye(at.size)
    covariance[at.n_chain :, at.n_chain :] = fit.shape.covariance
    covariance[at.further, at.further] = np.eye(at.n_further)
    columns, budget = density.posterior.columns, TIED if density.tied else DEAR
    if fit.to_vectors.ridges.each and not density.tied:
        budget = ON_RIDGES
    if columns is not None and columns.size > MANY:
        budget = DEAREST
    return draw_points(density, fit.to_vectors, fit.centre, covariance, draws, seed, None, moves, budget)
