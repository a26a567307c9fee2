"""Empirical correction: smooth functions of the location of a touch, fitted together with the parameters.

It is a sum of the random functions of `bayestouch.model.base.CorrectionBasis`. Their standard deviations maximise the
marginal likelihood; they are zero if the data show no error.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.model.base import CorrectionBasis
from bayestouch.model.fitting import Fitted, drift_columns, fit, functions_of
from bayestouch.model.linear import Linearised, Score, Scorer, with_functions

# Trial standard deviations of a part, over the peak reading.
SIZES = (0.0, 0.003, 0.01, 0.03, 0.1)


@dataclass(frozen=True, eq=False)
class Correction:
    """An empirical correction with the chosen standard deviations.

    Attributes
    ----------
    basis : CorrectionBasis
        Functions of the location.
    sizes : dict of str to float
        Standard deviation of each part, over the peak reading.
    linear : Linearised
        The linearised model for which it was chosen, with the correction among its random functions.
    """

    basis: CorrectionBasis
    sizes: dict[str, float]
    linear: Linearised

    def columns(self, *where: FloatArray) -> FloatArray:
        """Readings of touches per unit of each weight, (k, t, m); the weights are standard normal.

        `where` is the result of `bayestouch.model.base.SensorModel.correction_inputs`.
        """
        return self.scaled(self.basis.columns(*where))

    def scaled(self, parts: Mapping[str, FloatArray]) -> FloatArray:
        """The functions of the basis, (c_part, t, m) of each part, times their sizes: (k, t, m)."""
        return np.concatenate([self.sizes[name] * part for name, part in parts.items() if self.sizes[name] > 0])


def fit_correction(fitted: Fitted) -> Correction | None:
    """Correction for a fitted model; None if no correction increases the marginal likelihood."""
    model = fitted.model
    basis = model.correction_basis(fitted.vector)
    where = model.correction_inputs(fitted.vector)
    parts = basis.columns(*where)
    raw = np.concatenate(list(parts.values()))
    part = np.repeat(np.arange(len(parts)), [len(each) for each in parts.values()])
    score = Scorer(fitted.linear).of_columns(fitted.whitening.columns(raw))
    sizes, gain = _best_sizes(score, part, len(parts))
    if gain <= 0 or not sizes.any():
        return None
    chosen = Correction(basis, dict(zip(parts, sizes.tolist(), strict=True)), fitted.linear)
    functions = functions_of(model, fitted.vector, fitted.whitening, fitted.drifts, chosen.scaled(parts))
    return replace(chosen, linear=with_functions(fitted.linear, functions))


def rejoined(correction: Correction, fitted: Fitted) -> Correction:
    """The correction that another process made for a model: with the arrays of this model, not with copies of them."""
    return replace(correction, linear=with_functions(fitted.linear, correction.linear.functions))


def corrected_fit(fitted: Fitted) -> tuple[Fitted, Correction] | None:
    """The model fitted again with its correction, and the correction; None if `fit_correction` finds none.

    The parameters are not fitted again where `SensorModel.refitted_with_correction` is False.
    """
    chosen = fit_correction(fitted)
    if chosen is None:
        return None
    model = fitted.model
    if not model.refitted_with_correction:
        return replace(fitted, linear=chosen.linear), chosen
    further = chosen.columns(*model.correction_inputs(fitted.vector))
    return fit(model, fitted.vector, fitted.noise, fitted.drifts, further=further), chosen


def without_correction(fitted: Fitted) -> Fitted:
    """The corrected fit of a model that was not fitted again with its correction, without the correction.

    Its parameters are at their mode, which they are not where the correction is among the random functions.
    """
    assert not fitted.model.refitted_with_correction
    functions = functions_of(fitted.model, fitted.vector, fitted.whitening, fitted.drifts)
    return replace(fitted, linear=with_functions(fitted.linear, functions))


@dataclass(frozen=True, eq=False)
class CorrectionWeights:
    """Weights of the correction of a corrected fit; k weights, d parameters.

    For given parameters of the model they are normal, with a mean that is linear in the parameters.

    Attributes
    ----------
    mean : (k,) array
        Mean at the most probable parameters.
    slope : (k, d) array
        Derivative of the mean over the parameters.
    covariance : (k, k) array
        Covariance for given parameters.
    """

    mean: FloatArray
    slope: FloatArray
    covariance: FloatArray


def weights_of(fitted: Fitted) -> CorrectionWeights:
    """Weights of the correction in a corrected fit."""
    linear, functions = fitted.linear, fitted.linear.functions
    assert functions is not None
    first = len(drift_columns(fitted.model, fitted.vector, fitted.drifts))
    covariance = np.linalg.inv(functions.root @ functions.root.T)
    # A parameter at its bound counts as free, as in the covariance of the parameters.
    slope = -functions.weights(linear.free.jacobian)
    return CorrectionWeights(linear.weights()[first:], slope[first:], np.asarray(covariance[first:, first:]))


def _best_sizes(score: Score, part: IntArray, n_parts: int) -> tuple[FloatArray, float]:
    """Sizes of the parts with the largest marginal likelihood, chosen one part after the other, in two rounds."""
    sizes, best = np.zeros(n_parts), 0.0
    for _ in range(2):
        changed = False
        for k in range(n_parts):
            gains = _gains(score, part == k, np.where(part == k, 0.0, sizes[part]))
            chosen = int(np.argmax(gains))
            if gains[chosen] > best + 1e-9:
                changed = changed or SIZES[chosen] != sizes[k]
                sizes[k], best = SIZES[chosen], float(gains[chosen])
        if not changed:
            break
    return sizes, best


def _gains(score: Score, mine: NDArray[np.bool_], others: FloatArray) -> FloatArray:
    """Increase of the log marginal likelihood by all functions, for each of `SIZES` of the functions in `mine` (k,).

    The other functions have the sizes `others` (k,). They are integrated out first, so that one decomposition is enough
    for all sizes.
    """
    used = others > 0
    scale = others[used]
    root = np.linalg.cholesky(np.eye(len(scale)) + scale[:, None] * score.information[np.ix_(used, used)] * scale)
    white = solve_triangular(root, scale * score.slope[used], lower=True)
    shared = solve_triangular(root, scale[:, None] * score.information[np.ix_(used, mine)], lower=True)
    alone = 0.5 * float(white @ white) - float(np.log(np.diag(root)).sum())
    values, vectors = np.linalg.eigh(score.information[np.ix_(mine, mine)] - shared.T @ shared)
    slope = vectors.T @ (score.slope[mine] - shared.T @ white)
    squares = np.array(SIZES)[:, None] ** 2
    spread = 1 + squares * np.maximum(values, 0.0)
    return np.asarray(alone + 0.5 * (squares * slope**2 / spread - np.log(spread)).sum(axis=1))
