"""What the rounds of one run share."""

from __future__ import annotations

from dataclasses import dataclass

from bayestouch.sampling.density import LogDensity
from bayestouch.sampling.draws import Demands


@dataclass(frozen=True)
class Run:
    """One run of `sample_blocks`.

    Attributes
    ----------
    log_density : callable
        See `bayestouch.sampling.density.LogDensity`.
    walkers, draws : int
        Chains of each block, and draws kept of each.
    seed : int
        Of all random numbers.
    demands : Demands
        When a block is good.
    """

    log_density: LogDensity
    walkers: int
    draws: int
    seed: int
    demands: Demands
