"""Refinement of a normal proposal by the ratios of target to proposal at its own points."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bayestouch.array_types import FloatArray, IndexArray

# Points of a round for each coefficient, and rounds at most. A proposal is good enough if the log ratios have this
# standard deviation: most proposals are then accepted.
POINTS, ROUNDS, ENOUGH = 4, 6, 1.0
# Rounds end, too, where one changes the scatter by less than a tenth: it is known to some 3 %.
GAINED = 0.9
# Errors of a coefficient below which it counts as zero.
SIGNIFICANT = 2.5
# Range of the factor by which one round changes a precision, and of the shift in standard deviations.
NARROWER, WIDER, FARTHEST = 6.0, 0.4, 3.0


def refined(
    log_density: Callable[[FloatArray], FloatArray],
    centre: FloatArray,
    covariance: FloatArray,
    together: IndexArray,
    rng: np.random.Generator,
    rounds: int = ROUNDS,
    enough: float = ENOUGH,
) -> tuple[FloatArray, FloatArray]:
    """Centre and covariance of a normal proposal that is nearer to the target.

    The log ratio of target to proposal is fitted by a quadratic function of the standard variables of the proposal:
    linear and square terms of each, and products of some. The best proposal is the one whose ratios scatter least.

    Parameters
    ----------
    log_density : callable
        Of points (n, d), up to a constant; ``-inf`` outside the support.
    centre, covariance : (d,), (d, d) arrays
        Proposal.
    together : (k,) int array
        Coordinates whose products count.
    rng : Generator
        Random numbers.
    rounds : int
        Rounds at most.
    enough : float
        Standard deviation of the log ratios at which rounds end.
    """
    d = len(centre)
    first, second = np.triu_indices(len(together), 1)
    pairs = np.stack([together[first], together[second]])
    best = (np.inf, centre, covariance)
    for _ in range(rounds):
        root = np.linalg.cholesky(covariance)
        z = rng.standard_normal((POINTS * (2 * d + pairs.shape[1] + 1), d))
        ratio = log_density(centre + z @ root.T) + 0.5 * (z**2).sum(axis=1)
        there = np.isfinite(ratio)
        scatter = float(ratio[there].std()) if there.sum() > 2 * d else np.inf
        settled = GAINED < scatter / best[0] < 1 / GAINED
        if scatter < best[0]:
            best = (scatter, centre, covariance)
        if settled or scatter < enough or there.sum() < 3 * d:
            break
        terms = np.column_stack([np.ones(len(z)), z, z**2, z[:, pairs[0]] * z[:, pairs[1]]])
        coefficients = np.linalg.lstsq(terms[there], ratio[there], rcond=None)[0]
        # What is not larger than its error would make the proposal worse.
        left = ratio[there] - terms[there] @ coefficients
        error = float(left.std()) / np.sqrt(there.sum() * terms[there].var(axis=0).clip(1e-300))
        coefficients = np.where(np.abs(coefficients) > SIGNIFICANT * error, coefficients, 0.0)
        precision = np.eye(d) - 2 * np.diag(coefficients[d + 1 : 2 * d + 1])
        precision[pairs[0], pairs[1]] -= coefficients[2 * d + 1 :]
        precision[pairs[1], pairs[0]] -= coefficients[2 * d + 1 :]
        values, axes = np.linalg.eigh(precision)
        inverse = (axes / np.clip(values, WIDER, NARROWER)) @ axes.T
        shift = inverse @ coefficients[1 : d + 1]
        shift *= min(1.0, FARTHEST / max(float(np.abs(shift).max()), 1e-300))
        centre, covariance = centre + root @ shift, root @ inverse @ root.T
    return best[1], best[2]
