"""Proposal for touches on a finger that follows the posterior of the radius wherever it is not normal.

Near an edge or a flat the posterior of R is cut off or drawn out, while location and load, given R, stay all but
normal. So the marginal of ``w = log(R/(r_b - R))`` is tabulated (Laplace's integral over location and load at each
knot) and location and load are proposed given w.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bayestouch.inference.finger_reader import FingerPosterior
from bayestouch.sampling import BlockStreams

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]

KNOTS = 17
# Knots reach this many Laplace sds from the mode, and no further than |w| = 9 (R within 2 µm of edge or flat).
REACH, FURTHEST = 6.5, 9.0
# Beyond the knots the density falls as e^-|w| (the transform's Jacobian); the proposal a little slower.
TAIL = 0.9
# Of the Student-t for location and load: heavier than the posterior, so that the ratio stays bounded.
DOF = 8.0
# Steps of the derivatives: two cells of the reading table, and a share of the load.
ANGLE_STEP, LOAD_STEP = 3e-3, 3e-3
LEAST_WEIGHT = 1e-3


@dataclass(frozen=True, eq=False)
class ProfileProposal:
    """Piecewise exponential in w, Student-t in (θ_c, P) given w; B blocks, g knots. A `BlockProposal`.

    Attributes
    ----------
    first, step : (B,) arrays
        First knot and spacing in w.
    log_marginal : (B, g) array
        Log density of w at the knots, up to a constant.
    centre : (B, g, 2) array
        Mode of (θ_c, P) given w at the knots, rad and N/m.
    root : (B, g, 3) array
        Lower Cholesky factor of their scale matrix: ``l11, l21, l22``.
    """

    first: FloatArray
    step: FloatArray
    log_marginal: FloatArray
    centre: FloatArray
    root: FloatArray

    @property
    def n_blocks(self) -> int:
        """B."""
        return len(self.first)

    @property
    def dimension(self) -> int:
        """Three: w, θ_c, P."""
        return 3

    def select(self, blocks: ArrayLike) -> ProfileProposal:
        """Proposal of some of the blocks, by position or mask."""
        index = np.asarray(blocks)
        return ProfileProposal(
            self.first[index], self.step[index], self.log_marginal[index], self.centre[index], self.root[index]
        )

    @cached_property
    def _pieces(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Normalised log density at the knots (B, g), slope (B, g + 1) and cumulative mass (B, g + 1) of the pieces.

        Piece 0 is the lower tail, piece g the upper one.
        """
        height = self.log_marginal - self.log_marginal.max(axis=1, keepdims=True)
        slope = np.diff(height, axis=1) / self.step[:, None]
        density = np.exp(height)
        rise = np.diff(height, axis=1)
        # mean of e^y over a linear piece: (e^y1 - e^y0)/(y1 - y0), or e^y0 where it is level
        level = np.abs(rise) < 1e-8
        mean = np.where(level, density[:, :-1], np.diff(density, axis=1) / np.where(level, 1.0, rise))
        mass = np.concatenate([density[:, :1] / TAIL, mean * self.step[:, None], density[:, -1:] / TAIL], axis=1)
        total = mass.sum(axis=1, keepdims=True)
        edges = np.full((len(slope), 1), TAIL)
        return height - np.log(total), np.concatenate([edges, slope, -edges], axis=1), np.cumsum(mass / total, axis=1)

    def draw(self, streams: BlockStreams, n: int) -> tuple[FloatArray, FloatArray]:
        """Draw n points a block, (B, n, 3), and give their log density, (B, n)."""
        height, slope, cumulative = self._pieces
        uniform = streams.uniform(3, n)
        piece = np.empty((self.n_blocks, n), dtype=np.intp)
        for row, sums, numbers in zip(piece, cumulative, uniform[:, 0], strict=True):
            row[:] = np.searchsorted(sums[:-1], numbers, side="right")
        x = np.swapaxes(np.empty((self.n_blocks, 3, n)), 1, 2)
        # What is left of the uniform number places the point inside its piece, by the inverse of the piece's mass.
        below = np.take_along_axis(np.pad(cumulative, ((0, 0), (1, 0))), piece, axis=1)
        left = np.maximum(uniform[:, 0] - below, 0.0)
        k = np.maximum(piece - 1, 0)  # the piece's lower knot; the lower tail hangs on the first one
        lean = np.take_along_axis(slope, piece, axis=1)
        start = np.take_along_axis(height, k, axis=1)
        knot = self.first[:, None] + k * self.step[:, None]
        grown = left * np.exp(-start)
        flat = np.abs(lean) < 1e-8
        safe = np.where(flat, 1.0, lean)
        # Inside: start e^{lean s} integrates to `left`. Lower tail: from minus infinity, e^{lean s}/lean = left.
        inside = np.where(flat, grown, np.log1p(np.maximum(grown * safe, -1 + 1e-12)) / safe)
        tail = np.log(np.maximum(grown * TAIL, 1e-300)) / TAIL
        offset = np.where(piece == 0, tail, inside)
        x[..., 0] = knot + offset
        squares = DOF * (np.maximum(uniform[:, 1], 1e-300) ** (-2 / DOF) - 1)
        length, turn = np.sqrt(squares), 2 * np.pi * uniform[:, 2]
        centre, root = self._given(x[..., 0])
        z1, z2 = length * np.cos(turn), length * np.sin(turn)
        x[..., 1] = centre[0] + root[0] * z1
        x[..., 2] = centre[1] + root[1] * z1 + root[2] * z2
        return x, start + lean * offset + _log_t(squares, root)

    def log_density(self, x: FloatArray) -> FloatArray:
        """Log density, normalised, (B, n, 3) -> (B, n)."""
        height, slope, _ = self._pieces
        w = x[..., 0]
        g = height.shape[1]
        place = (w - self.first[:, None]) / self.step[:, None]
        piece = np.clip(np.floor(place).astype(np.intp) + 1, 0, g)
        k = np.maximum(piece - 1, 0)
        marginal = np.take_along_axis(height, k, axis=1) + np.take_along_axis(slope, piece, axis=1) * (
            w - self.first[:, None] - k * self.step[:, None]
        )
        centre, root = self._given(w)
        z1 = (x[..., 1] - centre[0]) / root[0]
        z2 = (x[..., 2] - centre[1] - root[1] * z1) / root[2]
        return np.asarray(marginal + _log_t(z1 * z1 + z2 * z2, root))

    def _given(self, w: FloatArray) -> tuple[list[FloatArray], list[FloatArray]]:
        """Centre and root of (θ_c, P) given w, by linear interpolation between knots; the end knots' beyond them."""
        g = self.log_marginal.shape[1]
        place = np.clip((w - self.first[:, None]) / self.step[:, None], 0.0, g - 1.000001)
        k = place.astype(np.intp)
        share = place - k
        flat = k + np.arange(self.n_blocks)[:, None] * g

        def between(values: FloatArray) -> FloatArray:
            table = values.ravel()
            lower = table.take(flat)
            return np.asarray(lower + share * (table.take(flat + 1) - lower))

        centre = [between(np.ascontiguousarray(self.centre[..., i])) for i in range(2)]
        root = [between(np.ascontiguousarray(self.root[..., i])) for i in range(3)]
        return centre, root


def _log_t(squares: FloatArray, root: list[FloatArray]) -> FloatArray:
    """Log density of a bivariate Student-t of `DOF` degrees of freedom: ``1/(2π |L|) (1 + r²/ν)^(-(ν+2)/2)``."""
    return np.asarray(-(DOF + 2) / 2 * np.log1p(squares / DOF) - np.log(2 * np.pi * root[0] * root[2]))


def profile_proposal(posterior: FingerPosterior, mode: FloatArray, hessian: FloatArray) -> ProfileProposal:
    """Tabulate the marginal of w and the rest given w for every touch.

    Parameters
    ----------
    posterior : FingerPosterior
        With its reading table.
    mode, hessian : (t, 3), (t, 3, 3) arrays
        From `find_modes`.
    """
    t = len(mode)
    spread = np.sqrt(np.linalg.inv(hessian)[:, 0, 0])
    low = np.clip(mode[:, 0] - REACH * spread, -FURTHEST, FURTHEST - 1.0)
    high = np.clip(mode[:, 0] + REACH * spread, low + 0.5 * spread, FURTHEST + 1.0)
    step = (high - low) / (KNOTS - 1)
    w = low[:, None] + step[:, None] * np.arange(KNOTS)
    # Location and load follow w along the Laplace fit's regression; one Newton step at each knot mends what is left.
    lean = np.linalg.solve(hessian[:, 1:, 1:], -hessian[:, 1:, :1])[..., 0]
    rest = (
        mode[:, None, 1:]
        + lean[:, None] * np.clip(w - mode[:, :1], -3 * spread[:, None], 3 * spread[:, None])[..., None]
    )
    lows, highs = np.array([posterior.priors.location.support, posterior.priors.load.support]).T
    rest = np.clip(rest, lows + 1e-9, np.minimum(highs, 1e12) - 1e-9)
    value, gradient, curvature = _expand(posterior, w, rest, np.arange(t))
    step_to = np.linalg.solve(curvature, gradient[..., None])[..., 0]
    # A step further than three sds says the expansion does not hold there: take three sds.
    length = np.sqrt(np.einsum("tgi,tgij,tgj->tg", step_to, curvature, step_to))
    step_to *= np.minimum(1.0, 3.0 / np.maximum(length, 1e-12))[..., None]
    gain = 0.5 * np.minimum(length, 3.0) ** 2
    root = np.linalg.cholesky(np.linalg.inv(curvature))
    volume = np.log(root[..., 0, 0]) + np.log(root[..., 1, 1])
    marginal = value + gain + volume
    # A knot that reads as impossible still gets a little, so that nothing possible is left out.
    top = np.nanmax(np.where(np.isfinite(marginal), marginal, -np.inf), axis=1, keepdims=True)
    marginal = np.where(np.isfinite(marginal), np.maximum(marginal, top - 40.0), top - 40.0)
    return ProfileProposal(
        first=low,
        step=step,
        log_marginal=marginal,
        centre=rest + step_to,
        root=np.stack([root[..., 0, 0], root[..., 1, 0], root[..., 1, 1]], axis=-1),
    )


def _expand(
    posterior: FingerPosterior, w: FloatArray, rest: FloatArray, blocks: NDArray[np.int64]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Log density (t, g), its gradient (t, g, 2) and minus its Gauss-Newton Hessian (t, g, 2, 2) in (θ_c, P)."""
    t, g = w.shape
    steps = np.stack([np.full(w.shape, ANGLE_STEP), LOAD_STEP * np.maximum(rest[..., 1], 1e-3)], axis=-1)
    moves = np.array([[0.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    places = rest[:, :, None] + moves * steps[:, :, None]
    x = np.concatenate([np.broadcast_to(w[:, :, None, None], (t, g, 5, 1)), places], axis=-1).reshape(t, g * 5, 3)
    z = posterior.residual(x, blocks).reshape(t, g, 5, -1)
    prior = posterior.log_prior(x, blocks).reshape(t, g, 5)
    value = prior[..., 0] - 0.5 * np.einsum("tgm,tgm->tg", z[:, :, 0], z[:, :, 0])
    jacobian = np.stack([z[:, :, 1] - z[:, :, 2], z[:, :, 3] - z[:, :, 4]], axis=2) / (2 * steps[..., None])
    gradient = -np.einsum("tgim,tgm->tgi", jacobian, z[:, :, 0])
    curvature = np.einsum("tgim,tgjm->tgij", jacobian, jacobian)
    inside: NDArray[np.bool_] = np.all(np.isfinite(prior), axis=-1, keepdims=True)
    safe = np.where(inside, prior, 0.0)
    gradient += np.stack([safe[..., 1] - safe[..., 2], safe[..., 3] - safe[..., 4]], axis=-1) / (2 * steps)
    bend = -np.stack(
        [safe[..., 1] - 2 * safe[..., 0] + safe[..., 2], safe[..., 3] - 2 * safe[..., 0] + safe[..., 4]], axis=-1
    )
    curvature[..., [0, 1], [0, 1]] += np.maximum(bend / steps**2, 0.0)
    # Never singular: at least a thousandth of the information that spans the prior's width.
    low, high = posterior.priors.location.support
    curvature[..., 0, 0] += 1 / (high - low) ** 2
    curvature[..., 1, 1] += LEAST_WEIGHT / np.maximum(rest[..., 1], 1e-3) ** 2
    return value, gradient, curvature
