"""Draws from many posteriors, and the targets of their quality."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray, IndexArray
from bayestouch.sampling.diagnostics import bulk_statistics


@dataclass(frozen=True)
class Demands:
    """Targets that a block must meet to be graded good.

    Attributes
    ----------
    ess_bulk : float
        Minimum bulk effective sample size of each parameter.
    rhat : float
        Maximum R-hat. It scatters: with four chains of 256 draws, 1.01 would reject many good blocks by chance.
    acceptance : float
        Minimum fraction of accepted proposals of an independence move; below it the tails are poorly sampled.
    pareto_k : float
        Maximum Pareto shape of the ratios of posterior to proposal (Vehtari et al. 2024). Above 0.5 their variance
        is infinite: a chain may stay at one point for many steps, or may never have reached such a point.
    """

    ess_bulk: float = 400.0
    rhat: float = 1.02
    acceptance: float = 0.15
    pareto_k: float = 0.5

    def met(self, ess_bulk: float, rhat: float) -> bool:
        """True if draws with this effective sample size and R-hat, of the worst parameter, meet the targets."""
        return bool(ess_bulk >= self.ess_bulk and rhat <= self.rhat)


@dataclass(frozen=True, eq=False)
class BlockDraws:
    """Draws from B posteriors of dimension d, and their quality.

    Attributes
    ----------
    draws : (W, n, B, d) array
        Chain, draw, block, parameter. The chains of a block are independent. NaN where a chain found no point of
        finite density.
    log_density : (W, n, B) array
        Log density at each draw.
    acceptance : (B,) array
        Fraction of accepted proposals.
    ess_bulk, rhat : (B, d) arrays
        Bulk effective sample size and R-hat of each parameter over the chains, as in ArviZ; NaN for a
        constant parameter.
    pareto_k : (B,) array
        Pareto shape of the ratios of posterior to proposal; NaN in rounds 3 to 5, whose moves do not use these ratios.
    rounds : (B,) int array
        Round of the draws: 1 with the given proposal, 2 with one fitted to the posterior, 3 with ensembles; 4 with
        moves of the caller, 5 with moves that renew a part of the coordinates.
    grade : (B,) bool array
        Whether the targets are met.
    """

    draws: FloatArray
    log_density: FloatArray
    acceptance: FloatArray
    ess_bulk: FloatArray
    rhat: FloatArray
    pareto_k: FloatArray
    rounds: IndexArray
    grade: BoolArray

    @property
    def worst_ess(self) -> FloatArray:
        """Smallest bulk effective sample size among a block's parameters, (B,); 0 if one is constant."""
        return np.asarray(np.nan_to_num(self.ess_bulk).min(axis=1))

    @property
    def worst_rhat(self) -> FloatArray:
        """Largest R-hat among a block's parameters, (B,); inf if one is constant, or each of its chains is."""
        return np.asarray(np.where(np.isnan(self.rhat), np.inf, self.rhat).max(axis=1))


def empty_draws(chains: int, n: int, blocks: int, dimension: int, round_: int) -> BlockDraws:
    """Return empty arrays for the draws of one round."""
    return BlockDraws(
        # The draws of one parameter are contiguous in memory, as files and diagnostics need them.
        draws=np.moveaxis(np.empty((dimension, chains, n, blocks)), 0, -1),
        log_density=np.empty((chains, n, blocks)),
        acceptance=np.zeros(blocks),
        ess_bulk=np.empty((blocks, dimension)),
        rhat=np.empty((blocks, dimension)),
        pareto_k=np.full(blocks, np.nan),
        rounds=np.full(blocks, round_),
        grade=np.zeros(blocks, dtype=bool),
    )


def grade(result: BlockDraws, part: slice, demands: Demands) -> None:
    """Compute the statistics and the grade of the blocks `part` from their draws."""
    draws = result.draws[:, :, part]
    draws[np.isneginf(result.log_density[:, :, part])] = np.nan
    for j in range(draws.shape[-1]):
        result.ess_bulk[part, j], result.rhat[part, j] = bulk_statistics(draws[..., j])
    # A comparison with NaN is false, so that a block without computable statistics is not good.
    good = (result.ess_bulk[part] >= demands.ess_bulk).all(axis=1) & (result.rhat[part] <= demands.rhat).all(axis=1)
    proposed = ~np.isnan(result.pareto_k[part])
    served = (result.acceptance[part] >= demands.acceptance) & (result.pareto_k[part] <= demands.pareto_k)
    result.grade[part] = good & (served | ~proposed)


def thinned(result: BlockDraws, draws: int) -> BlockDraws:
    """Draws of which `draws` in all (each chain the same number, rounded up) are kept, evenly spaced, of one posterior.

    Their effective sample size and R-hat are computed anew; the rest describes the chains that were run.
    """
    chains, n = result.draws.shape[:2]
    each = -(-draws // chains)
    if each >= n:
        return result
    kept = slice(None, each * (n // each), n // each)
    points = result.draws[:, kept]
    ess, rhat = bulk_statistics(points)
    return replace(result, draws=points, log_density=result.log_density[:, kept], ess_bulk=ess, rhat=rhat)


def put(result: BlockDraws, part: BlockDraws, blocks: IndexArray) -> None:
    """Copy the draws of some blocks into `result`."""
    _copy(result, part, blocks, np.ones(len(blocks), dtype=bool))


def keep_better(result: BlockDraws, again: BlockDraws, blocks: IndexArray) -> None:
    """Copy the draws of a further round into `result` for the blocks where they are better."""
    _copy(result, again, blocks, again.grade | (again.worst_ess > result.worst_ess[blocks]))


def _copy(result: BlockDraws, source: BlockDraws, blocks: IndexArray, which: BoolArray) -> None:
    for one in fields(BlockDraws):
        old, new = getattr(result, one.name), getattr(source, one.name)
        if one.name in ("draws", "log_density"):
            old[:, :, blocks[which]] = new[:, :, which]
        else:
            old[blocks[which]] = new[which]
