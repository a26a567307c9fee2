"""The chain of a finger with effects linearised about a vector, with what each element contributes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import solve_triangular

from bayestouch.array_types import FloatArray
from bayestouch.data.arrays import read_once
from bayestouch.finger.density_with_effects import EffectPosterior
from bayestouch.finger.drift_nodes import DriftNodes
from bayestouch.finger.noise import Residuals, StandardErrors
from bayestouch.model.columns import WhiteColumns
from bayestouch.model.fitting import Drift, Fitted, drift_columns
from bayestouch.model.joint_drifts import further_columns
from bayestouch.model.linear import Functions, conditioned
from bayestouch.sampling.rank_one import inverse_root


@dataclass(frozen=True, eq=False)
class LinearChain:
    """The chain linearised about a vector, with the contribution of the readings to the posterior.

    There are m elements and n coordinates of the chain with the values of its effects.

    Attributes
    ----------
    residuals : Residuals or None
        Residuals of the mean readings, for the noise, if they were asked for.
    precision, gradient : (m, n, n), (m, n) arrays
        Contributions of the readings of each element.
    constant : (q, n, n) array or None
        Contribution to the precision of readings that drifts or a correction make dependent, at each of q nodes of the
        values of a drift; the first is that of the fitted values.
    prior_pull : (n,) array
        Gradient of the log prior.
    cost : float
        Half the sum of squares of all that is whitened: readings, deviations of samples, weights of functions, prior.
        It compares vectors of the chain at one noise.
    """

    residuals: Residuals | None
    precision: FloatArray
    gradient: FloatArray
    constant: FloatArray | None
    prior_pull: FloatArray
    cost: float

    @property
    def hessian(self) -> FloatArray:
        """Precision without that of the prior, (n, n)."""
        total = self.precision.sum(axis=0)
        return np.asarray(total if self.constant is None else total + self.constant[0])

    @property
    def pull(self) -> FloatArray:
        """Gradient of the log posterior, (n,)."""
        return np.asarray(self.gradient.sum(axis=0) + self.prior_pull, dtype=np.float64)

    def along(self, tangent: FloatArray) -> LinearChain:
        """The same in coordinates over which the derivative of those of the chain is `tangent` (n, n)."""
        return replace(
            self,
            precision=tangent.T @ self.precision @ tangent,
            gradient=self.gradient @ tangent,
            constant=None if self.constant is None else tangent.T @ self.constant @ tangent,
            prior_pull=self.prior_pull @ tangent,
        )

    def without_coupling(self, entries: Sequence[int], own: FloatArray | float = 1.0) -> LinearChain:
        """The same with some coordinates independent of all others, and their own precision times `own`."""
        kept = np.ones(self.precision.shape[1:])
        kept[entries], kept[:, entries], kept[entries, entries] = 0.0, 0.0, own
        constant = None if self.constant is None else kept * self.constant
        return replace(self, precision=kept * self.precision, constant=constant)


def linearised_chain(
    fitted: Fitted,
    posterior: EffectPosterior,
    vector: FloatArray,
    *,
    nodes: DriftNodes | None = None,
    with_residuals: bool = False,
) -> LinearChain:
    """Linearise the chain about a vector (d,), whitened by the noise at this vector.

    With many functions the residuals take most of the time, because each needs its degrees of freedom. Without `nodes`
    of the values of a drift, drifts have the fitted ones.
    """
    model, known, at = posterior.model, posterior.known, posterior.layout
    n, m = at.n_chain, at.n_elements
    chain = vector[:n]
    predicted, by_load = model.predict(chain), model.by_load(chain)
    touches, samples = model.derivatives(chain)
    spread = StandardErrors.of(known, at, vector)
    added, counts = posterior.noise.added(vector), read_once(known.counts)
    own = np.where(known.missing, 1.0, spread.sd**2)
    more = added.variance(predicted.touches, posterior.noise.peak) / counts
    shared = posterior.noise.shared_errors(added)
    root = inverse_root(own + more, (by_load * spread.load_sd[:, None], *shared), ~known.missing)
    left = np.where(known.missing, 0.0, known.readings) - predicted.touches
    white = np.einsum("tij,dtj->dti", root, touches, optimize=True)
    row = np.einsum("tij,tj->ti", root, np.where(known.missing, 0.0, left))
    functions, spent, cost = None, np.zeros(m), 0.0
    if fitted.linear.functions is not None:
        raw = fitted.linear.functions.raw
        functions = Functions.of(raw, WhiteColumns.of(raw, root))
        if with_residuals:
            half = solve_triangular(functions.root, functions.white.dense().T, lower=True, check_finite=False)
            spent = degrees_spent(np.asarray(half, dtype=np.float64).reshape(-1, *left.shape), root, own)
        weights = functions.weights(row.reshape(-1, 1))[:, 0]
        left = left - np.tensordot(weights, raw, axes=1)
        row = np.einsum("tij,tj->ti", root, np.where(known.missing, 0.0, left))
        cost = 0.5 * float(weights @ weights)
    # With functions: of the residuals that they leave, so that the parts of the elements are small, and not only their
    # sum is. The map takes each part in proportion to the precision of its element.
    gradient = np.einsum("itm,tm->mi", white, row)
    if functions is None:
        precision = np.einsum("itm,jtm->mij", white, white, optimize=True)
        constant = None
    else:
        flat = white.reshape(n, -1).T
        inside = functions.without(flat)
        white = inside.T.reshape(white.shape)
        others = () if nodes is None else nodes.others(fitted.drifts)
        there = (flat.T @ _functions_at(fitted, drifts, root).without(flat) for drifts in others)
        constant, precision = np.stack([flat.T @ inside, *there]), np.zeros((m, n, n))
    if samples is not None:
        assert predicted.samples is not None
        observed = model.known
        sd = np.exp(vector[at.noise]) / np.sqrt(observed.weight)[:, None]
        within = np.where(np.isnan(observed.deviation), 0.0, samples / sd)
        off = np.nan_to_num((observed.deviation - predicted.samples) / sd)
        precision = precision + np.einsum("inm,jnm->mij", within, within, optimize=True)
        gradient = gradient + np.einsum("inm,nm->mi", within, off)
        cost += 0.5 * float((off**2).sum())
    pull = (posterior.prior.mean[:n] - chain) / posterior.prior.spread[:n] ** 2
    cost += 0.5 * float((row**2).sum() + ((posterior.prior.spread[:n] * pull) ** 2).sum())
    if not with_residuals:
        return LinearChain(None, precision, gradient, constant, pull, cost)
    hessian = precision.sum(axis=0) + np.diag(posterior.prior.spread[:n] ** -2.0)
    total = hessian if constant is None else hessian + constant[0]
    # Not by the inverse, whose rounding can exceed its least eigenvalue: units of coordinates may be very different.
    unit = np.diag(total) ** -0.5
    whole = np.linalg.cholesky(conditioned(total * np.outer(unit, unit)))
    half = np.asarray(solve_triangular(whole, unit[:, None] * white.reshape(n, -1), lower=True, check_finite=False))
    spent = spent + degrees_spent(half.reshape(white.shape), root, own)
    rest, slope = (np.where(known.missing, 0.0, each) for each in (left, by_load))
    together = list(np.where(known.missing, 0.0, shared)) if posterior.noise.shared else []
    residuals = Residuals(rest, slope, spent, more, together)
    return LinearChain(residuals, precision, gradient, constant, pull, cost)


def _functions_at(fitted: Fitted, drifts: tuple[Drift, ...], root: FloatArray) -> Functions:
    """Random functions of a fit with other values of its drifts, whitened by matrices (t, m, m)."""
    columns, further = drift_columns(fitted.model, fitted.vector, drifts), further_columns(fitted)
    raw = columns if further is None else np.concatenate([columns, further])
    return Functions.of(raw, WhiteColumns.of(raw, root))


def degrees_spent(half: FloatArray, root: FloatArray, own: FloatArray) -> FloatArray:
    """Degrees of freedom (m,) of fitted functions in the readings of each element.

    They are the sum over touches of the diagonal of ``D (S⁻¹ - (S + C Cᵀ)⁻¹)``. D is the noise of each reading, S is D
    plus the errors of the loads, and C are the functions.

    Parameters
    ----------
    half : (k, t, m) array
        Whitened functions times the root of the covariance of their weights.
    root : (t, m, m) array
        Whitening matrix of each touch.
    own : (t, m) array
        Variance of each reading by its own noise.
    """
    return np.asarray(((half.transpose(1, 0, 2) @ root) ** 2 * own[:, None]).sum(axis=(0, 1)))
