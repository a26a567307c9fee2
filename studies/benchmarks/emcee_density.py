"""What it costs that emcee evaluates the log density: processor time of the chains of many touches, four ways.

The move can call the density itself; it can ask emcee's model for the proposals of all steps in one call, as the
package does; it can ask for one step at a time; and emcee's own sampler can stand in place of `ArraySampler`. The
chains are the same to the bit. All run in turn in one process, so many times; the shortest of each counts.
`studies/benchmarks/versions.py` compares whole verbs.

    python studies/benchmarks/emcee_density.py [touches]
"""

from __future__ import annotations

import os
import sys
import time
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")

import emcee
import many_touches
import numpy as np

from bayestouch.sampling.density import by_walker, of_blocks
from bayestouch.sampling.moves import IndependenceMove
from bayestouch.sampling.sampler import ArraySampler
from bayestouch.sampling.streams import BlockStreams

WALKERS, STEPS, REPEATS = 4, 272, 5


class AsksNobody(IndependenceMove):
    """Calls the density itself."""

    def _evaluate(self, model: Any, points: np.ndarray) -> np.ndarray:
        return model.log_prob_fn(points.reshape(len(points), -1).T)


class AsksForEveryStep(IndependenceMove):
    """Asks emcee for one step of all walkers at a time."""

    def _evaluate(self, model: Any, points: np.ndarray) -> np.ndarray:
        d, walkers, steps, blocks = points.shape
        out = np.empty((walkers, steps, blocks))
        for s in range(steps):
            log_p, _ = model.compute_log_prob_fn(points[:, :, s].reshape(d, -1).T)
            out[:, s] = log_p.reshape(walkers, blocks)
        return out


def main(touches: int) -> None:
    """Print seconds and ratios."""
    sampler, every = many_touches.design(touches)
    groups = [
        group
        for rows in sampler.pieces(np.arange(touches), again=False)
        for group in sampler.groups(every.select(np.arange(touches)), rows)
    ]
    ways = {
        "the move calls the density": (AsksNobody, ArraySampler),
        "emcee evaluates all steps in one call": (IndependenceMove, ArraySampler),
        "emcee evaluates each step": (AsksForEveryStep, ArraySampler),
        "all steps, emcee's own loop over values": (IndependenceMove, emcee.EnsembleSampler),
    }
    seconds = {name: np.inf for name in ways}
    last: dict[str, np.ndarray] = {}
    for _ in range(REPEATS):
        for name, way in ways.items():
            began = time.process_time()
            last[name] = np.concatenate([chains(group, *way) for group in groups], axis=1)
            seconds[name] = min(seconds[name], time.process_time() - began)
    first, *others = last.values()
    assert all(np.array_equal(first, other) for other in others)
    least = min(seconds.values())
    print(f"{touches} touches, {WALKERS} chains of {STEPS} steps, one core; the same draws")
    for name, value in seconds.items():
        print(f"{name:40s} {value:6.2f} s of processor, {value / least:.2f} times")


def chains(group: Any, way: type[IndependenceMove], kind: type[emcee.EnsembleSampler]) -> np.ndarray:
    """Last points of the chains of a group of touches, (walkers, touches, 3)."""
    numbers = np.arange(len(group.rows))
    move = way(group.proposal, BlockStreams(1, numbers), STEPS)
    density = by_walker(of_blocks(group.log_density, numbers), len(numbers))
    n = WALKERS * len(numbers)
    sampler = kind(n, 3, density, moves=move, vectorize=True)
    state = emcee.State(np.zeros((3, n)).T, log_prob=np.full(n, -np.inf))
    state = sampler.run_mcmc(state, STEPS, store=False, skip_initial_state_check=True)
    return state.coords.reshape(WALKERS, len(numbers), 3)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 4800)
