"""Which touches may be at a distant location: a weak touch, or one beside the elements, may fit at several of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray
from bayestouch.data.arrays import nearest_turn
from bayestouch.finger.reading.modes import BESIDE, GRID_STEP, Match, find_modes, hessian_at, moved_inside
from bayestouch.finger.reading.reader import TURN, FingerPosterior

# Distance of another location that fits about as well (rad), and how much worse it may fit (log density).
APART, AS_WELL = np.radians(6.0), 8.0
# A mode so near to the middle of an element (rad) has the other side at the next template: half a step.
AT_THE_MIDDLE = 0.5 * GRID_STEP


def distant_places(posterior: FingerPosterior, mode: FloatArray, matched: Sequence[Match]) -> FloatArray:
    """Place (w, θ_c, P), (t, 3), farther than `APART` from the mode (t, 3) of each touch, that fits best.

    `matched` are the `matches` of the posterior.
    """
    out, best = mode.copy(), np.full(len(mode), np.inf)
    for w, angles, load, misfit, _ in matched:
        misfit = np.where(np.abs(nearest_turn(angles - mode[:, 1:2], 0.0, TURN)) > APART, misfit, np.inf)
        k = misfit.argmin(axis=1)
        rows = np.arange(len(k))
        better = misfit[rows, k] < best
        best = np.where(better, misfit[rows, k], best)
        out[better] = np.stack([np.full(len(k), w), angles[k], load[rows, k]], axis=1)[better]
    return moved_inside(posterior, out)


def fits_as_well(posterior: FingerPosterior, mode: FloatArray, place: FloatArray) -> BoolArray:
    """Whether readings and load of each touch fit at a place (t, 3) about as well as at the mode (t, 3), (t,)."""
    x = np.stack([mode, place], axis=1)
    rest = posterior.residual(x, np.arange(len(x))).astype(np.float64)
    misfit = (rest**2).sum(axis=2)
    miss = np.nan_to_num((x[..., 2] - posterior.touches.load[:, None]) / posterior.touches.load_sd[:, None])
    misfit += miss**2
    return np.asarray(misfit[:, 1] - misfit[:, 0] < 2 * AS_WELL)


def across_the_element(posterior: FingerPosterior, mode: FloatArray, places: FloatArray) -> FloatArray:
    """The `other_places` (t, k, 3) and the place across the element that is nearest to the mode, (t, k + 1, 3).

    Sides of an element that are nearer to each other than two steps of the templates have one minimum of the misfit.
    Where a touch has no other place, the place across is as far from the element as the mode (t, 3), half a step at
    least; it counts if it fits about as well as the mode. Where the mode is at the middle of an element, the other
    place is at one side for sharper indenters, and the place across is at the other side.
    """
    count = np.isfinite(places[..., 0]).sum(axis=1)
    elements = np.broadcast_to(posterior.chain.angle, (len(mode), len(posterior.chain.angle)))
    if posterior.priors.whole_turn:
        elements = nearest_turn(elements, mode[:, 1:2], TURN)
    angle = mode[:, 1:2] - elements
    rows, nearest = np.arange(len(mode)), np.abs(angle).argmin(axis=1)
    off, element = angle[rows, nearest], elements[rows, nearest]
    out = np.concatenate([places, np.full((len(mode), 1, 3), np.nan)], axis=1)
    alone = np.flatnonzero((count == 0) & (np.abs(off) < BESIDE))
    if len(alone):
        across = mode[alone]
        across[:, 1] = element[alone] - np.copysign(np.maximum(np.abs(off[alone]), AT_THE_MIDDLE), off[alone])
        across = moved_inside(posterior, across)
        fits = fits_as_well(posterior.select(alone), mode[alone], across)
        out[alone[fits], 0] = across[fits]
    middle = np.flatnonzero((count > 0) & (np.abs(off) < AT_THE_MIDDLE))
    across = places[middle, 0]
    across[:, 1] = 2 * element[middle] - across[:, 1]
    out[middle, count[middle]] = moved_inside(posterior, across)
    return out


def branches(posterior: FingerPosterior, mode: FloatArray, places: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
    """Where a touch may be, as centres (t, 3) and Hessians (t, 3, 3): about its mode, and by way of its other places.

    From each of the `other_places` (t, k, 3) a search leads to a mode, another one or that which is known. In the
    second case, for radii other than that of the mode, the location may still have a mode near the other place: both
    sides of an element come together at one radius. So there is a branch about the mode that is found, and one with its
    range of w that starts at the other place for every w.
    """
    out = [(mode, hessian_at(posterior, mode))]
    for k in range(places.shape[1]):
        start = places[:, k]
        found = find_modes(posterior, start)
        hessian = hessian_at(posterior, found)
        level = hessian.copy()
        level[:, 0, 0] = 1 / np.linalg.inv(hessian)[:, 0, 0]
        level[:, 0, 1:] = level[:, 1:, 0] = 0.0
        out += [(found, hessian), (np.concatenate([found[:, :1], start[:, 1:]], axis=1), level)]
    return out
