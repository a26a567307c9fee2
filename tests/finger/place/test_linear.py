"""Held-out density and marginal likelihoods against normal distributions that are written out."""

from __future__ import annotations

import numpy as np
from scipy import stats

from bayestouch.finger.place.evidence import Spectral
from bayestouch.finger.place.linear import LinearElement, LinearPosterior, Precision

RNG = np.random.default_rng(8)
T, M, K, Q = 12, 3, 4, 2
OWN, COMMON = RNG.normal(size=(T, M, K)), RNG.normal(size=(T, M, Q))
FACTOR = np.array([1.0, 2.5, 4.0])
# The second element was not read in two touches.
ROWS = [np.arange(T), np.delete(np.arange(T), [2, 7]), np.arange(T)]
ELEMENTS = [
    LinearElement(
        e, rows, RNG.uniform(0.5, 2, len(rows)), RNG.normal(size=(len(rows), 5)), RNG.normal(size=len(rows)), np.ones(1)
    )
    for e, rows in enumerate(ROWS)
]


def covariance() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of all readings, the readings, and the touch of each."""
    sizes = [len(rows) for rows in ROWS]
    out = np.zeros((sum(sizes), sum(sizes)))
    start, common = 0, []
    for element, c in zip(ELEMENTS, FACTOR, strict=True):
        n, sd = len(element.rows), element.sd
        own = OWN[element.rows, element.index]
        block = c * np.outer(sd, sd) * (np.eye(n) + element.tangents @ element.tangents.T) + own @ own.T
        out[start : start + n, start : start + n] = block
        common.append(COMMON[element.rows, element.index])
        start += n
    shared = np.concatenate(common)
    readings = np.concatenate([element.left * element.sd for element in ELEMENTS])
    return out + shared @ shared.T, readings, np.concatenate(ROWS)


def test_held_out_density() -> None:
    folds = np.arange(T) // 4
    found = LinearPosterior.of(ELEMENTS, FACTOR, OWN, COMMON).held_out(folds)
    matrix, readings, touch = covariance()
    whole = stats.multivariate_normal(np.zeros(len(readings)), matrix).logpdf(readings)
    for fold in range(3):
        rest = folds[touch] != fold
        others = stats.multivariate_normal(np.zeros(rest.sum()), matrix[np.ix_(rest, rest)]).logpdf(readings[rest])
        constant = 0.5 * (~rest).sum() * np.log(2 * np.pi)
        np.testing.assert_allclose(found[fold], whole - others + constant, rtol=1e-9)


def test_precision() -> None:
    element = ELEMENTS[1]
    precision = Precision.of(element, 2.5, OWN[:, 1])
    own = OWN[element.rows, 1] / element.sd[:, None]
    n = len(element.rows)
    inverse = np.linalg.inv(2.5 * (np.eye(n) + element.tangents @ element.tangents.T) + own @ own.T)
    np.testing.assert_allclose(precision @ np.eye(n), inverse, rtol=1e-9, atol=1e-12)
    inside = np.arange(n) > 5
    np.testing.assert_allclose(precision.block(inside), inverse[np.ix_(inside, inside)], rtol=1e-9, atol=1e-12)


def test_marginal_likelihood_of_sizes() -> None:
    element, sizes, factors = ELEMENTS[0], np.array([0.3, 1.0]), np.array([1.0, 3.0])
    columns = element.whiten(OWN[:, 0])
    left = element.without_model(element.left[:, None])[:, 0]
    found = Spectral.of(columns, left).log_evidence(sizes, factors)
    wanted = np.empty((2, 2))
    spread = np.eye(T) + element.tangents @ element.tangents.T
    own = OWN[:, 0] / element.sd[:, None]
    for i, size in enumerate(sizes):
        for j, factor in enumerate(factors):
            matrix = factor * spread + size**2 * own @ own.T
            wanted[i, j] = stats.multivariate_normal(np.zeros(T), matrix).logpdf(element.left)
    # up to a constant that all share
    np.testing.assert_allclose(found - found[0, 0], wanted - wanted[0, 0], rtol=1e-9, atol=1e-9)
