"""A model linearised at a vector, with whitened residuals: steps of a fit, covariance, score tests.

This module is independent of tactile sensors. Rows are grouped (touches) with m readings each; the noise of whitened
rows is independent with variance one. Parameters have independent normal priors. The weights of random functions, if
any, have standard normal priors and are integrated out of every result.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve, solve_triangular
from scipy.special import erfcx

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.model.columns import WhiteColumns

# Share of the sum of squares of each column that is added to its information: the inverse exists where columns are the
# same. A column of which the model absorbs all but 1 % is tested with an error of 1e-7.
RIDGE = 1e-9

# SURE: relative variance of a parameter at its bound, below which rounding would make the covariance indefinite. FAR:
# distance beyond a bound, in sd, where the second term of the asymptotic form (5/x² of the first) is below rounding.
SURE, FAR = 1e-8, 1e3


@dataclass(frozen=True, eq=False)
class Functions:
    """Random functions: mean readings of the touches per unit of each weight; k weights.

    Attributes
    ----------
    raw : (k, t, m) array
        Columns in the unit of the readings; (0, t, m) for functions of which only the whitened columns are needed.
    white : WhiteColumns
        The columns whitened.
    root : (k, k) array
        Cholesky factor of the precision of the weights for fixed parameters.
    """

    raw: FloatArray
    white: WhiteColumns
    root: FloatArray

    @classmethod
    def of(cls, raw: FloatArray, white: WhiteColumns) -> Functions:
        """Functions from their columns before whitening (k, t, m) and whitened."""
        return cls(raw, white, np.asarray(np.linalg.cholesky(white.gram() + np.eye(white.count))))

    @classmethod
    def whitened(cls, white: WhiteColumns) -> Functions:
        """Functions of which only the whitened columns are needed."""
        return cls.of(np.zeros((0, *white.shape)), white)

    def without(self, rows: FloatArray) -> FloatArray:
        """Whitened rows (t m, q) times the precision of the data with the weights integrated out."""
        return np.asarray(rows - self.white.times(self.weights(rows)))

    def weights(self, rows: FloatArray) -> FloatArray:
        """Most probable weights (k, q) for whitened data (t m, q)."""
        return np.asarray(cho_solve((self.root, True), self.white.transposed(rows)))


@dataclass(frozen=True, eq=False)
class Linearised:
    """A linearised model; t touches, n samples, m elements, d parameters.

    Attributes
    ----------
    residual : (t, m) array
        Mean reading minus prediction (without random functions), whitened; zero where missing.
    jacobian : (t m, d) array
        Derivative of the whitened prediction.
    deviation : (n, m) array
        Sample minus mean of its touch, minus the predicted difference, whitened.
    deviation_jacobian : (n m, d) array or None
        Derivative of the predicted difference, whitened; None if it is zero.
    touch : (n,) int array
        Touch of each sample.
    pull, precision : (d,) arrays
        Prior mean minus the parameters, and prior precision.
    functions : Functions or None
        Random functions.
    held : (d,) bool array or None
        Parameters that are fixed at a bound; their derivatives count as zero.
    unheld : Linearised or None
        The model with no parameter fixed; None if none is fixed here.
    """

    residual: FloatArray
    jacobian: FloatArray
    deviation: FloatArray
    deviation_jacobian: FloatArray | None
    touch: IntArray
    pull: FloatArray
    precision: FloatArray
    functions: Functions | None = None
    held: NDArray[np.bool_] | None = None
    unheld: Linearised | None = None

    @property
    def free(self) -> Linearised:
        """The model with no parameter fixed at a bound."""
        return self if self.unheld is None else self.unheld

    @cached_property
    def plain(self) -> FloatArray:
        """Whitened residual (t, m) minus the most probable random functions."""
        if self.functions is None:
            return self.residual
        return self.functions.without(self.residual.reshape(-1, 1)).reshape(self.residual.shape)

    def hessian(self) -> FloatArray:
        """Posterior precision of the parameters, functions integrated out, (d, d)."""
        total = self.jacobian.T @ self.integrated(self.jacobian) + np.diag(self.precision)
        if self.deviation_jacobian is not None:
            total = total + self.deviation_jacobian.T @ self.deviation_jacobian
        return np.asarray(total)

    def gradient(self) -> FloatArray:
        """Gradient of the log posterior over the parameters, (d,)."""
        total = self.precision * self.pull + self.jacobian.T @ self.plain.ravel()
        if self.deviation_jacobian is not None:
            total = total + self.deviation_jacobian.T @ self.deviation.ravel()
        return np.asarray(total)

    def integrated(self, rows: FloatArray) -> FloatArray:
        """Whitened rows (t m, q) times the precision of the data with the functions integrated out."""
        return rows if self.functions is None else self.functions.without(rows)

    def cost(self) -> float:
        """Minus the log posterior, up to a constant."""
        data = float(self.residual.ravel() @ self.plain.ravel()) + float((self.deviation**2).sum())
        # A parameter fixed at its bound does not move, but is as improbable there as its prior says.
        return 0.5 * (data + float((self.precision * self.free.pull**2).sum()))

    def holding(self, held: NDArray[np.bool_]) -> Linearised:
        """The model with some parameters (d,) fixed at their bounds: they absorb no part of the residual."""
        if not held.any():
            return self
        within = self.deviation_jacobian
        return replace(
            self,
            jacobian=np.where(held, 0.0, self.jacobian),
            deviation_jacobian=None if within is None else np.where(held, 0.0, within),
            pull=np.where(held, 0.0, self.pull),
            held=held,
            unheld=self,
        )

    def step_within(self, leaving: Callable[[FloatArray], NDArray[np.bool_]]) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Step of the parameters to the maximum a posteriori, and which are fixed at a bound: see `step_within`."""
        return step_within(self.hessian(), self.gradient(), leaving)

    def covariance(self) -> FloatArray:
        """Covariance of the parameters, (d, d); parameters fixed at a bound have their mean square about the bound."""
        total = covariance_of(self.free.hessian())
        if self.held is None:
            return total
        # Normal density truncated at the bound, one parameter after the other; without the bound its mode is `step`.
        step = total @ self.free.gradient()
        for i in np.flatnonzero(self.held):
            along, variance = total[:, i] / total[i, i], total[i, i]
            beyond = abs(float(step[i])) / np.sqrt(variance)
            step = step - along * step[i]
            total = total - (1 - beyond_bound(beyond)) * variance * np.outer(along, along)
        return total

    def weights(self) -> FloatArray:
        """Most probable weights of the random functions, (k,)."""
        if self.functions is None:
            return np.zeros(0)
        return self.functions.weights(self.residual.reshape(-1, 1))[:, 0]


@dataclass(frozen=True, eq=False)
class Score:
    """Score test of columns that are not in the model: gradient of the log likelihood and its covariance.

    Attributes
    ----------
    slope : (q,) array
        Gradient: scalar products of the whitened columns with the residual of the fit.
    information : (q, q) array
        Covariance of `slope` if the model is complete: scalar products of those parts of the columns that the
        parameters do not absorb. Near zero if the parameters absorb the columns.
    raw : (q,) array
        Sums of squares of the columns before the projection.
    """

    slope: FloatArray
    information: FloatArray
    raw: FloatArray

    @property
    def seen(self) -> float:
        """Share of the sum of squares of the columns that the parameters of the model do not absorb."""
        total = float(self.raw.sum())
        return float(np.trace(self.information)) / total if total > 0 else 0.0

    def chi_square(self) -> float:
        """Test statistic: chi-square distributed with q degrees of freedom if the model is complete."""
        matrix = self.information + np.diag(RIDGE * self.raw + 1e-300)
        return float(self.slope @ np.linalg.solve(matrix, self.slope))

    def estimate(self, precision: FloatArray) -> FloatArray:
        """Amplitudes of the columns after one step, with prior precision (q,)."""
        return np.asarray(np.linalg.solve(self.information + np.diag(precision + 1e-300), self.slope))


class Scorer:
    """Computes the `Score` of columns for one fitted model."""

    def __init__(self, fitted: Linearised) -> None:
        self.fitted = fitted
        self.plain = fitted.plain.ravel()
        self.root = np.linalg.cholesky(conditioned(fitted.hessian()))
        self.integrated_jacobian = fitted.integrated(fitted.jacobian)

    def __call__(self, touches: FloatArray, samples: FloatArray | None = None) -> Score:
        """Score of whitened columns (q, t, m) and, where they differ within touches, (q, n, m)."""
        fitted, q = self.fitted, len(touches)
        flat = touches.reshape(q, -1).T
        inside = fitted.integrated(flat)
        slope, raw = flat.T @ self.plain, (flat * flat).sum(axis=0)
        gram, cross = flat.T @ inside, fitted.jacobian.T @ inside
        if samples is not None:
            within = samples.reshape(q, -1).T
            slope, raw = slope + within.T @ fitted.deviation.ravel(), raw + (within * within).sum(axis=0)
            gram = gram + within.T @ within
            if fitted.deviation_jacobian is not None:
                cross = cross + fitted.deviation_jacobian.T @ within
        return self._score(slope, gram, raw, cross)

    def of_columns(self, columns: WhiteColumns) -> Score:
        """Score of whitened columns that are equal in all samples of a touch."""
        functions = self.fitted.functions
        gram = columns.gram()
        raw = np.diag(gram).copy()
        if functions is not None:
            shared = functions.white.transposed(columns.dense())
            gram -= shared.T @ cho_solve((functions.root, True), shared)
        slope = columns.transposed(self.plain[:, None])[:, 0]
        cross = columns.transposed(self.integrated_jacobian).T
        return self._score(slope, gram, raw, cross)

    def of_touches(self, own: FloatArray) -> Score:
        """Score of t whitened columns, each of one touch: column t is the row t of `own` (t, m) there, else zero."""
        t, m = own.shape

        def onto(rows: FloatArray) -> FloatArray:
            return np.asarray(np.einsum("tm,tmq->tq", own, rows.reshape(t, m, -1)))

        functions, squares = self.fitted.functions, (own**2).sum(axis=1)
        gram = np.diag(squares)
        if functions is not None:
            shared = onto(functions.white.dense())
            gram -= shared @ cho_solve((functions.root, True), shared.T)
        return self._score(onto(self.plain)[:, 0], gram, squares, onto(self.integrated_jacobian).T)

    def _score(self, slope: FloatArray, gram: FloatArray, raw: FloatArray, cross: FloatArray) -> Score:
        absorbed = solve_triangular(self.root, cross, lower=True)
        return Score(np.asarray(slope), np.asarray(gram - absorbed.T @ absorbed), np.asarray(raw))


def beyond_bound(beyond: float) -> float:
    """Mean square about a bound, over the variance, of a normal density truncated `beyond` sd from its mode."""
    if beyond > FAR:
        return max(2 / beyond**2, SURE)
    hazard = float(np.sqrt(2 / np.pi) / erfcx(beyond / np.sqrt(2)))
    return 1 - beyond * hazard + beyond**2


def conditioned(matrix: FloatArray) -> FloatArray:
    """The matrix with its diagonal increased by a share of 1e-10, to be factorised with undetermined parameters too."""
    return np.asarray(matrix + np.diag(1e-10 * np.diag(matrix) + 1e-300))


def covariance_of(information: FloatArray) -> FloatArray:
    """Inverse of an information matrix whose entries may have very different units."""
    scale = np.sqrt(np.diag(information))
    even = np.outer(scale, scale)
    return np.asarray(np.linalg.inv(conditioned(information / even)) / even)


def with_covariance_of(information: FloatArray, rows: IntArray, covariance: FloatArray) -> FloatArray:
    """Information (d, d) by which the unknowns `rows` (k,) have this covariance; the others go with them as before."""
    others = np.setdiff1d(np.arange(len(information)), rows)
    cross = information[np.ix_(rows, others)]
    by_others = cross @ covariance_of(information[np.ix_(others, others)]) @ cross.T
    out = information.copy()
    out[np.ix_(rows, rows)] = covariance_of(covariance) + by_others
    return out


def leaving_bounds(vector: FloatArray, low: FloatArray, high: FloatArray) -> Callable[[FloatArray], NDArray[np.bool_]]:
    """From a step (d,) to a mask (d,) of the parameters that are at or beyond a bound, and would move further out."""
    return lambda step: ((vector <= low) & (step < 0)) | ((vector >= high) & (step > 0))


def step_within(
    matrix: FloatArray, slope: FloatArray, leaving: Callable[[FloatArray], NDArray[np.bool_]]
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Step of parameters to a maximum between bounds, (d,), and which of them are fixed at a bound, (d,).

    Parameters
    ----------
    matrix, slope : (d, d), (d,) arrays
        Minus the second derivative of what is maximised, and its first derivative.
    leaving : callable
        From a step (d,) to a mask (d,) of the parameters that the step would move beyond their bounds.
    """
    scale = np.sqrt(np.diag(matrix))
    even, slope = conditioned(matrix / np.outer(scale, scale)), slope / scale
    held, released = np.zeros((2, len(slope)), dtype=bool)
    while True:
        free = np.flatnonzero(~held)
        step = np.zeros(len(slope))
        step[free] = np.linalg.solve(even[np.ix_(free, free)], slope[free])
        left = slope - even @ step
        more = leaving(step / scale) & ~held
        # One that left only because another did: with that one fixed, it increases off the bound. Each is
        # released once at most, so that rounding cannot make the loop endless.
        wrongly = held & ~leaving(left) & ~released
        if more.any():
            held |= more
        elif wrongly.any():
            first = int(np.argmax(np.where(wrongly, np.abs(left), -1.0)))
            held[first], released[first] = False, True
        else:
            return step / scale, held


def with_functions(model: Linearised, functions: Functions | None) -> Linearised:
    """The same model with other random functions."""
    unheld = None if model.unheld is None else with_functions(model.unheld, functions)
    return replace(model, functions=functions, unheld=unheld)
