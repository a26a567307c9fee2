"""Fits of a finger with effects to its touches, with random functions of time beside the parameters."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray
from bayestouch.effects.effect import Values
from bayestouch.effects.random import RandomEffect
from bayestouch.model.base import SensorModel
from bayestouch.model.linear import Functions, Linearised
from bayestouch.model.noise import NoiseModel
from bayestouch.model.observations import Observations
from bayestouch.model.whitening import Whitening

Drift = tuple[RandomEffect, Values]

MAX_ITERATIONS = 30
# Half the sum of squares: what is gained below this is far below one standard deviation of any parameter.
SETTLED = 0.05
# How often a gain drift's functions are taken anew at most, and the share of them whose change calls for it.
FOLLOWED, MOVED = 4, 0.05


@dataclass(frozen=True, eq=False)
class Fitted:
    """A model at its maximum a posteriori.

    Attributes
    ----------
    model : SensorModel
        Of a finger or a pad, with its effects.
    vector : (d,) array
        Parameters at the mode.
    drifts : tuple of (RandomEffect, values)
        Random functions of time, their hyper-parameters held.
    noise : NoiseModel
        Noise of one reading and of the loads.
    whitening : Whitening
        What it makes of the touches.
    linear : Linearised
        Around the mode.
    """

    model: SensorModel
    vector: FloatArray
    drifts: tuple[Drift, ...]
    noise: NoiseModel
    whitening: Whitening
    linear: Linearised

    @property
    def names(self) -> tuple[str, ...]:
        """Effects in the model."""
        drifts = tuple(drift.name for drift, _ in self.drifts)
        return tuple(effect.name for effect in self.model.effects) + drifts + self.noise.names

    @property
    def drifted(self) -> FloatArray:
        """What the random functions add to the mean reading of each touch, (t, m)."""
        if self.linear.functions is None:
            return np.zeros_like(self.model.known.means.readings)
        return np.asarray(np.tensordot(self.linear.weights(), self.linear.functions.raw, axes=1))

    @property
    def n_readings(self) -> int:
        """Mean readings that are compared: touches times elements, less what is missing."""
        return int(self.whitening.present.sum())

    def chi_square(self) -> float:
        """Sum of squares of the whitened means' residuals."""
        return float((self.linear.plain**2).sum())

    @property
    def excess(self) -> float:
        """Half the sum of squares beyond what noise alone makes."""
        return 0.5 * (self.chi_square() - self.n_readings)


def drift_columns(model: SensorModel, vector: FloatArray, drifts: tuple[Drift, ...]) -> FloatArray:
    """Basis functions of the drifts for each touch, (k, t, m)."""
    observed = model.known
    recording = replace(model.poses(vector), signal=model.predict(vector).touches - model.zero(vector))
    out = [np.zeros((0, *recording.signal.shape))]
    for drift, values in drifts:
        basis = drift_basis(drift, values, observed)
        out.append(spread_over_elements(basis.T, drift.scale(recording), own=drift.own(values)))
    return np.concatenate(out)


def drift_basis(drift: RandomEffect, values: Values, observed: Observations) -> FloatArray:
    """Basis (t, k) of a drift at the time of each touch: functions of their own for each session."""
    time, out = observed.touch_time_s, []
    for low, high in observed.sessions or (observed.span,):
        inside = (time >= low) & (time <= high)
        out.append(np.where(inside[:, None], drift.basis(time, values, low, high), 0.0))
    return np.concatenate(out, axis=1)


def spread_over_elements(basis: FloatArray, scale: FloatArray, *, own: bool) -> FloatArray:
    """Columns (k, t, m), or (m k, t, m) of each element's `own`, from basis (k, t) or (k, t, m) and scale (t, m)."""
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
    """Random functions of the drifts and `further` ones (k, t, m), whitened; None without any."""
    if isinstance(further, Functions):
        assert not drifts, "functions that are whitened already stand alone"
        return further
    if not drifts and further is None:
        return None
    raw = drift_columns(model, vector, drifts)
    if further is not None:
        raw = np.concatenate([raw, further])
    return Functions.of(raw, whitening.columns(raw))


def _compared(model: SensorModel, vector: FloatArray, whitening: Whitening, functions: Functions | None) -> Linearised:
    """The model at a vector compared with its data, without derivatives."""
    observed, predicted = model.known, model.predict(vector)
    deviation = observed.deviation if predicted.samples is None else observed.deviation - predicted.samples
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
    """The model made linear around a vector."""
    touches, samples = model.derivatives(vector)
    d = len(vector)
    return replace(
        _compared(model, vector, whitening, functions),
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
        What is fitted.
    start : (d,) array
        Where to start.
    noise : NoiseModel
        Noise of one reading and of the loads.
    drifts : tuple of (RandomEffect, values)
        Random functions of time.
    whitening : Whitening, optional
        Whitening to keep, for fits that are to be compared; by default that at `start`.
    further : (k, t, m) array or Functions, optional
        Further random functions: what each of their weights, standard normal, adds to the mean readings. `Functions`
        are those of this whitening, and there are no drifts beside them.
    enough : float
        Gain of a step, in half sums of squares, after which no other is taken.
    """
    _, _, low, high = model.prior()
    margin = 1e-9 * np.where(np.isfinite(high - low), high - low, 1.0)
    vector = np.clip(start, low + margin, high - margin)
    if whitening is None:
        whitening = Whitening.of(model.known, noise, model.predict(vector).touches, model.by_load(vector))
    low, high = low + margin, high - margin
    functions = functions_of(model, vector, whitening, drifts, further)
    for _ in range(FOLLOWED):
        vector, linear = _descended(model, vector, whitening, functions, low, high, margin, enough)
        # Functions of a gain drift follow the signal: little, unless that has moved far.
        if functions is None or not drifts:
            break
        now = functions_of(model, vector, whitening, drifts, further)
        if now is None or _nearly_equal(now.raw, functions.raw):
            break
        functions = now
    # A parameter at a bound that would leave it neither moves nor absorbs anything.
    _, held = _step(linear, vector, low + margin, high - margin)
    return Fitted(model, vector, drifts, noise, whitening, linear.holding(held))


def _nearly_equal(now: FloatArray, then: FloatArray) -> bool:
    """Whether functions (k, t, m) have hardly changed."""
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
    """Vector of the least cost between bounds, by damped Gauss-Newton steps, and the model made linear around it."""
    linear = linearised(model, vector, whitening, functions)
    for _ in range(MAX_ITERATIONS):
        step, _ = _step(linear, vector, low + margin, high - margin)
        cost, share = linear.cost(), 1.0
        moved = vector
        while share > 1e-3:
            moved = np.clip(vector + share * step, low, high)
            if _compared(model, moved, whitening, functions).cost() < cost:
                break
            share *= 0.3
        else:
            break
        vector, linear = moved, linearised(model, moved, whitening, functions)
        if cost - linear.cost() < enough:
            break
    return vector, linear


def fit_from_both(
    model: SensorModel,
    start: FloatArray,
    noise: NoiseModel,
    drifts: tuple[Drift, ...] = (),
    *,
    whitening: Whitening | None = None,
    enough: float = SETTLED,
) -> Fitted:
    """The better of two fits: from `start`, and from the finger as built where the first is still far from that."""
    one = fit(model, start, noise, drifts, whitening=whitening, enough=enough)
    home = model.reset_to_nominal(one.vector)
    if home is None:
        return one
    two = fit(model, home, noise, drifts, whitening=one.whitening, enough=enough)
    return min(one, two, key=lambda each: each.linear.cost())


def _step(
    linear: Linearised, vector: FloatArray, low: FloatArray, high: FloatArray
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Step to the maximum, and which parameters are held: they lie at a bound and would leave it."""
    return linear.step_within(lambda step: ((vector <= low) & (step < 0)) | ((vector >= high) & (step > 0)))
