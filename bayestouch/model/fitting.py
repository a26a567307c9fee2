"""Maximum a posteriori fits of a sensor model with effects and random functions of time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray
from bayestouch.effects.effect import Values
from bayestouch.effects.random import RandomEffect
from bayestouch.model.base import Predicted, SensorModel, deviation_left
from bayestouch.model.linear import Functions, Linearised, leaving_bounds
from bayestouch.model.noise import NoiseModel
from bayestouch.model.observations import Observations
from bayestouch.model.whitening import Whitening

Drift = tuple[RandomEffect, Values]

MAX_ITERATIONS = 30
# Gain of a step (half sum of squares) after which a fit ends: far below one standard deviation of any parameter.
SETTLED = 0.05
# Largest number of fits with functions of a gain drift as they are, and the relative change that requires another.
FOLLOWED, MOVED = 4, 0.05


@dataclass(frozen=True, eq=False)
class Fitted:
    """A model at its maximum a posteriori.

    Attributes
    ----------
    model : SensorModel
        Model of a finger or a pad, with its effects.
    vector : (d,) array
        Parameters at the mode.
    drifts : tuple of (RandomEffect, values)
        Random functions of time, with fixed sd, correlation time and kind.
    noise : NoiseModel
        Noise of one reading and of the loads.
    whitening : Whitening
        Whitening of the readings with this noise.
    linear : Linearised
        The model linearised at the mode.
    """

    model: SensorModel
    vector: FloatArray
    drifts: tuple[Drift, ...]
    noise: NoiseModel
    whitening: Whitening
    linear: Linearised

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects in the model: of the chain, drifts, noise."""
        drifts = tuple(drift.name for drift, _ in self.drifts)
        return tuple(effect.name for effect in self.model.effects) + drifts + self.noise.names

    @property
    def drifted(self) -> FloatArray:
        """Contribution of the random functions to the mean reading of each touch, (t, m)."""
        if self.linear.functions is None:
            return np.zeros_like(self.model.known.means.readings)
        return np.asarray(np.tensordot(self.linear.weights(), self.linear.functions.raw, axes=1))

    @property
    def last_drifted(self) -> FloatArray:
        """Contribution of the random function that was added last to the mean reading of each touch, (t, m)."""
        assert self.linear.functions is not None
        own = len(drift_columns(self.model, self.vector, self.drifts[-1:]))
        return np.asarray(np.tensordot(self.linear.weights()[-own:], self.linear.functions.raw[-own:], axes=1))

    @property
    def n_readings(self) -> int:
        """Number of mean readings in the fit: touches times elements, without missing ones."""
        return int(self.whitening.present.sum())

    def chi_square(self) -> float:
        """Sum of squares of the whitened residuals of the mean readings."""
        return float((self.linear.plain**2).sum())

    @property
    def excess(self) -> float:
        """Half the difference between chi-square and its expected value under noise alone."""
        return 0.5 * (self.chi_square() - self.n_readings)


def drift_columns(
    model: SensorModel,
    vector: FloatArray,
    drifts: tuple[Drift, ...],
    basis_of: Callable[[RandomEffect, Values, Observations], FloatArray] | None = None,
) -> FloatArray:
    """Basis functions of all drifts at each touch, in the unit of the readings, (k, t, m), by default `drift_basis`."""
    observed = model.known
    recording = replace(model.poses(vector), signal=model.predict(vector).touches - model.zero(vector))
    out = [np.zeros((0, *recording.signal.shape))]
    for drift, values in drifts:
        basis = (basis_of or drift_basis)(drift, values, observed)
        out.append(spread_over_elements(basis.T, drift.scale(recording), own=drift.own(values)))
    return np.concatenate(out)


def drift_basis(drift: RandomEffect, values: Values, observed: Observations) -> FloatArray:
    """Basis (t, k) of a drift at the time of each touch; each session has its own functions."""
    time, out = observed.touch_time_s, []
    sessions = observed.sessions or (observed.span,)
    for k, (low, high) in enumerate(sessions):
        inside = (time >= low) & (time <= high)
        if k + 1 < len(sessions):
            # A session may begin when the one before ends: a touch at that time belongs to the later one.
            inside &= time < sessions[k + 1][0]
        out.append(np.where(inside[:, None], drift.basis(time, values, low, high), 0.0))
    return np.concatenate(out, axis=1)


def spread_over_elements(basis: FloatArray, scale: FloatArray, *, own: bool) -> FloatArray:
    """Basis (k, t) or (k, t, m) times `scale` (t, m) as columns (k, t, m); (m k, t, m) if each element has its own."""
    full = basis[:, :, None] * scale if basis.ndim == 2 else basis * scale
    if not own:
        return np.asarray(full)
    m, k = scale.shape[1], len(basis)
    columns = np.zeros((m, k, *scale.shape))
    for e in range(m):
        columns[e, :, :, e] = full[:, :, e]
    return columns.reshape(m * k, *scale.shape)


def functions_of(
    model: SensorModel,
    vector: FloatArray,
    whitening: Whitening,
    drifts: tuple[Drift, ...],
    further: FloatArray | Functions | None = None,
) -> Functions | None:
    """Random functions of the drifts and `further` ones (k, t, m), whitened; None if there are none."""
    if isinstance(further, Functions):
        assert not drifts, "functions that are whitened already cannot be combined with drifts"
        return further
    if not drifts and further is None:
        return None
    raw = _all_columns(model, vector, drifts, further)
    return Functions.of(raw, whitening.columns(raw))


def _all_columns(
    model: SensorModel, vector: FloatArray, drifts: tuple[Drift, ...], further: FloatArray | None
) -> FloatArray:
    """Basis functions of the drifts and `further` ones at each touch, (k, t, m)."""
    raw = drift_columns(model, vector, drifts)
    return raw if further is None else np.concatenate([raw, further])


def _compared(
    model: SensorModel, vector: FloatArray, predicted: Predicted, whitening: Whitening, functions: Functions | None
) -> Linearised:
    """Residuals of what the model predicts at a vector, as a `Linearised` without derivatives."""
    observed = model.known
    deviation = deviation_left(observed.deviation, predicted.samples)
    mean, spread, _, _ = model.prior()
    residual = whitening.touches(observed.means.readings - predicted.touches)
    return Linearised(
        residual=residual,
        jacobian=np.zeros((residual.size, 0)),
        deviation=whitening.samples(deviation),
        deviation_jacobian=None,
        touch=observed.row_touch,
        pull=mean - vector,
        precision=1 / spread**2,
        functions=functions,
    )


def linearised(
    model: SensorModel, vector: FloatArray, whitening: Whitening, functions: Functions | None = None
) -> Linearised:
    """The model linearised at a vector."""
    predicted, touches, samples = model.with_derivatives(vector)
    d = len(vector)
    return replace(
        _compared(model, vector, predicted, whitening, functions),
        jacobian=np.ascontiguousarray(whitening.touches(touches).reshape(d, -1).T),
        deviation_jacobian=None if samples is None else whitening.samples(samples).reshape(d, -1).T,
    )


def fit(
    model: SensorModel,
    start: FloatArray,
    noise: NoiseModel,
    drifts: tuple[Drift, ...] = (),
    *,
    whitening: Whitening | None = None,
    further: FloatArray | Functions | None = None,
    enough: float = SETTLED,
) -> Fitted:
    """Maximum a posteriori by damped Gauss-Newton steps.

    Parameters
    ----------
    model : SensorModel
        Model with the observations to fit.
    start : (d,) array
        Starting vector.
    noise : NoiseModel
        Noise of one reading and of the loads.
    drifts : tuple of (RandomEffect, values)
        Random functions of time.
    whitening : Whitening, optional
        Fixed whitening, for fits that are compared with each other; by default that at `start`.
    further : (k, t, m) array or Functions, optional
        Further random functions: mean readings per unit of each of their standard normal weights. `Functions` belong to
        `whitening`, and cannot be combined with drifts.
    enough : float
        The fit ends when the gain of a step (half sum of squares) is below this.
    """
    _, _, low, high = model.prior()
    margin = 1e-9 * np.where(np.isfinite(high - low), high - low, 1.0)
    vector = np.clip(start, low + margin, high - margin)
    if whitening is None:
        whitening = Whitening.of(model.known, noise, model.predict(vector).touches, model.by_load(vector))
    low, high = low + margin, high - margin
    functions = functions_of(model, vector, whitening, drifts, further)
    for left in reversed(range(FOLLOWED)):
        vector, linear = _descended(model, vector, whitening, functions, low, high, margin, enough)
        if functions is None or not drifts or not left:
            break
        # The functions of a gain drift are proportional to the signal: update them if the signal has changed much.
        assert not isinstance(further, Functions)
        now = _all_columns(model, vector, drifts, further)
        if _nearly_equal(now, functions.raw):
            break
        functions = Functions.of(now, whitening.columns(now))
    # A parameter at a bound whose step points outside is fixed and absorbs no part of the residual.
    _, held = _step(linear, vector, low + margin, high - margin)
    return Fitted(model, vector, drifts, noise, whitening, linear.holding(held))


def _nearly_equal(now: FloatArray, then: FloatArray) -> bool:
    """Whether functions (k, t, m) have changed by less than the share `MOVED`."""
    return float(((now - then) ** 2).sum()) < MOVED**2 * float((then**2).sum())


def _descended(
    model: SensorModel,
    vector: FloatArray,
    whitening: Whitening,
    functions: Functions | None,
    low: FloatArray,
    high: FloatArray,
    margin: FloatArray,
    enough: float,
) -> tuple[FloatArray, Linearised]:
    """Vector of minimum cost between the bounds, by damped Gauss-Newton steps, and the model linearised there."""
    linear = linearised(model, vector, whitening, functions)
    for _ in range(MAX_ITERATIONS):
        step, _ = _step(linear, vector, low + margin, high - margin)
        cost, share = linear.cost(), 1.0
        moved = vector
        while share > 1e-3:
            moved = np.clip(vector + share * step, low, high)
            if _cost(model, moved, whitening, functions) < cost:
                break
            share *= 0.3
        else:
            break
        vector, linear = moved, linearised(model, moved, whitening, functions)
        if cost - linear.cost() < enough:
            break
    return vector, linear


def _cost(model: SensorModel, vector: FloatArray, whitening: Whitening, functions: Functions | None) -> float:
    """Minus the log posterior at a vector, up to a constant; infinite where the prediction is, far beyond what fits."""
    with np.errstate(over="ignore", invalid="ignore"):
        predicted = model.predict(vector)
        # The residual of a missing reading is NaN, too: without this a prediction of NaN would seem to fit.
        if not all(np.isfinite(each).all() for each in (predicted.touches, predicted.samples) if each is not None):
            return np.inf
        return _compared(model, vector, predicted, whitening, functions).cost()


def fit_from_both(
    model: SensorModel,
    start: FloatArray,
    noise: NoiseModel,
    drifts: tuple[Drift, ...] = (),
    *,
    whitening: Whitening | None = None,
    enough: float = SETTLED,
) -> Fitted:
    """The best of the fits from `start` and, if that fit ends far from the nominal body, from the nominal body.

    There the effects first have the values of the fit from `start`. These may have adapted to a wrong body: if the
    second fit is worse than the first one, a third begins with the nominal body and the effects of `start`.
    """
    one = fit(model, start, noise, drifts, whitening=whitening, enough=enough)
    home = model.reset_to_nominal(one.vector)
    if home is None:
        return one
    found = [one, fit(model, home, noise, drifts, whitening=one.whitening, enough=enough)]
    if found[1].linear.cost() > one.linear.cost() + enough:
        again = np.append(home[: model.n_base], start[model.n_base :])
        found.append(fit(model, again, noise, drifts, whitening=one.whitening, enough=enough))
    return min(found, key=lambda each: each.linear.cost())


def _step(
    linear: Linearised, vector: FloatArray, low: FloatArray, high: FloatArray
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Step to the maximum, and which parameters are fixed because they are at a bound and the step points outside."""
    return linear.step_within(leaving_bounds(vector, low, high))
