"""How well the values of an effect of the noise are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayestouch.effects.effect import Values
from bayestouch.effects.noise import NoiseEffect
from bayestouch.model.fitting import Fitted
from bayestouch.model.noise_search import TouchScatter, maximum

# Groups of touches that are left out in turn.
GROUPS = 8


def jackknife(fitted: Fitted, effect: NoiseEffect) -> Values:
    """Standard deviations of an effect's values: fits without each of some groups of touches (Efron, 1982).

    The curvature of the likelihood would not do: the scale of the whole noise is taken from the same samples.

    Parameters
    ----------
    fitted : Fitted
        The model before the effect was added.
    effect : NoiseEffect
        The effect.
    """
    scatter = TouchScatter.of(fitted)
    if scatter is None:
        return tuple(float("nan") for _ in effect.parameters)
    found = []
    for group in range(GROUPS):
        rows = scatter.touch % GROUPS != group
        part = rescaled(scatter, rows)

        def log_likelihood(values: Values, part: TouchScatter = part) -> float:
            return float(part.log_density(effect, values).sum())

        found.append(maximum(effect, log_likelihood)[0])
    values = np.array(found)
    squares = ((values - values.mean(axis=0)) ** 2).sum(axis=0) * (GROUPS - 1) / GROUPS
    return tuple(float(each) for each in np.sqrt(squares))


def rescaled(scatter: TouchScatter, rows: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> TouchScatter:
    """Some of the samples, with the scale of their own noise."""
    z, weight = scatter.z[rows], scatter.weight[rows]
    present = ~np.isnan(z)
    total = np.maximum((present * weight[:, None]).sum(axis=0), 1e-300)
    size = np.sqrt((np.where(present, z, 0.0) ** 2 * weight[:, None]).sum(axis=0) / total)
    size = np.where(size > 0, size, 1.0)
    return replace(
        scatter,
        z=z / size,
        signal=scatter.signal[rows],
        sd=scatter.sd * size,
        weight=weight,
        touch=scatter.touch[rows],
        half=scatter.half[rows],
    )
