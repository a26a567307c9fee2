"""Errors of the calibration of a pad that its elements share at a place, as changes of the map.

The load of a calibration touch is known up to an error, which changes the readings of all elements of this touch
together. The errors of neighbouring gains are therefore correlated; a parameter of the kernel correlates all elements.
Given the loads and the kernel the elements are independent. Both are integrated out here: about the mode, the
sensitivities at a place have errors with the covariance ``G S Gᵀ``. S is the covariance of the errors of the loads and
the kernel given all readings, and G is what one unit of each of them changes in the sensitivities.

Of these errors, those matter that look like another load or another place: a touch that is read with the map is
displaced by them. They are kept in full. In one coordinate these are two independent causes at each place, in two
coordinates three, however many touches there are: a touch is read in about the same time. The rest of the shared
errors, which no displaced touch would show, counts as independent.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import solve_triangular

from bayestouch.array_types import FloatArray
from bayestouch.chain.pad_map import PadMap
from bayestouch.data.arrays import read_once
from bayestouch.model.linear import conditioned, covariance_of, with_covariance_of
from bayestouch.pad.candidates import PadCandidate, kernel_shape
from bayestouch.pad.priors import prior_precision
from bayestouch.pad.residual_map import MapDiscrepancy
from bayestouch.priors.parameters import Prior

# Shared errors count as independent if the standard deviations of location and load, of touches with many reads, then
# differ by less than the first share at least at the second share of all places: infer then takes a fifth to a third
# less time. The other places are those at the ends, where a touch is hardly located.
NEGLIGIBLE, PLACES = 0.05, 0.95
# Grid points that are computed together: 40 MB with eight elements and 400 weights.
CHUNK = 1500
# Information about load and place, over that of a touch whose load and place are known to a whole load and a whole
# region, and variances over the largest: what is less is rounding.
LEAST = 1e-9


def with_shared_errors(map_: PadMap, model: PadCandidate, priors: Sequence[Prior]) -> PadMap:
    """The map with the errors that elements share as `PadMap.shared`, and with variances given loads and kernel.

    The same map if shared errors are negligible.

    Parameters
    ----------
    map_ : PadMap
        Tables of the model; their variances are those of all errors together.
    model : PadCandidate
        A calibrated pad; m elements.
    priors : sequence of Prior
        Priors of the entries of its chain.
    """
    errors = _SharedErrors.of(model, priors)
    load = float(np.median(model.fit.known.load))
    axes = (a + s * np.arange(n) for a, s, n in zip(map_.origin, map_.step, map_.sensitivity.shape, strict=False))
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    points = grid.reshape(-1, grid.shape[-1])
    signal = load * map_.sensitivity.reshape(-1, map_.n_elements)
    seen = np.isfinite(errors.misfit.variance).any(axis=0)
    counts = np.maximum(np.median(read_once(model.fit.known.counts), axis=0), 1.0)
    noise = model.noise.mean_variance(counts + np.zeros_like(signal), signal)
    offset_variance = np.array([spread[1, 1] for spread in errors.spread])
    tables = []
    for first in range(0, len(points), CHUNK):
        part = slice(first, first + CHUNK)
        found, variance, covariance = errors.at(points[part], load)
        alone = offset_variance + load * (2 * covariance + load * variance)
        weight = np.where(seen, load**2 / np.maximum(noise[part] + alone, 1e-300), 0.0)
        tangent, fit, moves, rest = _displaced(map_, points[part], weight, found)
        if model.place_error:
            moves = _displaced_more(moves, model.place_error / (map_.high - map_.low))
        lasting = (alone + model.noise.lasting_variance(signal[part])) / load**2
        apart = (fit**2 @ (lasting + (found**2).sum(axis=2))[..., None])[..., 0]
        together = (fit**2 @ (lasting + rest)[..., None])[..., 0] + (moves**2).sum(axis=2)
        changed = np.abs(np.sqrt(apart / np.maximum(together, 1e-300)) - 1).max(axis=1)
        tables.append((moves.swapaxes(1, 2) @ tangent, variance + rest, covariance, changed))
    shared, variance, covariance, changed = (np.concatenate(each) for each in zip(*tables, strict=True))
    if not model.place_error and np.quantile(changed[map_.inside(points)], PLACES) < NEGLIGIBLE:
        return map_
    return replace(
        map_,
        offset_variance=offset_variance,
        variance=variance.reshape(map_.variance.shape),
        covariance=covariance.reshape(map_.covariance.shape),
        shared=shared.reshape(*grid.shape[:-1], -1),
    )


def _displaced(
    map_: PadMap, points: FloatArray, weight: FloatArray, found: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """The part of shared errors (k, m, r) that looks like another load or place, and the variance of the rest.

    The first is the weighted least-squares fit of a displaced touch; `weight` (k, m) are inverse variances of readings
    over the load.

    Returns
    -------
    tangent, fit : (k, D + 1, m) arrays
        Change of the readings over the load by load and place of a touch, and of the fitted load and place by readings.
    moves : (k, D + 1, D + 1) array
        Change of load and place by each of D + 1 independent causes.
    rest : (k, m) array
        Variance of the rest. It counts as independent, and would displace a touch, too: the causes are smaller for it.
    """
    by_load, slope = map_.slopes(points)
    # One unit is the whole load, or the whole region.
    width = map_.high - map_.low
    tangent = np.concatenate([by_load[:, None], width[:, None] * slope], axis=1)
    pulled = tangent * weight[:, None]
    eye = np.eye(tangent.shape[1])
    fit = np.linalg.solve(pulled @ tangent.swapaxes(1, 2) + LEAST * eye, pulled)
    moved = fit @ found
    rest = np.maximum((found**2).sum(axis=2) - ((tangent.swapaxes(1, 2) @ moved) ** 2).sum(axis=2), 0.0)
    spread = moved @ moved.swapaxes(1, 2)
    root = _root(spread)
    by_rest = np.linalg.solve(root, fit)
    share, axes = np.linalg.eigh((by_rest * rest[:, None]) @ by_rest.swapaxes(1, 2))
    kept = (axes * np.sqrt(np.maximum(1 - share, 0.0))[:, None]) @ axes.swapaxes(1, 2)
    return tangent, fit, root @ kept, rest


def _displaced_more(moves: FloatArray, place: FloatArray) -> FloatArray:
    """As `moves` (k, D + 1, D + 1) of `_displaced`, with independent errors of the place (D,), over the region."""
    return _root(moves @ moves.swapaxes(1, 2) + np.diag(np.append(0.0, place**2)))


def _root(spread: FloatArray) -> FloatArray:
    """Cholesky factors of covariances (k, d, d): they change smoothly from place to place."""
    size = np.sqrt(np.einsum("kii->ki", spread)) + LEAST
    scaled = spread / size[:, :, None] / size[:, None]
    return np.asarray(size[:, :, None] * np.linalg.cholesky(scaled + LEAST * np.eye(spread.shape[1])))


@dataclass(frozen=True, eq=False)
class _SharedErrors:
    """Errors of loads and kernel given all readings, and what they change; m elements, r independent causes.

    Attributes
    ----------
    model : PadCandidate
        The pad.
    misfit : MapDiscrepancy
        Its map, with the noise that readings have given the loads.
    spread : tuple of (p, p) arrays
        Covariance of gain, offset and coordinates of each element, given loads and kernel.
    own : tuple of (p + q, r) arrays
        Change of these and of the q parameters of the kernel by each cause.
    weights : tuple of (k, r) arrays
        Change of the weights of the map of each element.
    """

    model: PadCandidate
    misfit: MapDiscrepancy
    spread: tuple[FloatArray, ...]
    own: tuple[FloatArray, ...]
    weights: tuple[FloatArray, ...]

    @classmethod
    def of(cls, model: PadCandidate, priors: Sequence[Prior]) -> _SharedErrors:
        fit = model.fit
        known, present = fit.known, fit.misfit.present
        signal = fit.predicted() - fit.chain.offset
        noise = model.noise.mean_variance(read_once(known.counts), signal)
        misfit = replace(fit.misfit, variance=np.where(present, np.maximum(noise, 1e-300), np.inf))
        by_load = np.where(present, model.load_errors[:, None] * signal, 0.0)
        precision = np.array([prior_precision(*each) for each in zip(priors, fit.chain.flat, strict=True)])
        n, kernels = len(by_load), len(fit.chain.kernel.parameters)
        information = np.diag(np.append(np.ones(n), precision[len(precision) - kernels :]))
        spreads, own, weights = [], [], []
        for e, (columns, jacobian) in enumerate(fit.jacobian):
            covariance = misfit.covariances[e]
            jacobian = np.where(present[:, e, None], jacobian, 0.0)
            first, kernel = np.split(jacobian, [jacobian.shape[1] - kernels], axis=1)
            shared = np.concatenate([np.diag(by_load[:, e]), kernel], axis=1)
            pulled, pull = covariance.solve(shared), covariance.solve(first)
            spread = covariance_of(first.T @ pull + np.diag(precision[columns[: first.shape[1]]]))
            moved = -spread @ (pull.T @ shared)
            information += shared.T @ (pulled + pull @ moved)
            spreads.append(spread)
            own.append(np.concatenate([moved, np.eye(n + kernels)[n:]]))
            weights.append(-covariance.weights(shared + first @ moved))
        if kernels:
            # Bounds cut off the posterior of the kernel, which is as wide as in the fit.
            rows = n + np.arange(kernels)
            information = with_covariance_of(information, rows, fit.laplace.covariance[-kernels:, -kernels:])
        scale = np.sqrt(np.diag(information))
        root = np.linalg.cholesky(conditioned(information / np.outer(scale, scale)))
        # Covariance of the shared unknowns: (R Rᵀ)^-1, in units of the scale.
        both = np.concatenate([*own, *weights]) / scale
        both = solve_triangular(root, both.T, lower=True).T
        if len(both) < both.shape[1]:
            both = np.asarray(np.linalg.qr(both.T, mode="r")).T
        ends = np.cumsum([len(each) for each in (*own, *weights)])[:-1]
        parts = np.split(both, ends)
        return cls(model, misfit, tuple(spreads), tuple(parts[: len(own)]), tuple(parts[len(own) :]))

    def at(self, points: FloatArray, load: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Change of the sensitivity, with that of the offset over the load, by each cause at points (k, D), (k, m, r).

        Then the variance of the sensitivity given loads and kernel, and its covariance with the offset, (k, m) each.
        """
        fit = self.model.fit
        derivative, m = fit.chain.sensitivity_derivatives(points), fit.chain.n_elements
        shape = kernel_shape(self.model.shape, points)
        out = np.empty((len(points), m, self.own[0].shape[1]))
        variance, with_offset = np.zeros((len(points), m)), np.empty((len(points), m))
        for e, (columns, jacobian) in enumerate(fit.jacobian):
            spread, covariance = self.spread[e], self.misfit.covariances[e]
            h = derivative[:, e, columns]
            by_reading = h.copy()
            by_reading[:, 1] += 1 / load
            out[:, e] = by_reading @ self.own[e]
            h = h[:, : len(spread)]
            if self.model.has_map:
                functions = self.misfit.functions_at(e, points, shape[:, e])
                out[:, e] += functions @ self.weights[e]
                seen = np.where(self.misfit.present[:, e, None], jacobian[:, : len(spread)], 0.0)
                h = h - functions @ covariance.weights(seen)
                variance[:, e] = covariance.variance_at(self.misfit.prior_variance(e, shape[:, e]), functions)
            variance[:, e] += np.einsum("kp,pq,kq->k", h, spread, h)
            with_offset[:, e] = h @ spread[:, 1]
        return out, variance, with_offset
