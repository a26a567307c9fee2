"""A fitted finger, linearised at its mode: a linear problem for each element, to choose the sizes of discrepancies.

The covariance of the readings of an element is ``c (I + T Tᵀ)`` plus that of the functions of place, in units of the
standard deviation by noise and error of the load. T contains the derivatives over the parameters of the model. Two
approximations are made: each element has its own σ and μ, and its own error of the load.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag, solve_triangular

from bayestouch.array_types import BoolArray, FloatArray, IntArray
from bayestouch.finger.likelihood import FingerLikelihood

# Values of c that are tried: variance of the readings over that of noise and load. If the noise is known from repeats,
# c is at least 1. Without repeats the fitted noise contains the model error, and c can be smaller than 1.
FACTORS = np.geomspace(1.0, 300.0, 39)
FACTORS_WITHOUT_REPEATS = np.geomspace(1 / 300.0, 3.0, 47)


@dataclass(frozen=True, eq=False)
class LinearElement:
    """Residuals of one element at the mode of a fit, over the standard deviation by noise and load.

    Attributes
    ----------
    index : int
        Index of the element.
    rows : (n,) int array
        Indices of the touches in which the element was read.
    sd : (n,) array
        Standard deviation of each reading by noise and load.
    tangents : (n, 5) array
        T: change of the readings for one standard deviation of the prior of each parameter, over `sd`.
    left : (n,) array
        Reading minus prediction, over `sd`.
    factors : (c,) array
        Values of c that are tried: variance of the errors over that of noise and load.
    """

    index: int
    rows: IntArray
    sd: FloatArray
    tangents: FloatArray
    left: FloatArray
    factors: FloatArray

    def whiten(self, columns: FloatArray) -> FloatArray:
        """``(I + T Tᵀ)^(-1/2)`` of columns (t, k) of all touches, in units of `sd`; (n, k)."""
        return self.without_model(columns[self.rows] / self.sd[:, None])

    def without_model(self, columns: FloatArray) -> FloatArray:
        """``(I + T Tᵀ)^(-1/2)`` of columns (n, k) that are in units of `sd`; (n, k)."""
        left, singular, _ = np.linalg.svd(self.tangents, full_matrices=False)
        shrunk = 1 - 1 / np.sqrt(1 + singular**2)
        return np.asarray(columns - left @ (shrunk[:, None] * (left.T @ columns)))


def linear_elements(likelihood: FingerLikelihood, vector: FloatArray) -> list[LinearElement]:
    """Elements with readings, linearised at the flat vector of a fit."""
    at, known, prior = likelihood.layout, likelihood.known, likelihood.prior
    bare = vector.copy()
    bare[at.log_discrepancy] = -np.inf
    chain = vector[: at.n_chain]
    predicted, slope = likelihood.predicted(chain)
    spread = likelihood.standard_errors(bare)
    derivatives = likelihood.derivatives(chain)
    sd = np.sqrt(spread.sd**2 + (slope * spread.load_sd[:, None]) ** 2)
    left = known.readings - predicted
    factors = FACTORS if known.repeated else FACTORS_WITHOUT_REPEATS
    out = []
    for e in range(at.n_elements):
        rows = np.flatnonzero(~known.missing[:, e])
        if not len(rows):
            continue
        places = [e, at.n_elements + e, 2 * at.n_elements + e, at.sigma, at.log_mu]
        tangents = (derivatives[places][:, rows, e] * prior.spread[places, None] / sd[rows, e]).T
        out.append(LinearElement(e, rows, sd[rows, e], tangents, left[rows, e] / sd[rows, e], factors))
    return out


@dataclass(frozen=True, eq=False)
class Precision:
    """``(I - H Hᵀ)/c``: inverse covariance of an element's readings, in units of their sd.

    Attributes
    ----------
    root : (n, k) array
        H.
    factor : float
        c.
    """

    root: FloatArray
    factor: float

    @classmethod
    def of(cls, element: LinearElement, factor: float, functions: FloatArray) -> Precision:
        """Precision for errors with the factor c, the parameters of the model, and columns (t, k) of the functions.

        Each column is the change of the readings for one standard deviation of a weight.
        """
        own = functions[element.rows] / element.sd[:, None] / np.sqrt(factor)
        columns = np.concatenate([element.tangents, own], axis=1)
        lower = np.linalg.cholesky(np.eye(columns.shape[1]) + columns.T @ columns)
        return cls(solve_triangular(lower, columns.T, lower=True).T, factor)

    def __matmul__(self, rows: FloatArray) -> FloatArray:
        return np.asarray((rows - self.root @ (self.root.T @ rows)) / self.factor)

    def block(self, inside: BoolArray) -> FloatArray:
        """Rows and columns of the matrix for the readings in the mask `inside` (n,)."""
        part = self.root[inside]
        return np.asarray((np.eye(len(part)) - part @ part.T) / self.factor)


@dataclass(frozen=True, eq=False)
class LinearPosterior:
    """Normal distribution of the readings of all elements, for given sizes of the discrepancies.

    Attributes
    ----------
    elements : sequence of LinearElement
        The elements.
    precisions : list of Precision
        Precision of the readings of each element.
    common : list of (n, q) arrays
        Change of the readings for each weight of the shared functions, over the sd of the readings.
    """

    elements: Sequence[LinearElement]
    precisions: list[Precision]
    common: list[FloatArray]

    @classmethod
    def of(
        cls, elements: Sequence[LinearElement], factor: FloatArray, own: FloatArray, common: FloatArray
    ) -> LinearPosterior:
        """Distribution for columns (t, m, k) of own functions of the elements and (t, m, q) of shared functions."""
        return cls(
            elements,
            [Precision.of(e, float(c), own[:, e.index]) for e, c in zip(elements, factor, strict=True)],
            [common[e.rows, e.index] / e.sd[:, None] for e in elements],
        )

    @property
    def squares(self) -> float:
        """Squared distance of the readings from the fit, without the shared functions."""
        return sum(float(e.left @ (p @ e.left)) for p, e in zip(self.precisions, self.elements, strict=True))

    def information(self) -> tuple[FloatArray, FloatArray]:
        """Information (q, q) on the weights of the shared functions; gradient (q,) of the log likelihood at zero."""
        pairs = [(c, p @ c) for p, c in zip(self.precisions, self.common, strict=True)]
        information = np.sum([c.T @ pulled for c, pulled in pairs], axis=0)
        slope = np.sum([pulled.T @ e.left for (_, pulled), e in zip(pairs, self.elements, strict=True)], axis=0)
        return np.asarray(information), np.asarray(slope)

    def held_out(self, folds: IntArray) -> FloatArray:
        """Log density (folds,) of the readings of each fold, given those of all other folds.

        `folds` (t,) has the index of the fold of each touch.

        Source: S. Sundararajan and S. S. Keerthi (2001), Neural Computation 13 (leave-one-out of normal processes).
        """
        information, slope = self.information()
        lower = np.linalg.cholesky(np.eye(len(slope)) + information)
        half = [
            solve_triangular(lower, (p @ c).T, lower=True).T for p, c in zip(self.precisions, self.common, strict=True)
        ]
        weight = solve_triangular(lower, slope, lower=True)
        pulled = [p @ e.left - h @ weight for p, e, h in zip(self.precisions, self.elements, half, strict=True)]
        out = np.zeros(folds.max() + 1)
        for fold in range(len(out)):
            inside = [folds[e.rows] == fold for e in self.elements]
            precision = block_diag(*(p.block(i) for p, i in zip(self.precisions, inside, strict=True)))
            down = np.concatenate([h[i] for h, i in zip(half, inside, strict=True)])
            pull = np.concatenate([values[i] for values, i in zip(pulled, inside, strict=True)])
            root = np.linalg.cholesky(precision - down @ down.T)
            sd_units = np.asarray(np.concatenate([e.sd[i] for e, i in zip(self.elements, inside, strict=True)]))
            white = solve_triangular(root, pull, lower=True)
            out[fold] = np.log(np.diag(root) / sd_units).sum() - 0.5 * white @ white
        return out
