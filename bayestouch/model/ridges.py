"""Ridges of the posterior of a model with effects: which values of an effect the data may leave open."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.effects.effect import Effect, places_of_values
from bayestouch.sampling.ridge import Linearise, Ridge, Ridges, follow, product_ridge

# A share of all elements and the excesses of the elements form a ridge if the share, given the excesses, is known to
# less than this part of its standard deviation, and if it is so many standard deviations from zero: at zero the
# excesses have no meaning.
GIVEN_EXCESSES, FROM_ZERO = 0.3, 3.0


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
    with_products: bool = False,
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
    with_products : bool
        Whether a ridge of the other kind is looked for: of the share of all elements, which is multiplied by 1 plus the
        excess of each element. Readings determine the products, and the priors of the excesses the share.
    """
    found: list[Ridge] = []
    for effect, place in zip(effects, places_of_values(effects, first), strict=True):
        at = np.arange(place.start, place.stop)
        product = _product_ridge(effect, at, vector, covariance) if with_products else None
        if product is not None:
            found.append(product)
            continue
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


def _product_ridge(effect: Effect, at: IntArray, vector: FloatArray, covariance: FloatArray) -> Ridge | None:
    """Ridge of the share of all elements of an effect, whose values are the entries `at`; None if there is none."""
    own = [i for i, each in enumerate(effect.parameters) if each.of_element and each.null is None]
    # Where the amplitude is zero the effect does nothing: excesses multiply it. That of a logarithm is elsewhere.
    shares = [i for i in effect.amplitudes if effect.parameters[i].null == 0.0]
    if not own or not shares:
        return None
    share, excesses = int(at[shares[0]]), at[own]
    together = np.append(excesses, share)
    given = 1 / np.sqrt(np.linalg.inv(covariance[np.ix_(together, together)])[-1, -1])
    sd = np.sqrt(covariance[share, share])
    if given > GIVEN_EXCESSES * sd or abs(vector[share]) < FROM_ZERO * sd:
        return None
    priors = [effect.parameters[i].normal_prior[:2] for i in (shares[0], *own)]
    return product_ridge(vector, share, excesses, priors[0], priors[1:])
