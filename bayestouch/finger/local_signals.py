"""Signals of calibration touches of a finger with effects on its pose, contact or body, by polynomials near its fit.

Effects that move the touches or change the finger need a new table of contacts for each vector. Near the fit the signal
of an element over its response is a polynomial in its depth and angle, in σ and log μ, and in the values of these
effects. Values of single elements (`own_parameters`) are one variable, as the depth is: each element has a value of its
own. Effects on the signal are not part of it; they are evaluated as they are. Values of an effect that act through a
basis (`Effect.by_place`, such as the profile of the surface) are too many to be variables of the polynomials. Each
touch depends on them through one number; the signals are interpolated in this number, between polynomials at a few
levels. If there are two such effects, the change by the one with fewer values, such as the zero of the force sensor, is
linear in its number and does not depend on the other's.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import comb

import numpy as np

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.finger.levels import Levels
from bayestouch.finger.local_series import COMPARED, NODES, REACH, Polynomials, chain_coordinates, monomials, powers
from bayestouch.finger.model import FingerModel
from bayestouch.parallel.parts import of_parts

# Total degree of the polynomials for slopes over the load.
SLOPE_DEGREE = 2
# Total degrees that are tried for the signals, and the largest error (about that of a log density) of the one used.
DEGREES, LARGEST_ERROR = (3, 4, 5), 0.1
# Largest number of terms: with two thousand, polynomials take as long to prepare as thousands of exact evaluations.
MOST_TERMS = 2000
# Relative step of the derivative over the load.
SLOPE_STEP = 1e-3


@dataclass(frozen=True, eq=False)
class LocalSignals:
    """Polynomials in depth, angle, σ, log μ and some values of effects, v variables; t touches, m elements.

    Attributes
    ----------
    model : FingerModel
        Exact model, used for vectors outside the range of the polynomials.
    moved : v - 4 int arrays, (1,) or (m,)
        Positions of the values in the vector: of one that all elements have in common, or of one of each element.
    centre, half_width : (v, m) arrays
        Range of the variables, for each element.
    degree : int
        Total degree of the signals.
    levels : tuple of Levels
        Levels of each effect with a basis.
    signals, slopes : tuple of tuples of Polynomials
        Signal over response, and its derivative over the load, at each level of each of these effects. Without such an
        effect there is one polynomial of each.
    error : float
        Largest root sum of squares of the errors of the signals over the noise, at points that were not fitted.
    """

    model: FingerModel
    moved: tuple[IntArray, ...]
    centre: FloatArray
    half_width: FloatArray
    degree: int
    levels: tuple[Levels, ...]
    signals: tuple[tuple[Polynomials, ...], ...]
    slopes: tuple[tuple[Polynomials, ...], ...]
    error: float

    def __call__(self, vectors: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Signals (n, t, m) at the measured loads, and their derivative over the load (n, t, m)."""
        place = (_variables(self.model, self.moved, vectors) - self.centre[:, None]) / self.half_width[:, None]
        outside = (np.abs(place) > 1).any(axis=(0, 2))
        response = self.model.sign * np.exp(vectors[:, self.model.layout.response])
        terms = (monomials(place, self.degree) * response).transpose(2, 0, 1)
        along = [each.place(vectors) for each in self.levels]
        for number in along:
            outside = outside | (np.abs(number) > 1).any(axis=1)
        signals, slopes = (self._between(groups, terms, along) for groups in (self.signals, self.slopes))
        for i in np.flatnonzero(outside):
            signals[i], slopes[i] = exact_signal(self.model, vectors[i])
        return signals, slopes

    def _between(
        self, groups: tuple[tuple[Polynomials, ...], ...], terms: FloatArray, along: list[FloatArray]
    ) -> FloatArray:
        """Signals or slopes (n, t, m) between the levels of the first effect, with the changes by the others."""
        if not self.levels:
            return groups[0][0](terms)
        out = list[FloatArray]()
        for levels, group, place in zip(self.levels, groups, along, strict=True):
            at_levels = [each(terms) for each in group]
            here = levels.between(at_levels, place)
            out.append(here - levels.between(at_levels, np.zeros_like(place)) if out else here)
        return np.asarray(sum(out))


@dataclass(frozen=True, eq=False)
class ExactSignals:
    """Signals of the exact model, one vector after the other, for posteriors that are too wide for polynomials."""

    model: FingerModel
    error: float = 0.0

    def __call__(self, vectors: FloatArray) -> tuple[FloatArray, FloatArray]:
        """See `LocalSignals`."""
        found = of_parts(lambda vector: exact_signal(self.model, vector), list(vectors))
        signals, slopes = (np.stack(each) for each in zip(*found, strict=True))
        return signals, slopes


def local_signals(
    model: FingerModel, centre: FloatArray, sd: FloatArray, noise_sd: FloatArray
) -> LocalSignals | ExactSignals:
    """Polynomials about a vector, of the lowest degree that is accurate enough; else the exact signals.

    Parameters
    ----------
    model : FingerModel
        The finger with its effects.
    centre, sd : (d,) arrays
        Vector of the coordinates of the chain with the values of the effects, and their standard deviations.
    noise_sd : (t, m) array
        Standard deviation of a mean reading; inf where missing.
    """
    earlier: Evaluated | None = None
    for degree in DEGREES:
        found = _of_degree(model, centre, sd, noise_sd, degree, earlier)
        if found is None:
            break
        local, earlier = found
        if local.error < LARGEST_ERROR:
            return local
    return ExactSignals(model)


@dataclass(frozen=True, eq=False)
class Evaluated:
    """The exact model at nodes, of l models (the levels of an effect, or one).

    Attributes
    ----------
    signals : (n, l, t, m) array
        Signals at n nodes.
    slopes : (s, l, t, m) array
        Derivative over the load at the first s of them: for slopes fewer nodes are enough.
    """

    signals: FloatArray
    slopes: FloatArray


def _of_degree(
    model: FingerModel,
    centre: FloatArray,
    sd: FloatArray,
    noise_sd: FloatArray,
    degree: int,
    earlier: Evaluated | None,
) -> tuple[LocalSignals, Evaluated | None] | None:
    """Polynomials of a total degree, see `local_signals`; None if they have too many terms.

    The nodes of a degree begin with those of the degree before, `earlier`, which are not evaluated again. Where an
    effect has levels, these depend on the degree: then there is nothing to keep.
    """
    at, d = model.layout, len(centre)
    _, _, lowest, highest = model.prior()
    low, high = np.maximum(centre - REACH * sd, lowest), np.minimum(centre + REACH * sd, highest)
    middle, half = 0.5 * (low + high), np.maximum(0.5 * (high - low), 1e-12)
    levels = Levels.all_of(model, centre, sd, degree)
    moved = _moved(model, levels)
    variables = 4 + len(moved)
    if comb(degree + variables, degree) > MOST_TERMS:
        return None
    count = int(NODES * len(powers(degree, variables))) + COMPARED
    nodes = np.sin(np.pi / 2 * np.random.default_rng(0).uniform(-1, 1, (count, variables)))
    vectors = np.repeat(centre[None, :d], count, axis=0)
    places: tuple[slice | int | IntArray, ...] = (at.depth, at.angle, at.sigma, at.log_mu, *moved)
    for place, node in zip(places, nodes.T, strict=True):
        vectors[:, place] = middle[place] + np.multiply.outer(node, half[place])
    response = model.sign * np.exp(centre[at.response])
    noise = noise_sd / np.abs(response)
    compared, fitted = vectors[:COMPARED].copy(), vectors[COMPARED:]
    rng = np.random.default_rng(1)
    for each in levels:
        compared[:, each.places] = each.centre + rng.standard_normal((COMPARED, len(each.centre))) * each.sd
    signals, slopes = list[tuple[Polynomials, ...]](), list[tuple[Polynomials, ...]]()
    # Slopes weigh little, and two degrees of them are left out: twice as many nodes for each term average over these.
    for_slopes = int(2 * NODES * len(powers(SLOPE_DEGREE, variables)))
    slope_nodes, slope_noise = nodes[COMPARED : COMPARED + for_slopes], noise / model.load[:, None]
    exact: Evaluated | None = None
    for at_levels in [each.models(model) for each in levels] or [[model]]:
        exact = _exact_at(at_levels, fitted, for_slopes, earlier)
        by_signal, by_slope = (np.moveaxis(each, 1, 0) / response for each in (exact.signals, exact.slopes))
        signals.append(tuple(Polynomials.of(nodes[COMPARED:], each, degree, noise) for each in by_signal))
        slopes.append(tuple(Polynomials.of(slope_nodes, each, SLOPE_DEGREE, slope_noise) for each in by_slope))
    local = LocalSignals(
        model,
        moved,
        _variables(model, moved, middle),
        _variables(model, moved, half),
        degree,
        levels,
        tuple(signals),
        tuple(slopes),
        0.0,
    )
    true = np.stack([_signal(model, vector) for vector in compared])
    off = (local(compared)[0] / response - true / response) / noise
    return replace(local, error=float(np.sqrt((off**2).sum(axis=(1, 2))).max())), None if levels else exact


def _exact_at(
    at_levels: list[FingerModel], vectors: FloatArray, for_slopes: int, earlier: Evaluated | None
) -> Evaluated:
    """The model at each of l levels, for vectors (n, d), slopes for the first ones; those of `earlier` are known.

    For each vector all levels are evaluated in turn, since the chain keeps tables that they share.
    """
    known = 0 if earlier is None else len(earlier.signals)
    first, rest = list(vectors[known:for_slopes]), list(vectors[max(known, for_slopes) :])
    both = of_parts(lambda vector: [exact_signal(model, vector) for model in at_levels], first)
    alone = of_parts(lambda vector: [_signal(model, vector) for model in at_levels], rest)
    found = np.array([*([signal for signal, _ in each] for each in both), *alone])
    if earlier is not None:
        return Evaluated(np.concatenate([earlier.signals, found]), earlier.slopes)
    return Evaluated(found, np.array([[slope for _, slope in each] for each in both]))


def exact_signal(model: FingerModel, vector: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Signal (t, m) that leaves the body, and its derivative over the load as read."""
    step = SLOPE_STEP * model.load
    up, here = _signal(model, vector, model.load + step), _signal(model, vector)
    return here, (up - here) / step[:, None]


def _signal(model: FingerModel, vector: FloatArray, load: FloatArray | None = None) -> FloatArray:
    """Signal (t, m) that leaves the body, at the loads as read or `load` (t,)."""
    return model.signal(vector, model.load if load is None else load).signal


def _moved(model: FingerModel, levels: tuple[Levels, ...]) -> tuple[IntArray, ...]:
    """Positions of the values of effects that change the pose or the finger, without those of the levels."""
    out = list[IntArray]()
    on_levels = {int(position) for each in levels for position in each.places}
    for effect, place in zip(model.effects, model.value_places, strict=True):
        if effect.changes_pose or effect.changes_finger:
            own = [i for i, each in enumerate(effect.parameters, place.start) if each.of_element]
            shared = sorted({*range(place.start, place.stop)}.difference(own, on_levels))
            out += [np.array([i]) for i in shared]
            out += [np.array(own)] if own else []
    return tuple(out)


def _variables(model: FingerModel, moved: tuple[IntArray, ...], vectors: FloatArray) -> FloatArray:
    """Variables (v, ..., m) of each element, from vectors (..., d)."""
    own = chain_coordinates(model.layout, vectors)
    values = [np.broadcast_to(vectors[..., positions], own.shape[1:]) for positions in moved]
    return np.concatenate([own, np.stack(values)]) if values else own
