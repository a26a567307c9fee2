"""Likelihood of the size and correlation time of a drift, with the function and the parameters integrated out.

A fit represents a random function by its values at knots. This loses part of its variance between the knots, and the
part depends on the correlation time, which would bias a likelihood of size and time. Here the process is exact: a
Matérn function of smoothness 3/2 is a linear system with two states, the function and its slope, driven by white
noise. A Kalman filter over the touches in the order of time gives its likelihood (J. Hartikainen and S. Särkkä, Kalman
filtering and smoothing solutions to temporal Gaussian process regression models, 2010).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.model.fitting import Drift, Fitted, functions_of
from bayestouch.model.observations import Observations

# Largest gap in correlation times; exp(-700) is near the smallest positive double.
LONG = 700.0


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
        order, gap = _gaps(model.known)
        return cls(rows[order], white[order], gap, precision, slope)

    def __call__(self, size: FloatArray, time: FloatArray) -> FloatArray:
        """Log marginal likelihood, up to a constant, of pairs of size and correlation time, each (g,)."""
        g, c, m = len(size), self.scale.shape[2], self.rows.shape[1]
        # Mean of the function and of its slope over λ, and their covariance minus the stationary one (the identity).
        beyond, mean = np.zeros((g, 2 * c, 2 * c)), np.zeros((g, 2 * c, self.rows.shape[2]))
        volume, gram = np.zeros(g), np.zeros((g, self.rows.shape[2], self.rows.shape[2]))
        for rows, scale, gap in zip(self.rows, self.scale, self.gap, strict=True):
            step = np.kron(_transition(np.minimum(np.sqrt(3.0) * gap / time, LONG)), np.eye(c))
            beyond, mean = step @ beyond @ step.swapaxes(1, 2), step @ mean
            seen = size[:, None, None] * scale
            cross = seen @ (beyond[:, :c] + np.eye(c, 2 * c))
            root = np.linalg.cholesky(np.eye(m) + cross[:, :, :c] @ seen.swapaxes(1, 2))
            solved = np.linalg.solve(root, np.concatenate([cross, rows - seen @ mean[:, :c]], axis=2))
            gain, new = solved[:, :, : 2 * c], solved[:, :, 2 * c :]
            beyond, mean = beyond - gain.swapaxes(1, 2) @ gain, mean + gain.swapaxes(1, 2) @ new
            volume += 2 * np.log(np.diagonal(root, axis1=1, axis2=2)).sum(axis=1)
            gram += new.swapaxes(1, 2) @ new
        precision, slope = gram[:, 1:, 1:] + self.precision, gram[:, 1:, 0] + self.slope
        root = np.linalg.cholesky(precision)
        along = np.linalg.solve(root, slope[:, :, None])[:, :, 0]
        volume += 2 * np.log(np.diagonal(root, axis1=1, axis2=2)).sum(axis=1)
        return np.asarray(-0.5 * (gram[:, 0, 0] - (along**2).sum(axis=1) + volume))


def _gaps(observed: Observations) -> tuple[IntArray, FloatArray]:
    """Order of the touches in time, and time since the previous touch; inf for the first touch of a session."""
    time = observed.touch_time_s
    order = np.argsort(time, kind="stable")
    begins = np.array([low for low, _ in observed.sessions or (observed.span,)])
    session = np.searchsorted(begins, time[order], side="right")
    same = np.diff(session, prepend=-1) == 0
    return order, np.where(same, np.diff(time[order], prepend=time[order][0]), np.inf)


def _transition(x: FloatArray) -> FloatArray:
    """Transition matrix of function and slope over λ for x = λ times the gap, (g, 2, 2); λ is √3/correlation time."""
    matrix = np.array([[1 + x, x], [-x, 1 - x]]) * np.exp(-x)
    return np.asarray(matrix.transpose(2, 0, 1))
