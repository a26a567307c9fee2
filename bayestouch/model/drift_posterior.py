"""Size and correlation time of the drifts that were found, with their uncertainty."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.effects.effect import Values
from bayestouch.model.fitting import Drift, Fitted, drift_columns, fit, functions_of
from bayestouch.model.linear import Linearised, Scorer, with_functions

# Grids about what the search chose, which tries sizes a factor of two apart, and times of three; then about the best
# time, in standard deviations of its logarithm.
SIZES, TIMES, AROUND = np.geomspace(0.25, 4.0, 81), np.geomspace(0.4, 2.5, 5), np.linspace(-2.5, 2.5, 6)


def settled_drifts(fitted: Fitted) -> tuple[Fitted, dict[str, Values]]:
    """The model fitted anew with the posterior mean of each drift's size and time, and their standard deviations.

    The weights of the functions, and the parameters near their mode, are integrated out.
    """
    drifts, spreads = list(fitted.drifts), {}
    for i, (effect, _) in enumerate(fitted.drifts):
        values, spreads[effect.name] = drift_posterior(fitted, i)
        drifts[i] = (effect, values)
    if not drifts:
        return fitted, {}
    return fit(fitted.model, fitted.vector, fitted.noise, tuple(drifts)), spreads


def drift_posterior(fitted: Fitted, which: int) -> tuple[Values, Values]:
    """Posterior mean and standard deviation of the size and time of one drift; its kind is held."""
    effect, (size, time, *kind) = fitted.drifts[which]
    others = tuple(drift for i, drift in enumerate(fitted.drifts) if i != which)
    functions = functions_of(fitted.model, fitted.vector, fitted.whitening, others)
    scorer = Scorer(_at_its_mode(with_functions(fitted.linear, functions)))
    of_size, of_time = (parameter.prior for parameter in effect.parameters[:2])
    sizes = size * SIZES

    def log_posterior(times: FloatArray) -> FloatArray:
        log = np.stack([_marginal(fitted, scorer, (effect, (1.0, float(t), *kind)), sizes) for t in times])
        # Grids are even in logarithms: the last terms turn densities of values into those.
        log = log + of_size.log_density(sizes) + np.log(sizes)
        return np.asarray(log + (of_time.log_density(times) + np.log(times))[:, None])

    best, spread = _peak(np.log(time * TIMES), log_posterior(time * TIMES).max(axis=1))
    times = np.exp(best + spread * AROUND)
    log = log_posterior(times)
    weight = np.exp(log - log.max())
    weight /= weight.sum()
    mean_size, mean_time = float(weight.sum(axis=0) @ sizes), float(weight.sum(axis=1) @ times)
    sd_size = float(np.sqrt(weight.sum(axis=0) @ (sizes - mean_size) ** 2))
    sd_time = float(np.sqrt(weight.sum(axis=1) @ (times - mean_time) ** 2))
    return (mean_size, mean_time, *kind), (sd_size, sd_time, *(float("nan") for _ in kind))


def _peak(x: FloatArray, log: FloatArray) -> tuple[float, float]:
    """Place and width of the highest point of a log density on an even grid, by the parabola around it."""
    k = int(np.clip(np.argmax(log), 1, len(x) - 2))
    step, (low, middle, high) = float(x[1] - x[0]), (float(each) for each in log[k - 1 : k + 2])
    bend = max(2 * middle - low - high, 1e-3) / step**2
    place = float(x[k]) + float(np.clip((high - low) / (2 * step) / bend, -step, step))
    return place, float(np.clip(1 / np.sqrt(bend), 0.02, 0.5))


def _at_its_mode(linear: Linearised) -> Linearised:
    """The linear model moved to the mode that it has without the drift, about which scores are taken."""
    step, _ = linear.step_within(lambda each: np.zeros(len(each), dtype=np.bool_))
    deviation = linear.deviation
    if linear.deviation_jacobian is not None:
        deviation = deviation - (linear.deviation_jacobian @ step).reshape(deviation.shape)
    return replace(
        linear,
        residual=linear.residual - (linear.jacobian @ step).reshape(linear.residual.shape),
        deviation=deviation,
        pull=linear.pull - step,
    )


def _marginal(fitted: Fitted, scorer: Scorer, drift: Drift, sizes: FloatArray) -> FloatArray:
    """Log marginal likelihood over the model without the drift, for each size."""
    raw = drift_columns(fitted.model, fitted.vector, (drift,))
    score = scorer.of_columns(fitted.whitening.columns(raw))
    values, axes = np.linalg.eigh(score.information)
    values, along = np.maximum(values, 0.0), axes.T @ score.slope
    scaled = 1 + sizes[:, None] ** 2 * values
    return np.asarray(0.5 * ((sizes[:, None] * along) ** 2 / scaled - np.log(scaled)).sum(axis=1))
