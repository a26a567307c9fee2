"""Signals of calibration touches of a finger with effects on its pose, contact or body, by polynomials near its fit.

Effects that move the touches or change the finger need a new table of contacts for each vector. Near the fit the signal
of an element over its response is a polynomial in its depth and angle, in σ and log μ, and in the values of these
effects. Effects on the signal are not part of it; they are evaluated as they are.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.finger.local_series import COMPARED, NODES, Polynomials, chain_coordinates, monomials, powers
from bayestouch.finger.model import FingerModel

# Range of the polynomials in standard deviations, and their total degree for slopes over the load.
REACH, SLOPE_DEGREE = 4.0, 2
# Total degrees for signals that are tried, and the error at which no higher one is: about that of a log density.
DEGREES, LARGEST_ERROR = (3, 4, 5), 0.1
# Relative step of the derivative over the load.
STEP_LOAD = 1e-3


@dataclass(frozen=True, eq=False)
class LocalSignals:
    """Polynomials in depth, angle, σ, log μ and some values of effects, v variables; t touches, m elements.

    Attributes
    ----------
    model : FingerModel
        Exact model, used for vectors outside the range of the polynomials.
    moved : (v - 4,) int array
        Positions of the values in the vector.
    centre, half_width : (v, m) arrays
        Range of the variables, for each element.
    degree : int
        Total degree of the signals.
    signals, slopes : Polynomials
        Signal over response, and its derivative over the load.
    error : float
        Largest root sum of squares of the errors of the signals over the noise, at points that were not fitted.
    """

    model: FingerModel
    moved: IntArray
    centre: FloatArray
    half_width: FloatArray
    degree: int
    signals: Polynomials
    slopes: Polynomials
    error: float

    def __call__(self, vectors: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Signals (n, t, m) at the measured loads, and their derivative over the load (n, t, m)."""
        place = (_variables(self.model, self.moved, vectors) - self.centre[:, None]) / self.half_width[:, None]
        beyond = np.flatnonzero((np.abs(place) > 1).any(axis=(0, 2)))
        response = self.model.sign * np.exp(vectors[:, self.model.layout.response])
        terms = (monomials(place, self.degree) * response).transpose(2, 0, 1)
        signals, slopes = self.signals(terms), self.slopes(terms)
        for i in beyond:
            signals[i], slopes[i] = exact_signal(self.model, vectors[i])
        return signals, slopes


@dataclass(frozen=True, eq=False)
class ExactSignals:
    """Signals without polynomials, one vector after the other: for posteriors that are too wide for them."""

    model: FingerModel
    error: float = 0.0

    def __call__(self, vectors: FloatArray) -> tuple[FloatArray, FloatArray]:
        """See `LocalSignals`."""
        found = [exact_signal(self.model, vector) for vector in vectors]
        signals, slopes = (np.stack(each) for each in zip(*found, strict=True))
        return signals, slopes


def local_signals(
    model: FingerModel, centre: FloatArray, sd: FloatArray, noise_sd: FloatArray
) -> LocalSignals | ExactSignals:
    """Polynomials about a vector, of the lowest degree that is accurate enough; none if no degree is.

    Parameters
    ----------
    model : FingerModel
        The finger with its effects.
    centre, sd : (d,) arrays
        Vector of the coordinates of the chain with the values of the effects, and their standard deviations.
    noise_sd : (t, m) array
        Standard deviation of a mean reading; inf where missing.
    """
    for degree in DEGREES:
        found = _of_degree(model, centre, sd, noise_sd, degree)
        if found.error < LARGEST_ERROR:
            return found
    return ExactSignals(model)


def _of_degree(
    model: FingerModel, centre: FloatArray, sd: FloatArray, noise_sd: FloatArray, degree: int
) -> LocalSignals:
    """Polynomials of a total degree, see `local_signals`."""
    at, d = model.layout, len(centre)
    _, _, lowest, highest = model.prior()
    low, high = np.maximum(centre - REACH * sd, lowest), np.minimum(centre + REACH * sd, highest)
    middle, half = 0.5 * (low + high), np.maximum(0.5 * (high - low), 1e-12)
    moved = _moved(model)
    variables = 4 + len(moved)
    count = int(NODES * len(powers(degree, variables))) + COMPARED
    nodes = np.sin(np.pi / 2 * np.random.default_rng(0).uniform(-1, 1, (count, variables)))
    vectors = np.repeat(centre[None, :d], count, axis=0)
    places: tuple[slice | int, ...] = (at.depth, at.angle, at.sigma, at.log_mu, *moved.tolist())
    for place, node in zip(places, nodes.T, strict=True):
        vectors[:, place] = middle[place] + np.multiply.outer(node, half[place])
    response = model.sign * np.exp(centre[at.response])
    found = [exact_signal(model, vector) for vector in vectors]
    signals, slopes = (np.stack(each) / response for each in zip(*found, strict=True))
    noise = noise_sd / np.abs(response)
    local = LocalSignals(
        model,
        moved,
        _variables(model, moved, middle),
        _variables(model, moved, half),
        degree,
        Polynomials.of(nodes[COMPARED:], signals[COMPARED:], degree, noise),
        Polynomials.of(nodes[COMPARED:], slopes[COMPARED:], SLOPE_DEGREE, noise / model.load[:, None]),
        0.0,
    )
    off = (local(vectors[:COMPARED])[0] / response - signals[:COMPARED]) / noise
    return replace(local, error=float(np.sqrt((off**2).sum(axis=(1, 2))).max()))


def exact_signal(model: FingerModel, vector: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Signal (t, m) that leaves the body, and its derivative over the load as read."""
    step = STEP_LOAD * model.load
    up, here = (model.signal(vector, model.load + times * step).signal for times in (1, 0))
    return here, (up - here) / step[:, None]


def _moved(model: FingerModel) -> IntArray:
    """Positions of the values of effects that change the pose or the finger."""
    place, out = model.n_base, list[int]()
    for effect in model.effects:
        if effect.changes_pose or effect.changes_finger:
            out += range(place, place + len(effect.parameters))
        place += len(effect.parameters)
    return np.array(out, dtype=np.intp)


def _variables(model: FingerModel, moved: IntArray, vectors: FloatArray) -> FloatArray:
    """Variables (v, ..., m) of each element, from vectors (..., d)."""
    own = chain_coordinates(model.layout, vectors)
    shared = [np.broadcast_to(vectors[..., i, None], own.shape[1:]) for i in moved]
    return np.concatenate([own, np.stack(shared)]) if shared else own
