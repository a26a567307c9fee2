"""Proposal over all locations of a touch on a finger, for posteriors with several modes or hardly any.

The prior of indenter and location is divided into cells. For each cell the likelihood at its centre is integrated over
the load, which gives the probability of the cell.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr, ndtri

from bayestouch.array_types import FloatArray, IndexArray
from bayestouch.finger.reading.indenter_coordinate import CELLS_END, IndenterCoordinate
from bayestouch.finger.reading.modes import GRID_STEP
from bayestouch.finger.reading.reader import FingerPosterior
from bayestouch.sampling import BlockStreams

# Number of cells of R with the same prior probability: a touch that may be elsewhere tells little about R.
SLICES = 16
# Step of the derivative over the load (share of the typical load), Newton steps of the load: readings are nearly linear
# in it.
LOAD_STEP, LOAD_STEPS = 1e-2, 2
# The load is proposed with an sd that is larger by this factor, because readings are not exactly linear in it; its mean
# is at most so many sd outside the prior, where its distribution function has nine digits.
WIDER, OUTSIDE = 1.1, 4.0
# Number of touches whose cells are evaluated together: 1300 cells and 16 elements are 5 MB an array.
PART = 64
# Nearest that a uniform random number comes to 0 and 1: w is then finite.
TINY = 1e-12


@dataclass(frozen=True, eq=False)
class CellsProposal:
    """Proposal over all locations and indenters; B touches, r indenters, a locations. A `BlockProposal`.

    R and θ_c are drawn from their prior within a cell, and the cell by its probability; P is normal given the cell, cut
    off at the ends of its prior.

    Attributes
    ----------
    indenter : IndenterCoordinate
        Indenters: each tip is a cell, and a density is divided into `SLICES` cells.
    angle_ends, load_ends : (float, float)
        Ends of the priors of θ_c (rad) and P (N/m).
    log_mass : (B, r, a) array
        Log probability of each cell, with sum of probabilities 1.
    load, load_sd : (B, r, a) arrays
        Mean and sd of P before it is cut off, N/m.
    """

    indenter: IndenterCoordinate
    angle_ends: tuple[float, float]
    load_ends: tuple[float, float]
    log_mass: FloatArray
    load: FloatArray
    load_sd: FloatArray

    @property
    def n_blocks(self) -> int:
        """Number of blocks B."""
        return len(self.log_mass)

    @property
    def dimension(self) -> int:
        """Three: w, θ_c, P."""
        return 3

    def select(self, blocks: ArrayLike) -> CellsProposal:
        """Proposal of some of the blocks, by position or mask."""
        index = np.asarray(blocks)
        arrays = self.log_mass[index], self.load[index], self.load_sd[index]
        return CellsProposal(self.indenter, self.angle_ends, self.load_ends, *arrays)

    def draw(self, streams: BlockStreams, n: int) -> tuple[FloatArray, FloatArray]:
        """Draw n points per block, (B, n, 3), and return them with their log density, (B, n)."""
        _, n_indenters, n_angles = self.log_mass.shape
        cell, across, along, level = np.moveaxis(streams.uniform(4, n), 1, 0)
        sums = np.cumsum(np.exp(self.log_mass.reshape(self.n_blocks, -1)), axis=1)
        which = np.stack([row.searchsorted(u * row[-1], side="right") for row, u in zip(sums, cell, strict=True)])
        which = np.minimum(which, n_indenters * n_angles - 1)
        i, j = which // n_angles, which % n_angles
        low, high = self.angle_ends
        block = np.arange(self.n_blocks)[:, None]
        load, sd, first, within = (each[block, i, j] for each in (self.load, self.load_sd, *self._load_share))
        x = np.empty((*which.shape, 3))
        x[..., 0] = indenters(self.indenter, i, across)
        x[..., 1] = low + (high - low) * (j + along) / n_angles
        x[..., 2] = np.clip(load + sd * ndtri(first + within * np.clip(level, TINY, 1 - TINY)), *self.load_ends)
        return x, self.log_density(x)

    def log_density(self, x: FloatArray) -> FloatArray:
        """Log density, normalised, (B, n, 3) -> (B, n)."""
        n_angles = self.log_mass.shape[2]
        low, high = self.angle_ends
        w = np.ascontiguousarray(x[..., 0])
        place = np.floor((x[..., 1] - low) / (high - low) * n_angles)
        j = np.clip(place, 0, n_angles - 1).astype(np.intp)
        i = self._cell_of(w)
        block = np.arange(self.n_blocks)[:, None]
        load, sd, within = (each[block, i, j] for each in (self.load, self.load_sd, self._load_share[1]))
        z = (x[..., 2] - load) / sd
        least, most = self.load_ends
        inside = (x[..., 1] >= low) & (x[..., 1] <= high) & (x[..., 2] >= least) & (x[..., 2] <= most)
        log_load = -0.5 * z * z - np.log(sd * within * np.sqrt(2 * np.pi))
        log_q = self.log_mass[block, i, j] + self._log_within(w) + np.log(n_angles / (high - low)) + log_load
        return np.where(inside, log_q, -np.inf)

    @cached_property
    def _load_share(self) -> tuple[FloatArray, FloatArray]:
        """Probabilities of the normal distribution of P below and within the ends of the prior, (B, r, a) each."""
        below, above = (ndtr((end - self.load) / self.load_sd) for end in self.load_ends)
        return below, above - below

    @cached_property
    def _ends(self) -> FloatArray:
        """Ends in w between the cells of a density, (SLICES - 1,)."""
        first = np.full(SLICES - 1, self.indenter.n_tips) + np.arange(1, SLICES)
        return indenters(self.indenter, first, np.zeros(SLICES - 1))

    def _cell_of(self, w: FloatArray) -> IndexArray:
        """Index of the cell at w, shape of `w`."""
        which = self.indenter.alternative(w)
        if self.indenter.density is None:
            return np.minimum(which, self.indenter.n_tips - 1)
        return np.where(which < self.indenter.n_tips, which, self.indenter.n_tips + np.searchsorted(self._ends, w))

    def _log_within(self, w: FloatArray) -> FloatArray:
        """Log density of w within its cell, shape of `w`: 1 for a tip, the prior for a density."""
        density = self.indenter.density
        slices = np.full(w.shape, -np.inf)
        if density is not None:
            alone = IndenterCoordinate(density, self.indenter.outer_radius_mm)
            slices = np.log(SLICES) + alone.log_density(w)
        return np.where(self.indenter.alternative(w) < self.indenter.n_tips, 0.0, slices)


def n_indenters(indenter: IndenterCoordinate) -> int:
    """Number of cells of a prior of the indenter."""
    return indenter.n_tips + (SLICES if indenter.density is not None else 0)


def indenters(indenter: IndenterCoordinate, cell: IndexArray, share: FloatArray) -> FloatArray:
    """Coordinate w at `share` of the prior probability of a cell, from 0 to 1; shape of both."""
    tips = indenter.n_tips
    w = CELLS_END - tips + cell + share
    if indenter.density is None:
        return w
    low, high = indenter.density.support
    below = np.clip((cell - tips + share) / SLICES, TINY, 1 - TINY)
    part = np.clip((indenter.density.quantile(below) - low) / (high - low), TINY, 1 - TINY)
    inside = np.log(part) - np.log1p(-part)
    return np.where(cell < tips, w, np.maximum(inside, CELLS_END) if tips else inside)


def cells_proposal(posterior: FingerPosterior) -> CellsProposal:
    """Proposal for every touch: probability of each cell, from the density at its centre."""
    indenter, ends = posterior.indenter, posterior.priors.location.support
    r, a = n_indenters(indenter), int(np.ceil((ends[1] - ends[0]) / GRID_STEP))
    w = indenters(indenter, np.arange(r), np.full(r, 0.5))
    angle = ends[0] + (ends[1] - ends[0]) * (np.arange(a) + 0.5) / a
    w, angle = (each.ravel() for each in np.meshgrid(w, angle, indexing="ij"))
    t = posterior.touches.n_touches
    parts = [_cells(posterior, w, angle, np.arange(t)[first : first + PART]) for first in range(0, t, PART)]
    log_mass, load, sd = np.concatenate(parts, axis=1)
    log_mass = log_mass.reshape(t, r, a) + _log_prior(indenter)[:, None]
    log_mass -= np.logaddexp.reduce(log_mass, axis=(1, 2), keepdims=True)
    least, most = posterior.priors.load.support
    return CellsProposal(indenter, ends, (least, most), log_mass, load.reshape(t, r, a), sd.reshape(t, r, a))


def _log_prior(indenter: IndenterCoordinate) -> FloatArray:
    """Log prior probability of each cell of the indenter, (r,)."""
    if indenter.tips is None:
        return np.full(SLICES, -np.log(SLICES))
    slices = SLICES if indenter.density is not None else 0
    with np.errstate(divide="ignore"):
        return np.asarray(np.log([*indenter.tips.weights, *[indenter.tips.share / SLICES] * slices]))


def _cells(posterior: FingerPosterior, w: FloatArray, angle: FloatArray, blocks: IndexArray) -> FloatArray:
    """Log integral of the likelihood over P at the centres of the cells (c,), mean and sd of P, (3, B, c)."""
    measured, load_sd = posterior.touches.load[blocks, None], posterior.touches.load_sd[blocks, None]
    known = np.isfinite(measured)
    least, most = posterior.priors.load.support
    typical = float(posterior.priors.load.quantile(0.5))
    move = LOAD_STEP * typical
    x = np.empty((len(blocks), len(w), 2, 3))
    x[..., 0], x[..., 1] = w[:, None], angle[:, None]
    load = np.broadcast_to(np.clip(np.where(known, measured, typical), least, most), x.shape[:2])
    for _ in range(LOAD_STEPS):
        x[..., 0, 2], x[..., 1, 2] = load, load + move
        z = posterior.residual(x.reshape(len(blocks), -1, 3), blocks).reshape(*x.shape[:3], -1)
        slope = (z[:, :, 1] - z[:, :, 0]).astype(np.float64) / move
        miss = np.where(known, (load - measured) / load_sd, 0.0)
        gradient = -np.einsum("bcm,bcm->bc", slope, z[:, :, 0]) - np.where(known, miss / load_sd, 0.0)
        # A minimum of information: a load that is not determined has ten times the width of its prior.
        curvature = np.einsum("bcm,bcm->bc", slope, slope) + np.where(known, 1 / load_sd**2, 0.0) + 0.01 / typical**2
        value = -0.5 * (np.einsum("bcm,bcm->bc", z[:, :, 0], z[:, :, 0], dtype=np.float64) + miss**2)
        here, sd = load, 1 / np.sqrt(curvature)
        mean = np.clip(load + gradient / curvature, least - OUTSIDE * sd, most + OUTSIDE * sd)
        load = np.clip(mean, least, most)
    within = ndtr((most - mean) / sd) - ndtr((least - mean) / sd)
    # The expansion is about `here`; its peak is at the mean.
    return np.stack([value + 0.5 * ((here - mean) / sd) ** 2 + np.log(sd * within), mean, WIDER * sd])
