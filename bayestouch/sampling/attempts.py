"""Chains of one posterior that are made longer, attempt by attempt, until they are good."""

from __future__ import annotations

from collections.abc import Callable

from bayestouch.array_types import FloatArray
from bayestouch.sampling.draws import Demands

#: Chains of a calibration.
CHAINS = 4


def long_enough(ess: FloatArray, rhat: FloatArray, draws: int) -> bool:
    """Return whether chains are long enough for `draws` draws in all.

    R-hat of so few draws scatters, and must not ask for more for that.
    """
    demands = Demands()
    enough = bool(ess.min() >= min(demands.ess_bulk, 0.4 * draws))
    return enough and bool(rhat.max() <= max(demands.rhat, 1 + 8 * CHAINS / draws))


def part_of(progress: Callable[[float], None] | None, attempt: int) -> Callable[[float], None] | None:
    """Return the progress of one attempt: the first fills one half, the next a half of what is left."""
    if progress is None:
        return None
    left = 0.5**attempt
    return lambda done: progress(1 - left + 0.5 * left * done)
