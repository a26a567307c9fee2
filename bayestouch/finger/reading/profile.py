"""Proposal for touches on a finger with a tabulated, not normal, distribution of the radius.

Near an edge or a flat the posterior of R is truncated or skewed, while location and load for given R are nearly normal.
The marginal of ``w = log(R/(r_b - R))`` is therefore tabulated (Laplace approximation of the integral over location
and load at each knot), and location and load are proposed given w.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bayestouch.array_types import FloatArray, IndexArray
from bayestouch.finger.reading.conditional_modes import conditional_modes, root_of_inverse
from bayestouch.finger.reading.reader import FingerPosterior
from bayestouch.sampling import BlockStreams

# Number of knots: the log density is linear between them. With 17 the ratio to the posterior varies by 3 %, and the
# Pareto shape of its tail is too large.
KNOTS = 25
# Range of the knots in Laplace sd from the mode, and largest |w| (R within 2 µm of edge or flat).
REACH, FURTHEST = 6.5, 9.0
# Decay rate of the proposal beyond the knots; that of the density is 1 (Jacobian of the transform).
TAIL = 0.9
# Degrees of freedom of the Student-t for location and load: heavier tails than the posterior, for bounded weights, but
# close enough to it for an effective sample size of 98 %.
DOF = 20.0
TINY = 1e-16


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
        Lower Cholesky factor of the scale matrix of (θ_c, P): ``l11, l21, l22``.
    """

    first: FloatArray
    step: FloatArray
    log_marginal: FloatArray
    centre: FloatArray
    root: FloatArray

    @property
    def n_blocks(self) -> int:
        """Number of blocks B."""
        return len(self.first)

    @property
    def dimension(self) -> int:
        """Three: w, θ_c, P."""
        return 3

    def select(self, blocks: ArrayLike) -> ProfileProposal:
        """Proposal of some of the blocks, by position or mask."""
        index = np.asarray(blocks)
        some = ProfileProposal(
            self.first[index], self.step[index], self.log_marginal[index], self.centre[index], self.root[index]
        )
        some.__dict__["_pieces"] = self._pieces.select(index)
        return some

    @cached_property
    def _pieces(self) -> _Pieces:
        return _Pieces.of(self)

    def draw(self, streams: BlockStreams, n: int) -> tuple[FloatArray, FloatArray]:
        """Draw n points per block, (B, n, 3), and return them with their log density, (B, n)."""
        pieces = self._pieces
        uniform, energy = streams.uniform(2, n), streams.exponential(n)
        where, place = uniform[:, 0], uniform[:, 1]
        at = np.empty(where.shape, dtype=np.intp)
        for row, ends, numbers in zip(at, pieces.ends, where, strict=True):
            row[:] = ends.searchsorted(numbers, side="right")
        at += pieces.rows
        # The rest of the uniform number gives the position inside the piece, by the inverse distribution function.
        lean, start = pieces.slope.take(at), pieces.start.take(at)
        grown = (where - pieces.below.take(at)) * pieces.inverse.take(at)
        offset = np.log1p(np.maximum(grown * lean - pieces.drop.take(at), TINY - 1)) / lean
        x = np.swapaxes(np.empty((self.n_blocks, 3, n)), 1, 2)
        np.add(pieces.knot.take(at), offset, out=x[..., 0])
        angle, load, l11, l21, l22 = pieces.given(at, offset)
        # The square of a bivariate Student-t is DOF (e^(2E/DOF) - 1), E standard exponential; its direction is uniform.
        turn = (2 * np.pi * place).astype(np.float32)  # 24 bits of direction, at a tenth of the cost
        z1, z2 = np.cos(turn).astype(np.float64), np.sin(turn).astype(np.float64)
        length = np.sqrt(DOF * np.expm1(2 / DOF * energy) / (z1 * z1 + z2 * z2))
        z1 *= length
        z2 *= length
        np.add(angle, l11 * z1, out=x[..., 1])
        np.add(load, l21 * z1 + l22 * z2, out=x[..., 2])
        log_q = start + lean * offset
        log_q -= (DOF + 2) / DOF * energy + np.log(2 * np.pi * l11 * l22)
        return x, log_q

    def log_density(self, x: FloatArray) -> FloatArray:
        """Log density, normalised, (B, n, 3) -> (B, n)."""
        pieces, w = self._pieces, x[..., 0]
        at = np.floor((w - self.first[:, None]) / self.step[:, None]).astype(np.intp) + 1
        at = np.clip(at, 0, self.log_marginal.shape[1]) + pieces.rows
        offset = w - pieces.knot.take(at)
        angle, load, l11, l21, l22 = pieces.given(at, offset)
        z1 = (x[..., 1] - angle) / l11
        z2 = (x[..., 2] - load - l21 * z1) / l22
        student = -(DOF + 2) / 2 * np.log1p((z1 * z1 + z2 * z2) / DOF) - np.log(2 * np.pi * l11 * l22)
        return np.asarray(pieces.start.take(at) + pieces.slope.take(at) * offset + student)


@dataclass(frozen=True, eq=False)
class _Pieces:
    """Values that a `ProfileProposal` uses for each point: arrays (B, g + 1) by piece of w, if not stated otherwise.

    Piece 0 is the lower tail, which ends at the first knot; piece g is the upper tail; the others start at their knot.
    """

    rows: IndexArray  # (B, 1): start of a block in the flattened arrays
    ends: FloatArray  # (B, g): cumulative mass up to the end of each piece except the last
    below: FloatArray  # mass of the pieces before
    knot: FloatArray
    start: FloatArray  # log density at the knot, and its slope
    slope: FloatArray
    inverse: FloatArray  # 1/density at the knot
    drop: FloatArray  # 1 in the lower tail, whose mass is counted from minus infinity
    share: FloatArray  # 1/step; 0 in the tails, where location and load do not depend on w
    values: FloatArray  # (5, B, g + 1): centre and root of (θ_c, P) at the knot, and their change to the next
    rises: FloatArray

    @classmethod
    def of(cls, proposal: ProfileProposal) -> _Pieces:
        """Pieces of a proposal, with its marginal normalised."""
        n_blocks, g = proposal.log_marginal.shape
        step = proposal.step[:, None]
        height = proposal.log_marginal - proposal.log_marginal.max(axis=1, keepdims=True)
        density = np.exp(height)
        # A constant piece gets a small slope, to avoid division by zero; its mass is accurate to 1e-9.
        rise = np.diff(height, axis=1)
        rise = np.where(np.abs(rise) < 1e-8, 1e-8, rise)
        mass = np.concatenate(
            [density[:, :1] / TAIL, density[:, :-1] * np.expm1(rise) / rise * step, density[:, -1:] / TAIL], axis=1
        )
        total = mass.sum(axis=1, keepdims=True)
        ends = np.cumsum(mass / total, axis=1)
        knots = np.maximum(np.arange(g + 1) - 1, 0)
        edge, none = np.full((n_blocks, 1), TAIL), np.zeros((5, n_blocks, 1))
        start = height[:, knots] - np.log(total)
        at_knots = np.concatenate([np.moveaxis(proposal.centre, -1, 0), np.moveaxis(proposal.root, -1, 0)])
        inside = (np.arange(g + 1) > 0) & (np.arange(g + 1) < g)
        return cls(
            rows=(g + 1) * np.arange(n_blocks)[:, None],
            ends=ends[:, :-1],
            below=np.concatenate([np.zeros((n_blocks, 1)), ends[:, :-1]], axis=1),
            knot=proposal.first[:, None] + step * knots,
            start=start,
            slope=np.concatenate([edge, rise / step, -edge], axis=1),
            inverse=np.exp(-start),
            drop=np.broadcast_to(np.arange(g + 1) == 0, start.shape).astype(float),
            share=inside / step,
            values=np.ascontiguousarray(at_knots[:, :, knots]),
            rises=np.concatenate([none, np.diff(at_knots, axis=2), none], axis=2),
        )

    def select(self, index: NDArray[Any]) -> _Pieces:
        """Pieces of some of the blocks, by index or mask."""
        by_block = {name: getattr(self, name)[index] for name in _BY_BLOCK}
        rows = self.rows[: len(by_block["ends"])]
        return _Pieces(rows=rows, values=self.values[:, index], rises=self.rises[:, index], **by_block)

    def given(self, at: IndexArray, offset: FloatArray) -> list[FloatArray]:
        """Centre (θ_c, P) and root (l11, l21, l22) at `offset` from the knot of the pieces `at`."""
        share = offset * self.share.take(at)
        return [value.take(at) + share * rise.take(at) for value, rise in zip(self.values, self.rises, strict=True)]


_BY_BLOCK = ("ends", "below", "knot", "start", "slope", "inverse", "drop", "share")


def profile_proposal(posterior: FingerPosterior, mode: FloatArray, hessian: FloatArray) -> ProfileProposal:
    """Proposal for every touch: marginal of w, and location and load given w.

    Parameters
    ----------
    posterior : FingerPosterior
        Posterior with its reading table.
    mode, hessian : (t, 3), (t, 3, 3) arrays
        From `find_modes` and `hessian_at`.
    """
    spread = np.sqrt(np.linalg.inv(hessian)[:, 0, 0])
    low = np.clip(mode[:, 0] - REACH * spread, -FURTHEST, FURTHEST - 1.0)
    high = np.clip(mode[:, 0] + REACH * spread, low + 0.5 * spread, FURTHEST + 1.0)
    step = (high - low) / (KNOTS - 1)
    w = low[:, None] + step[:, None] * np.arange(KNOTS)
    # Location and load start on the regression on w of the Laplace approximation; Newton steps at each knot follow.
    lean = np.linalg.solve(hessian[:, 1:, 1:], -hessian[:, 1:, :1])[..., 0]
    rest = (
        mode[:, None, 1:]
        + lean[:, None] * np.clip(w - mode[:, :1], -3 * spread[:, None], 3 * spread[:, None])[..., None]
    )
    lows, highs = np.array([posterior.priors.location.support, posterior.priors.load.support]).T
    rest = np.clip(rest, lows + 1e-9, np.minimum(highs, 1e12) - 1e-9)
    centre, value, curvature = conditional_modes(posterior, w, rest)
    root = root_of_inverse(curvature)
    marginal = value + np.log(root[..., 0]) + np.log(root[..., 2])
    # A knot with density zero gets a small density, so that the proposal covers everything possible.
    top = np.nanmax(np.where(np.isfinite(marginal), marginal, -np.inf), axis=1, keepdims=True)
    marginal = np.where(np.isfinite(marginal), np.maximum(marginal, top - 40.0), top - 40.0)
    return ProfileProposal(
        first=low,
        step=step,
        log_marginal=marginal,
        centre=centre,
        root=root,
    )
