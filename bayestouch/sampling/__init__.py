"""Sampling from many posteriors at once; independent of tactile sensors."""

from bayestouch.sampling.diagnostics import bulk_statistics, ess_bulk, rhat
from bayestouch.sampling.draws import BlockDraws, Demands
from bayestouch.sampling.importance import ImportanceDraws, importance_blocks
from bayestouch.sampling.lockstep import sample_blocks
from bayestouch.sampling.pareto import pareto_shape, pareto_smooth
from bayestouch.sampling.proposals import BlockProposal, Mixture, StudentTProposal
from bayestouch.sampling.streams import BlockStreams

__all__ = [
    "BlockDraws",
    "BlockProposal",
    "BlockStreams",
    "Demands",
    "ImportanceDraws",
    "Mixture",
    "StudentTProposal",
    "bulk_statistics",
    "ess_bulk",
    "importance_blocks",
    "pareto_shape",
    "pareto_smooth",
    "rhat",
    "sample_blocks",
]
