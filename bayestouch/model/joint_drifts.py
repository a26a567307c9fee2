"""Drifts whose size and correlation time are entries of a flat vector.

Given these entries a drift is a Matérn function, which is integrated out exactly by a Kalman filter (see
`bayestouch.model.drift_filter`). The entries are logarithms.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.smooth import matern_3_2
from bayestouch.effects.effect import EffectParameter, Values
from bayestouch.effects.random import RandomEffect
from bayestouch.model.added import AddedEffect
from bayestouch.model.base import SensorModel
from bayestouch.model.columns import seen_columns
from bayestouch.model.drift_filter import filtered, gaps
from bayestouch.model.drift_posterior import BEGINNING
from bayestouch.model.fitting import Drift, Fitted, drift_columns
from bayestouch.model.linear import Functions
from bayestouch.model.observations import Observations
from bayestouch.sampling.laplace import solve_lower

#: Number of values of a drift that are entries of the vector; each further value selects a kind and is constant.
FREE = len(BEGINNING)

# Logarithm of a prior density that is zero in double precision. In the filter, a drift of a size beyond (some 38 sds of
# its prior) would be lost to rounding.
LEAST_LOG_PRIOR = -700.0


@dataclass(frozen=True, eq=False)
class DriftEntries:
    """Entries of q drifts in a flat vector: log size and log correlation time of each.

    Attributes
    ----------
    drifts : tuple of (RandomEffect, values)
        The drifts with values of a fit.
    mode, sd : (2 q,) arrays
        Most probable entries, approximately, and their standard deviations.
    """

    drifts: tuple[Drift, ...] = ()
    mode: FloatArray = field(default_factory=lambda: np.zeros(0))
    sd: FloatArray = field(default_factory=lambda: np.zeros(0))

    @classmethod
    def of(cls, drifts: tuple[Drift, ...], added: Sequence[AddedEffect]) -> DriftEntries:
        """Entries of drifts, with the posterior of those in `added`; the sds of the others are those of a search."""
        by_name = {each.effect.name: each for each in added}
        mode, sd = [], []
        for drift, values in drifts:
            each = by_name.get(drift.name, AddedEffect(drift, values, (float("nan"),) * len(values)))
            for i, unknown in enumerate(BEGINNING):
                value, spread = each.coordinate(i, logarithmic=True)
                mode.append(value)
                sd.append(spread or unknown)
        return cls(drifts, np.array(mode), np.array(sd))

    def __len__(self) -> int:
        """Number of entries."""
        return len(self.mode)

    @property
    def parameters(self) -> tuple[EffectParameter, ...]:
        """The parameter of each entry, by its name in the effect."""
        return tuple(each for drift, _ in self.drifts for each in drift.parameters[:FREE])

    @property
    def names(self) -> tuple[str, ...]:
        """Public name of each parameter."""
        return tuple(each.name for drift, _ in self.drifts for each in drift.public_parameters()[:FREE])

    def log_prior(self, logs: FloatArray) -> FloatArray:
        """Log prior density (...) of entries (..., 2 q), with the derivative of the values over the logarithms.

        It is ``-inf`` where the log density of a value is below `LEAST_LOG_PRIOR`.
        """
        total = logs.sum(axis=-1)
        for i, parameter in enumerate(self.parameters):
            log_density = parameter.prior.log_density(np.exp(logs[..., i]))
            total = total + np.where(log_density < LEAST_LOG_PRIOR, -np.inf, log_density)
        return np.asarray(total)

    def at(self, logs: FloatArray) -> tuple[Drift, ...]:
        """The drifts with other entries (2 q,)."""
        pairs = zip(self.drifts, np.exp(logs).reshape(-1, FREE).tolist(), strict=True)
        return tuple((drift, (*free, *values[FREE:])) for (drift, values), free in pairs)


def without_drifts(
    model: SensorModel,
    drifts: tuple[Drift, ...],
    logs: FloatArray,
    vectors: FloatArray,
    touches: FloatArray,
    root: FloatArray,
    rows: Sequence[FloatArray],
) -> tuple[FloatArray, FloatArray]:
    """Gram matrix of whitened rows with the drifts integrated out, and log determinant of their covariance.

    Parameters
    ----------
    model : SensorModel
        The sensor, with t touches of m elements.
    drifts : tuple of (RandomEffect, values)
        q drifts; only values that select a kind are used.
    logs : (n, 2 q) array
        Log size and log correlation time of each drift.
    vectors : (n, d) array
        Vectors of the model.
    touches : (n, t, m) array
        Mean readings that the model predicts at these vectors.
    root : (n, t, m, m) array
        Whitening of the readings.
    rows : sequence of (n or 1, t, m, r) arrays
        Whitened rows; the Gram matrix is that of all together.

    Returns
    -------
    (n, r, r), (n,) arrays
        The determinant is that over the noise.
    """
    n, _, m, _ = root.shape
    seen, time = [], []
    for k, (drift, values) in enumerate(drifts):
        size, length = np.exp(logs[:, FREE * k : FREE * (k + 1)]).T
        scale = np.stack([_scale(model, drift, vector, y) for vector, y in zip(vectors, touches, strict=True)])
        scale = size[:, None, None] * scale
        own = drift.own(values)
        seen.append(root * scale[:, :, None] if own else np.einsum("ntij,ntj->nti", root, scale)[..., None])
        time.append(np.repeat(length[:, None], m if own else 1, axis=1))
    courses = np.concatenate(seen, axis=3)
    order, gap = gaps(model.known)

    def joined(touch: int) -> FloatArray:
        each = [np.broadcast_to(part[:, touch], (n, m, part.shape[3])) for part in rows]
        return np.concatenate(each, axis=2)

    pairs = ((joined(int(i)), courses[:, i]) for i in order)
    return filtered(pairs, gap, np.concatenate(time, axis=1))


def without_weights(square: FloatArray, onto: FloatArray, gram: FloatArray) -> FloatArray:
    """Sum of squares (n,) of the errors with standard normal weights integrated out, plus the log determinant.

    Parameters
    ----------
    square, onto, gram : (n,), (n, c), (n, c, c) arrays
        Sum of squares of the whitened errors, their products with the columns, Gram matrix of the columns.
    """
    inner = np.linalg.cholesky(gram + np.eye(gram.shape[-1]))
    along = solve_lower(np.asarray(inner, dtype=np.float64), onto)
    log_determinant = 2 * np.log(np.diagonal(inner, axis1=1, axis2=2)).sum(axis=1)
    return np.asarray(square - (along**2).sum(axis=1) + log_determinant)


def further_columns(fitted: Fitted) -> FloatArray | None:
    """Random functions (k, t, m) of a fit other than its drifts, before whitening; None if there are none."""
    functions = fitted.linear.functions
    if functions is None:
        return None
    raw = functions.raw[len(drift_columns(fitted.model, fitted.vector, fitted.drifts)) :]
    return raw if len(raw) else None


def other_functions(fitted: Fitted, columns: FloatArray | None = None, *, joint: bool = True) -> Functions | None:
    """Random functions of a fit other than its drifts, after further columns (k, t, m); None if there are none.

    If the drifts are not `joint`, their functions are among them, at the size and the time of the fit. With joint
    drifts only the `seen_columns` are left: a map may have more weights than there are readings, or be far below the
    noise, and the cost of `without_drifts` goes with the square of their number.
    """
    functions, joint = fitted.linear.functions, joint and bool(fitted.drifts)
    if columns is None and not joint:
        return functions
    others = further_columns(fitted) if joint else None if functions is None else functions.raw
    found = [each for each in (columns, others) if each is not None]
    if not found:
        return None
    raw = np.concatenate(found)
    if joint:
        with np.errstate(divide="ignore"):
            sd = 1 / np.linalg.norm(fitted.whitening.root, axis=1)
        raw = seen_columns(raw, sd)
    return Functions.of(raw, fitted.whitening.columns(raw)) if len(raw) else None


def exact_basis(drift: RandomEffect, values: Values, observed: Observations) -> FloatArray:
    """Functions (t, t) of a drift that have the covariance of the exact process at the times of the touches."""
    size, length = values[:FREE]
    order, gap = gaps(observed)
    session = np.empty(len(order), dtype=np.intp)
    session[order] = np.cumsum(np.isinf(gap))
    time = observed.touch_time_s
    correlation = matern_3_2(np.abs(time[:, None] - time) / length) * (session[:, None] == session)
    squares, axes = np.linalg.eigh(correlation)
    return np.asarray(size * axes * np.sqrt(np.maximum(squares, 0.0)))


def _scale(model: SensorModel, drift: RandomEffect, vector: FloatArray, touches: FloatArray) -> FloatArray:
    """Factor of a drift in each mean reading, (t, m)."""
    return drift.scale(replace(model.poses(vector), signal=touches - model.zero(vector)))
