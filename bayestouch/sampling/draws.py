"""Draws from many posteriors, and when they are good."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray, IndexArray
from bayestouch.sampling.diagnostics import bulk_statistics


@dataclass(frozen=True)
class Demands:
    """What a block must reach to be graded good.

    Attributes
    ----------
    ess_bulk : float
        Least bulk effective sample size of each parameter.
    rhat : float
        Largest R-hat. It scatters: with four chains of 256 draws, 1.01 would fail many a good block by chance.
    acceptance : float
        Least share of proposals accepted by an independence move; below it the draws say little of the tails.
    pareto_k : float
        Largest Pareto shape of the ratios of posterior to proposal (Vehtari et al. 2024). Above 0.5 their variance
        is infinite: a chain may sit on one point for long, or have missed what would hold it.
    """

    ess_bulk: float = 400.0
    rhat: float = 1.02
    acceptance: float = 0.15
    pareto_k: float = 0.5


@dataclass(frozen=True, eq=False)
class BlockDraws:
    """Draws from B posteriors of dimension d, and how good they are.

    Attributes
    ----------
    draws : (W, n, B, d) array
        Chain, draw, block, parameter. The chains of a block are independent. NaN where a chain found no point of
        finite density.
    log_density : (W, n, B) array
        Log density at each.
    acceptance : (B,) array
        Share of proposals accepted.
    ess_bulk, rhat : (B, d) arrays
        Bulk effective sample size and R-hat of each parameter over the chains, as ArviZ gives them; NaN for a
        parameter that never moved.
    pareto_k : (B,) array
        Pareto shape of the ratios of posterior to proposal; NaN in round 3, which has no proposal.
    rounds : (B,) int array
        Which round the draws come from: 1 the given proposal, 2 one fitted to the first draws, 3 ensembles.
    grade : (B,) bool array
        Whether the demands are met.
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
    def second_round(self) -> BoolArray:
        """Blocks that the given proposal did not serve, (B,)."""
        return self.rounds > 1

    @property
    def worst_ess(self) -> FloatArray:
        """Least bulk effective sample size of a block's parameters, (B,); 0 where one never moved."""
        return np.asarray(np.nan_to_num(self.ess_bulk).min(axis=1))

    @property
    def worst_rhat(self) -> FloatArray:
        """Largest R-hat of a block's parameters, (B,); inf where one never moved."""
        return np.asarray(np.nan_to_num(self.rhat, nan=np.inf).max(axis=1))


def empty_draws(chains: int, n: int, blocks: int, dimension: int, round_: int) -> BlockDraws:
    """Room for the draws of one round, filled in later."""
    return BlockDraws(
        # The draws of one parameter lie together in memory, as files and diagnostics want them.
        draws=np.moveaxis(np.empty((dimension, chains, n, blocks)), 0, -1),
        log_density=np.empty((chains, n, blocks)),
        acceptance=np.empty(blocks),
        ess_bulk=np.empty((blocks, dimension)),
        rhat=np.empty((blocks, dimension)),
        pareto_k=np.full(blocks, np.nan),
        rounds=np.full(blocks, round_),
        grade=np.zeros(blocks, dtype=bool),
    )


def grade(result: BlockDraws, part: slice, demands: Demands) -> None:
    """Fill in the statistics and the grade of some blocks, whose draws are there."""
    draws = result.draws[:, :, part]
    draws[np.isneginf(result.log_density[:, :, part])] = np.nan
    for j in range(draws.shape[-1]):
        result.ess_bulk[part, j], result.rhat[part, j] = bulk_statistics(draws[..., j])
    # A comparison with NaN is false, so whatever could not be computed is not good.
    good = (result.ess_bulk[part] >= demands.ess_bulk).all(axis=1) & (result.rhat[part] <= demands.rhat).all(axis=1)
    proposed = ~np.isnan(result.pareto_k[part])
    served = (result.acceptance[part] >= demands.acceptance) & (result.pareto_k[part] <= demands.pareto_k)
    result.grade[part] = good & (served | ~proposed)


def put(result: BlockDraws, part: BlockDraws, blocks: IndexArray) -> None:
    """Put the draws of some blocks in place."""
    _copy(result, part, blocks, np.ones(len(blocks), dtype=bool))


def keep_better(result: BlockDraws, again: BlockDraws, blocks: IndexArray) -> None:
    """Put the draws of a further round of some blocks in place, where they are the better ones."""
    _copy(result, again, blocks, again.grade | (again.worst_ess > result.worst_ess[blocks]))


def _copy(result: BlockDraws, source: BlockDraws, blocks: IndexArray, which: BoolArray) -> None:
    for one in fields(BlockDraws):
        old, new = getattr(result, one.name), getattr(source, one.name)
        if one.name in ("draws", "log_density"):
            old[:, :, blocks[which]] = new[:, :, which]
        else:
            old[blocks[which]] = new[which]
