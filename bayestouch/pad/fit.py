"""Fit of the chain of a pad to touches with known location, for a given covariance of the residuals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.chain.pad import PadChain
from bayestouch.chain.places import Places
from bayestouch.data.averages import TouchMeans
from bayestouch.pad.left_out import without_block
from bayestouch.pad.residual_map import MapDiscrepancy
from bayestouch.priors.parameters import LogNormal, Normal, Prior
from bayestouch.sampling.laplace import ENOUGH, LaplaceFit, least_squares_map


@dataclass(frozen=True, eq=False)
class PadFit:
    """Fitted chain of a pad, with leave-one-out predictions of the readings; n touches, m elements.

    Attributes
    ----------
    chain : PadChain
        The chain at the maximum a posteriori.
    laplace : LaplaceFit
        Mode and covariance in the order of `PadChain.layout`, with the correction integrated out.
    misfit : MapDiscrepancy
        Covariance of reading minus kernel.
    known : TouchMeans
        The touches; all have a load.
    places : Places
        Locations of the touches.
    """

    chain: PadChain
    laplace: LaplaceFit
    misfit: MapDiscrepancy
    known: TouchMeans
    places: Places

    @cached_property
    def residual(self) -> FloatArray:
        """Reading minus kernel, (n, m); 0 where missing."""
        predicted = _predicted(self.chain, self.known, self.places)
        return np.where(self.misfit.present, self.known.readings - predicted, 0.0)

    @cached_property
    def jacobian(self) -> tuple[tuple[IntArray, FloatArray], ...]:
        """For each element: indices of its parameters (p,), and the derivatives of its readings over them (n, p)."""
        return _jacobian(self.chain, self.known, self.places)

    @cached_property
    def weights(self) -> FloatArray:
        """Precision times residual, (n, m)."""
        columns = [each.solve(self.residual[:, e]) for e, each in enumerate(self.misfit.covariances)]
        return np.stack(columns, axis=1)

    @cached_property
    def left_out(self) -> tuple[FloatArray, FloatArray]:
        """Reading minus its prediction from all other readings (n, m), and variance of the prediction (n, m).

        Closed form: with the precision Q of all readings, chain (linear at its mode) and correction integrated out, the
        residual is ``(Q r)_i / Q_ii`` and its variance ``1/Q_ii``. The noise of the reading itself is subtracted from
        the variance that is returned. NaN where missing.
        """
        residual, variance = np.full(self.residual.shape, np.nan), np.full(self.residual.shape, np.nan)
        for e, (columns, derivative) in enumerate(self.jacobian):
            covariance = self.misfit.covariances[e]
            diagonal, pull = covariance.precision_diagonal, covariance.solve(derivative)
            learned = self.laplace.covariance[np.ix_(columns, columns)]
            q = diagonal - np.einsum("np,pq,nq->n", pull, learned, pull)
            q = np.maximum(q, 1e-9 * diagonal)
            here = self.misfit.present[:, e]
            residual[here, e] = (self.weights[:, e] / q)[here]
            variance[here, e] = np.maximum(1 / q - self.misfit.variance[:, e], 0.0)[here]
        return residual, variance

    def without_blocks(self, blocks: Sequence[IntArray]) -> tuple[FloatArray, FloatArray]:
        """As `left_out`, with all readings of an element in a block of touches left out together (`without_block`)."""
        residual, variance = np.full(self.residual.shape, np.nan), np.full(self.residual.shape, np.nan)
        present = self.misfit.present
        for e, (columns, derivative) in enumerate(self.jacobian):
            if not present[:, e].any():
                continue
            covariance = self.misfit.covariances[e]
            pull = covariance.solve(derivative)
            learned = self.laplace.covariance[np.ix_(columns, columns)]
            for block in blocks:
                precision = covariance.precision(block) - pull[block] @ learned @ pull[block].T
                residual[block, e], variance[block, e] = without_block(
                    precision, self.weights[block, e], covariance.noise[block]
                )
        return np.where(present, residual, np.nan), np.where(present, variance, np.nan)

    def predicted(self) -> FloatArray:
        """Predicted readings of the touches by kernel and correction, (n, m)."""
        out = _predicted(self.chain, self.known, self.places)
        for e, covariance in enumerate(self.misfit.covariances):
            out[:, e] += covariance.columns @ covariance.weights(self.residual[:, e])
        return out


def fit_chain(
    start: PadChain, priors: tuple[Prior, ...], known: TouchMeans, misfit: MapDiscrepancy, enough: float = ENOUGH
) -> PadFit:
    """Maximum a posteriori of gains, offsets, positions and kernel by generalised least squares.

    Parameters
    ----------
    start : PadChain
        Starting values.
    priors : tuple of Prior
        Prior of each entry of `PadChain.flat`. For a log-normal prior the mode is that of the logarithm.
    known : TouchMeans
        Touches with location and load.
    misfit : MapDiscrepancy
        Covariance of reading minus chain.
    enough : float
        As in `least_squares_map`.
    """
    low, high = (np.array([prior.support[side] for prior in priors]) for side in (0, 1))
    width = np.where(np.isfinite(high - low), high - low, [_unbounded_width(each) for each in priors])
    places = Places.of(known.location)
    tiny = 1e-6 * np.maximum(width, 1e-9)
    low, high = low + tiny, high - tiny

    def residuals(vector: FloatArray) -> FloatArray:
        chain = start.with_flat(vector)
        difference = known.readings - _predicted(chain, known, places)
        difference = np.where(misfit.present, difference, 0.0)
        data = [covariance.whiten(difference[:, e]) for e, covariance in enumerate(misfit.covariances)]
        return np.concatenate([*data, _prior_rows(vector, priors)[0]])

    def jacobian(vector: FloatArray) -> FloatArray:
        chain = start.with_flat(vector)
        blocks = []
        for e, (columns, derivative) in enumerate(_jacobian(chain, known, places)):
            white = misfit.covariances[e].whiten(np.where(misfit.present[:, e, None], derivative, 0.0))
            block = np.zeros((len(white), len(vector)))
            block[:, columns] = -white
            blocks.append(block)
        return np.concatenate([*blocks, np.diag(_prior_rows(vector, priors)[1])])

    laplace = least_squares_map(residuals, jacobian, np.clip(start.flat, low, high), (low, high), enough)
    return PadFit(start.with_flat(laplace.mode), laplace, misfit, known, places)


def _unbounded_width(prior: Prior) -> float:
    """Width by which the distance of a fit from a bound of an unbounded prior is chosen: 1, less for small values."""
    size = prior.median if isinstance(prior, LogNormal) else prior.sd if isinstance(prior, Normal) else 1.0
    return min(1.0, 1e3 * size)


def _predicted(chain: PadChain, known: TouchMeans, places: Places) -> FloatArray:
    return np.asarray(chain.offset + known.load[:, None] * places.values(chain.sensitivity))


def _jacobian(chain: PadChain, known: TouchMeans, places: Places) -> tuple[tuple[IntArray, FloatArray], ...]:
    derivative = places.values(chain.sensitivity_derivatives) * known.load[:, None, None]
    m, dimensions = chain.position.shape
    kernel = np.arange((2 + dimensions) * m, len(chain.flat))
    out = []
    for e in range(m):
        derivative[:, e, m + e] = 1.0
        columns = np.concatenate([e + m * np.arange(2 + dimensions), kernel])
        out.append((columns, derivative[:, e, columns]))
    return tuple(out)


def _prior_rows(vector: FloatArray, priors: tuple[Prior, ...]) -> tuple[FloatArray, FloatArray]:
    """Distance from the centre of each prior over its sd, and its derivative; 0 for a flat prior."""
    value, derivative = np.zeros(len(vector)), np.zeros(len(vector))
    for i, (x, prior) in enumerate(zip(vector, priors, strict=True)):
        if isinstance(prior, Normal):
            value[i], derivative[i] = (x - prior.mean) / prior.sd, 1 / prior.sd
        elif isinstance(prior, LogNormal):
            value[i] = np.log(x / prior.median) / prior.spread
            derivative[i] = 1 / (x * prior.spread)
    return value, derivative
