"""Likelihood of the size and correlation time of a drift, with the function and the parameters integrated out.

A fit represents a random function by its values at knots. This loses a part of its variance between the knots. The part
depends on the correlation time and would bias a likelihood of size and time. Here the process is exact: a Kalman filter
over the touches in the order of time, see `bayestouch.model.drift_filter`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.model.drift_filter import filtered, gaps
from bayestouch.model.fitting import Drift, Fitted, functions_of


@dataclass(frozen=True, eq=False)
class DriftLikelihood:
    """A linear model with one drift; t touches in the order of time, m elements, c functions of time, q parameters.

    Attributes
    ----------
    rows : (t, m, 1 + q) array
        Whitened residual, and the derivative of the prediction over each parameter.
    scale : (t, m, c) array
        Whitened readings per unit of each function.
    gap : (t,) array
        Time since the previous touch; inf for the first touch of a session.
    precision, slope : (q, q), (q,) arrays
        Precision of the parameters from the prior and the deviations within touches, and its product with their mean.
    """

    rows: FloatArray
    scale: FloatArray
    gap: FloatArray
    precision: FloatArray
    slope: FloatArray

    @classmethod
    def of(cls, fitted: Fitted, which: int) -> DriftLikelihood:
        """Likelihood of the drift with index `which` of a fit; the weights of the other drifts count as parameters."""
        model, linear, root = fitted.model, fitted.linear, fitted.whitening.root
        drift, values = fitted.drifts[which]
        others: tuple[Drift, ...] = tuple(each for i, each in enumerate(fitted.drifts) if i != which)
        functions = functions_of(model, fitted.vector, fitted.whitening, others)
        weights = np.zeros((linear.residual.size, 0)) if functions is None else functions.white.dense()
        rows = np.column_stack([linear.residual.ravel(), linear.jacobian, weights]).reshape(*root.shape[:2], -1)
        q = rows.shape[2] - 1
        precision, slope = np.eye(q), np.zeros(q)
        d = len(linear.precision)
        precision[:d, :d] = np.diag(linear.precision)
        slope[:d] = linear.precision * linear.pull
        if linear.deviation_jacobian is not None:
            precision[:d, :d] += linear.deviation_jacobian.T @ linear.deviation_jacobian
            slope[:d] += linear.deviation_jacobian.T @ linear.deviation.ravel()
        signal = model.predict(fitted.vector).touches - model.zero(fitted.vector)
        scale = drift.scale(replace(model.poses(fitted.vector), signal=signal))
        white = root * scale[:, None] if drift.own(values) else np.einsum("tij,tj->ti", root, scale)[:, :, None]
        order, gap = gaps(model.known)
        return cls(rows[order], white[order], gap, precision, slope)

    def __call__(self, size: FloatArray, time: FloatArray) -> FloatArray:
        """Log marginal likelihood, up to a constant, of pairs of size and correlation time, each (g,)."""
        c = self.scale.shape[2]
        touches = ((rows[None], size[:, None, None] * scale) for rows, scale in zip(self.rows, self.scale, strict=True))
        gram, volume = filtered(touches, self.gap, np.repeat(time[:, None], c, axis=1))
        precision, slope = gram[:, 1:, 1:] + self.precision, gram[:, 1:, 0] + self.slope
        root = np.linalg.cholesky(precision)
        along = np.linalg.solve(root, slope[:, :, None])[:, :, 0]
        volume += 2 * np.log(np.diagonal(root, axis1=1, axis2=2)).sum(axis=1)
        return np.asarray(-0.5 * (gram[:, 0, 0] - (along**2).sum(axis=1) + volume))
