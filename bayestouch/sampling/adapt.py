"""Better proposals for blocks whose given proposal is poor: mixtures fitted by importance sampling.

Adaptive importance sampling as in Cappé, Douc, Guillin, Marin and Robert (2008), doi:10.1007/s11222-008-9059-x.
"""

from __future__ import annotations

import numpy as np

from bayestouch.array_types import FloatArray, IndexArray
from bayestouch.sampling.density import LogDensity, of_blocks
from bayestouch.sampling.pareto import systematic_resample
from bayestouch.sampling.proposals import BlockProposal, Mixture, StudentTProposal
from bayestouch.sampling.streams import BlockStreams

# Purpose number of the random streams, see `BlockStreams`.
PURPOSE = 6
# Number of adaptation rounds, points drawn in each, and points used to fit a mixture.
ADAPTATIONS, POINTS, POINTS_FITTED = 5, 1024, 256
# Weights are tempered until their effective sample size reaches this, so that enough points determine a mixture.
LEAST_ESS = 64.0
TEMPERING = 0.5 ** np.arange(8)
POINTS_HELD = 1 << 18

COMPONENTS = 4
ITERATIONS = 5
DOF = 5.0
# Components are wider than their points by this factor, so that tails with few points are not missed: for a
# banana-shaped posterior this halves the bias. One more, wide component covers all points.
SCALE = 1.3
WIDE_SHARE = 0.1
WIDE_SCALE = 2.5
# Fraction of the overall covariance in each component's covariance, so that a component of few points does not
# collapse.
SHRINKAGE = 0.03


def adapt(log_density: LogDensity, proposal: BlockProposal, numbers: IndexArray, seed: int) -> Mixture:
    """Return Student-t mixtures fitted to the posteriors of the blocks `numbers`, starting from `proposal`."""
    held = max(1, POINTS_HELD // POINTS)
    parts = []
    for first in range(0, proposal.n_blocks, held):
        index = np.arange(first, min(first + held, proposal.n_blocks))
        streams = BlockStreams(seed, numbers[index], purpose=PURPOSE)
        density = of_blocks(log_density, numbers[index])
        current = proposal.select(index)
        for _ in range(ADAPTATIONS):
            x, log_q = current.draw(streams, POINTS)
            weights = _tempered(density(x) - log_q)
            chosen = systematic_resample(weights, POINTS_FITTED, streams.uniform(1))
            current = mixture = fit_mixture(np.take_along_axis(x, chosen[..., None], axis=1), x.std(axis=1))
        parts.append(mixture)
    return Mixture.concatenate(parts)


def _tempered(log_weights: FloatArray) -> FloatArray:
    """Weights (B, n), each row raised to the highest of a few powers with an effective size of `LEAST_ESS` or more."""
    largest = log_weights.max(axis=1, keepdims=True)
    relative = log_weights - np.where(np.isfinite(largest), largest, 0.0)
    weights = np.exp(TEMPERING[:, None, None] * relative)
    total = weights.sum(axis=2)
    ess = total**2 / np.maximum((weights**2).sum(axis=2), 1e-300)
    enough = ess >= LEAST_ESS
    power = np.where(enough.any(axis=0), enough.argmax(axis=0), len(TEMPERING) - 1)
    rows = np.arange(len(log_weights))
    return np.asarray(weights[power, rows] / np.maximum(total[power, rows], 1e-300)[:, None])


def fit_mixture(points: FloatArray, spread: FloatArray) -> Mixture:
    """Return a mixture of Student-t distributions fitted to the points of each block.

    Expectation maximisation fits normal components, starting from slices along the longest axis of the points. The
    components then get Student-t tails, and a wide component is added.

    Parameters
    ----------
    points : (B, n, d) array
        Points of each block, of equal weight.
    spread : (B, d) array
        Standard deviations of the proposals of the points; points closer than a thousandth of them are taken as equal.
    """
    n_blocks, _, d = points.shape
    centre = points.mean(axis=1)
    sd = np.maximum(points.std(axis=1), 1e-3 * spread)
    y = (points - centre[:, None]) / sd[:, None]
    overall = _covariance(y, np.ones(y.shape[:2])) + 1e-3 * np.eye(d)
    share = _slices(y, overall)
    for _ in range(ITERATIONS):
        weight, mean, covariance = _maximise(y, share, overall)
        share = _expect(y, weight, mean, covariance)
    weight, mean, covariance = _maximise(y, share, overall)

    def component(at: FloatArray, matrix: FloatArray, scale: float) -> StudentTProposal:
        return StudentTProposal(centre + sd * at, sd[:, :, None] * scale * np.linalg.cholesky(matrix), DOF)

    parts = [component(mean[:, k], covariance[:, k], SCALE) for k in range(COMPONENTS)]
    wide = component(np.zeros((n_blocks, d)), overall, WIDE_SCALE)
    weights = np.concatenate([(1 - WIDE_SHARE) * weight, np.full((n_blocks, 1), WIDE_SHARE)], axis=1)
    return Mixture((*parts, wide), weights)


def _covariance(y: FloatArray, weight: FloatArray) -> FloatArray:
    """Weighted second moments about 0, (B, n, d) and (B, n) -> (B, d, d)."""
    return np.asarray(np.swapaxes(y * weight[..., None], 1, 2) @ y / weight.sum(axis=1)[:, None, None])


def _slices(y: FloatArray, overall: FloatArray) -> FloatArray:
    """Membership of each point (B, n, k), 0 or 1, in equal slices along the first principal axis."""
    axis = np.linalg.eigh(overall)[1][:, :, -1]
    place = np.argsort(np.argsort((y @ axis[:, :, None])[..., 0], axis=1), axis=1)
    slice_of = place * COMPONENTS // y.shape[1]
    return np.asarray(slice_of[..., None] == np.arange(COMPONENTS), dtype=np.float64)


def _maximise(y: FloatArray, share: FloatArray, overall: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Weights (B, k), means (B, k, d), covariances (B, k, d, d) for memberships (B, n, k)."""
    total = share.sum(axis=1) + 1e-9
    weight = total / total.sum(axis=1, keepdims=True)
    mean = np.swapaxes(share, 1, 2) @ y / total[..., None]
    covariance = np.stack([_covariance(y - mean[:, k, None], share[..., k] + 1e-12) for k in range(COMPONENTS)], axis=1)
    return weight, mean, (1 - SHRINKAGE) * covariance + SHRINKAGE * overall[:, None]


def _expect(y: FloatArray, weight: FloatArray, mean: FloatArray, covariance: FloatArray) -> FloatArray:
    """Membership probability of each point in each component, (B, n, k)."""
    root = np.linalg.cholesky(covariance)
    whiten = np.linalg.inv(root)
    log_share = np.empty((*y.shape[:2], COMPONENTS))
    for k in range(COMPONENTS):
        z = (y - mean[:, k, None]) @ np.swapaxes(whiten[:, k], 1, 2)
        volume = np.log(np.diagonal(root[:, k], axis1=1, axis2=2)).sum(axis=1)
        log_share[..., k] = (np.log(weight[:, k]) - volume)[:, None] - 0.5 * (z * z).sum(axis=2)
    log_share -= log_share.max(axis=2, keepdims=True)
    share = np.exp(log_share)
    return np.asarray(share / share.sum(axis=2, keepdims=True))
