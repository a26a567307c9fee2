"""Simulations of a design one after the other or side by side, and the ranks of their truths."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.output.progress import Progress
from bayestouch.parallel.cluster import in_order
from bayestouch.simulation_based_calibration.ranks import RankStatistics, of_ranks, rank

Ranked = dict[str, tuple[int, bool]]


class Ranking(Protocol):
    """Protocol of a design whose simulations are ranked."""

    def ranked(self, number: int) -> Ranked:
        """Ranks of the simulation with this number."""
        ...


def check_calibration(
    design: Ranking, simulations: int, progress: Progress | None, scheduler: str | None = None
) -> RankStatistics:
    """Return the ranks of all parameters and, where the design has them, of true loads and of the log density.

    The log density of the posterior is a function of parameters and data: its rank reveals errors that marginal ranks
    may not show (Modrák et al. 2023, doi:10.1214/23-BA1404).
    """

    def report(finished: int) -> None:
        if progress is not None:
            progress(finished / simulations)

    pieces = in_order(scheduler, _ranked, design, range(simulations), report)
    # A quantity that is held in some simulations has no rank there, see `ranks_of`.
    names = [name for name in pieces[0] if all(name in piece for piece in pieces)]
    ranks = {name: np.array([piece[name][0] for piece in pieces]) for name in names}
    return of_ranks(ranks, {name: float(np.mean([piece[name][1] for piece in pieces])) for name in names})


def _ranked(design: Ranking, number: int) -> Ranked:
    return design.ranked(number)


def ranks_of(drawn: Mapping[str, FloatArray], truth: Mapping[str, FloatArray]) -> Ranked:
    """Return the rank of each truth (1,) among its draws (n,), and if the 90 % interval contains it.

    What is held, such as the kind of a drift, has no rank.
    """
    out = {}
    for name, values in drawn.items():
        if np.ptp(values) > 0:
            low, high = np.quantile(values, [0.05, 0.95])
            out[name] = int(rank(values[:, None], truth[name])[0]), bool(low <= truth[name][0] <= high)
    return out


def by_element(values: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """Return the parameters with those by element (n, m) split into m arrays (n,), named such as ``"r_s e03"``."""
    out = {}
    for name, each in values.items():
        if each.ndim == 1:
            out[name] = each
        else:
            out |= {f"{name} e{element + 1:02d}": column for element, column in enumerate(each.T)}
    return out
