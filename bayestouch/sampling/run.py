"""Settings that all rounds of one run use."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from bayestouch.sampling.density import LogDensity
from bayestouch.sampling.draws import Demands


@dataclass(frozen=True)
class Run:
    """Settings of one run of `sample_blocks`.

    Attributes
    ----------
    log_density : callable
        See `bayestouch.sampling.density.LogDensity`.
    walkers, draws : int
        Number of chains of each block, and of draws kept from each chain.
    seed : int
        Seed of all random numbers.
    demands : Demands
        Targets for a good block.
    moves : object
        Moves of emcee that are used in place of the three rounds; None for the rounds.
    """

    log_density: LogDensity
    walkers: int
    draws: int
    seed: int
    demands: Demands
    moves: Any = None
