"""Ridges of the posterior of a model with effects: which values of an effect the data may leave open."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.effects.effect import Effect
from bayestouch.sampling.ridge import Linearise, Ridge, Ridges, follow


def ridges_of(
    effects: Sequence[Effect],
    first: int,
    moved: IntArray,
    linearise: Linearise,
    vector: FloatArray,
    covariance: FloatArray,
    bounds: tuple[FloatArray, FloatArray],
    *,
    with_bounds: bool,
) -> Ridges:
    """Ridges of the posterior of a model, one for each effect whose shape may be undetermined.

    The amplitude of an effect multiplies a shape, which depends on further values (a time, a width). If the touches
    determine such a value poorly, as a time constant that is longer than a touch, only the product of amplitude and
    shape is known. The value has a log-normal prior, and its effect has an amplitude without bounds.

    Parameters
    ----------
    effects : sequence of Effect
        Effects in the order of their values.
    first : int
        Index of the first of their values in the vector.
    moved : (c,) int array
        Entries of the vector that are shifted with their most probable value along a ridge.
    linearise : callable
        Gradient and precision of the log posterior.
    vector : (d,) array
        The mode.
    covariance : (d, d) array
        Of the normal approximation; it tells the value that is least determined against its prior.
    bounds : pair of (d,) arrays
        Lowest and highest value of each entry.
    with_bounds : bool
        Whether values with bounds follow the ridge, too. Then their bounds in the new coordinates change along it
        (`Ridge.limits`).
    """
    found: list[Ridge] = []
    for effect in effects:
        at = np.arange(first, first + len(effect.parameters))
        first += len(at)
        bounded = np.isfinite(bounds[0][at]) | np.isfinite(bounds[1][at])
        shape = [each.null is None and each.logarithmic for each in effect.parameters]
        scales = [int(i) for i in np.flatnonzero(np.array(shape) & ~bounded)]
        if not scales or all(bounded[i] for i in effect.amplitudes):
            continue
        prior = [effect.parameters[i].normal_prior for i in scales]
        k = int(np.argmax([covariance[at[i], at[i]] / p[1] ** 2 for i, p in zip(scales, prior, strict=True)]))
        free = int(at[scales[k]])
        scaled = at[(at != free) & (with_bounds | ~bounded)]
        ridge = follow(linearise, vector, free, bounds, prior[k][:2], scaled, moved)
        found += [] if ridge is None else [ridge]
    return Ridges(tuple(found))
