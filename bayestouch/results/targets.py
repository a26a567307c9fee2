"""Whether the draws of a calibration reach the targets of the sampler, in words."""

from __future__ import annotations

import math
from collections.abc import Mapping

from bayestouch.array_types import FloatArray
from bayestouch.output.text import fixed, number
from bayestouch.results.draws_on_file import DrawsOnFile
from bayestouch.sampling.attempts import demands_of


def kept_draws(posterior: Mapping[str, FloatArray]) -> tuple[int, int] | None:
    """Number of chains and of draws in each; None if only summaries are kept."""
    shapes = posterior.shapes if isinstance(posterior, DrawsOnFile) else {k: v.shape for k, v in posterior.items()}
    for chains, draws, *_ in shapes.values():
        return int(chains), int(draws)
    return None


def targets_met(statistics: Mapping[str, float], kept: tuple[int, int] | None) -> bool:
    """Whether draws of a calibration, of which `kept_draws` are `kept`, meet the targets of the sampler."""
    demands = demands_of(None if kept is None else math.prod(kept))
    return demands.met(statistics["ess_bulk"], statistics["rhat"])


def targets_missed(statistics: Mapping[str, float], draws: int | None = None) -> tuple[str, ...]:
    """Sentence on draws that miss the targets of the sampler; empty if they meet them, or have no such statistics.

    Parameters
    ----------
    statistics : mapping of str to float
        ``ess_bulk`` and ``rhat`` of the worst parameter, among others.
    draws : int, optional
        Number of draws in all, on which the targets depend; by default they are those of many draws.
    """
    size, rhat = statistics.get("ess_bulk"), statistics.get("rhat")
    if size is None or rhat is None or demands_of(draws).met(size, rhat):
        return ()
    return (
        "The sampler did not reach its targets for the calibration (effective sample size "
        f"{number(size, 2)}, R-hat {fixed(rhat, 3)}), so its posterior is rough.",
    )
