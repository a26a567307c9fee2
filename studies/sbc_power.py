"""What the checks of posteriors notice: the chance that each fails if all posteriors are a little too narrow.

The posteriors are normal, and their standard deviation is too small by a share of itself. Then the probability of each
rank of the truth among the draws is an integral over one normal variable; ranks are drawn with these probabilities and
given to the check itself.

    python studies/sbc_power.py [--small] [--docs]       --docs writes the table of docs/statistics.md
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from _page import STATISTICS, markdown_table, put_into_page
from scipy.stats import binom, norm

from bayestouch.results.probability_plot import UniformBand
from bayestouch.simulation_based_calibration.ranks import (
    RANKED,
    VARIANCE_OF_SQUARE,
    normal_scores,
    of_ranks,
    spread_p_value,
)

NARROW = (0.0, 0.05, 0.1, 0.2)
# a chance of one half is then good to 2.5 %
TRIALS = 400
# Independent quantities that the pooled scores of one simulation are worth: `RankStatistics.pooled.scores` over the
# number of simulations, as sbc_touches.py and sbc_calibration.py print it. The tests compare it.
TOUCH, CALIBRATION, SMALL_CALIBRATION = 2.4, 12.1, 9.3
NODES = 4001


@dataclass(frozen=True)
class Check:
    """A check of posteriors, and how it is used.

    Attributes
    ----------
    name : str
        What it is.
    where : str
        Test or study that uses it.
    simulations : int
        Simulations, or touches.
    notices : callable
        Whether it fails, given the share by which posteriors are too narrow and a random generator.
    """

    name: str
    where: str
    simulations: int
    notices: Callable[[float, np.random.Generator], bool]


@lru_cache(maxsize=16)
def rank_probabilities(narrow: float) -> np.ndarray:
    """Probability (`RANKED` + 1,) of each rank of the truth where the posterior's sd is too small by this share."""
    # the truth in units of the right sd, in equal steps far into the tails
    z = np.linspace(-8, 8, NODES)
    weight = norm.pdf(z)
    chance = binom.pmf(np.arange(RANKED + 1)[:, None], RANKED, norm.cdf(z / (1 - narrow)))
    out = chance @ weight
    return np.asarray(out / out.sum())


def mean_square(narrow: float) -> float:
    """Expected mean square of the normal scores: ``1/(1 - narrow)²``, less what the number of draws cuts off."""
    return float(rank_probabilities(narrow) @ normal_scores(np.arange(RANKED + 1)) ** 2)


def covered(narrow: float, probability: float = 0.9) -> float:
    """Share of the truths that a central interval of this probability holds."""
    return float(1 - 2 * norm.cdf(norm.ppf((1 - probability) / 2) * (1 - narrow)))


def power(check: Check, narrow: float, trials: int = TRIALS, seed: int = 0) -> float:
    """Chance that the check fails where posteriors are too narrow by this share."""
    rng = np.random.default_rng([seed, round(1000 * narrow)])
    return float(np.mean([check.notices(narrow, rng) for _ in range(trials)]))


def pooled(where: str, simulations: int, quantities: float, level: float = 0.01) -> Check:
    """The pooled mean square of normal scores, at half the level of the whole."""
    scores = round(simulations * quantities)

    def notices(narrow: float, rng: np.random.Generator) -> bool:
        counts = rng.multinomial(scores, rank_probabilities(narrow))
        square = float(counts @ normal_scores(np.arange(RANKED + 1)) ** 2) / scores
        return spread_p_value(square, scores) < level / 2

    return Check(f"pooled mean square of scores, {100 * level / 2:g} %", where, simulations, notices)


def by_quantity(where: str, simulations: int, quantities: float, listed: int, level: float = 0.01) -> Check:
    """The p-value of each of the `listed` quantities, as if so many `quantities` of them were independent."""

    def notices(narrow: float, rng: np.random.Generator) -> bool:
        chance = rank_probabilities(narrow)
        for _ in range(round(quantities)):
            ranks = rng.choice(RANKED + 1, simulations, p=chance)
            if of_ranks({"x": ranks}, {"x": 0.9}).p_value["x"] < level / 2 / listed:
                return True
        return False

    return Check(f"p-value of each of {listed} quantities, {100 * level / 2:g} % in all", where, simulations, notices)


def coverage(where: str, simulations: int, quantities: float, errors: float = 4.0) -> Check:
    """Share of 90 % intervals that hold the truth, within so many binomial standard errors."""

    def notices(narrow: float, rng: np.random.Generator) -> bool:
        share = rng.binomial(simulations, covered(narrow), round(quantities)) / simulations
        return bool((np.abs(share - 0.9) > errors * np.sqrt(0.09 / simulations)).any())

    return Check(f"coverage of 90 % intervals, {errors:g} standard errors", where, simulations, notices)


def band(where: str, simulations: int, level: float = 0.01) -> Check:
    """P-P plot of one quantity: the whole curve inside its band."""
    inside = UniformBand.of(simulations)

    def notices(narrow: float, rng: np.random.Generator) -> bool:
        return inside.p_value(norm.cdf(rng.standard_normal(simulations) / (1 - narrow))) < level

    return Check(f"P-P plot of one quantity, {100 * level:g} %", where, simulations, notices)


def checks() -> list[Check]:
    """All checks, with the numbers of simulations that tests and studies use."""
    touches, study = (
        "`tests/simulation_based_calibration/test_touches.py`, touches",
        "`studies/sbc_touches.py`, each row",
    )
    small, calibrations = "`tests/studies/test_studies_of_statistics.py`, two elements", "`studies/sbc_calibration.py`"
    return [
        pooled(touches, 500, TOUCH),
        by_quantity(touches, 500, TOUCH, 4),
        coverage(touches, 500, TOUCH),
        pooled(small, 100, SMALL_CALIBRATION),
        by_quantity(small, 100, SMALL_CALIBRATION, 18),
        band("`tests/results/test_probability_plot.py`", 500),
        pooled(study, 2000, TOUCH),
        by_quantity(study, 2000, TOUCH, 4),
        pooled(calibrations, 340, CALIBRATION),
        by_quantity(calibrations, 340, CALIBRATION, 30),
        band("`bayestouch.pp_plot` of 2,000 touches", 2000),
    ]


def as_markdown(found: dict[Check, list[float]]) -> str:
    """Table of docs/statistics.md."""
    head = ["check and its level", "where", "simulations", "right posteriors"]
    head += [f"{100 * narrow:g} % too narrow" for narrow in NARROW[1:]]
    rows = [
        [check.name, check.where, f"{check.simulations:,}", *(f"{100 * chance:.0f} %" for chance in chances)]
        for check, chances in found.items()
    ]
    return markdown_table(head, rows)


def main(trials: int = TRIALS) -> dict[Check, list[float]]:
    """Print the chance of failing for each check and each share of `NARROW`; returns them."""
    print(f"a square of a score has the variance {VARIANCE_OF_SQUARE:.3f}; expected mean squares:")
    print(", ".join(f"{100 * narrow:g} % too narrow: {mean_square(narrow):.3f}" for narrow in NARROW))
    found = {}
    for check in checks():
        found[check] = [power(check, narrow, trials) for narrow in NARROW]
        chances = "".join(f"{100 * chance:7.1f}" for chance in found[check])
        print(f"{check.name:58s}{check.where:42s}{check.simulations:6d}{chances}")
    return found


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--small", action="store_true", help="a coarser table")
    parser.add_argument("--docs", action="store_true", help="write the table of docs/statistics.md")
    chosen = parser.parse_args()
    table = main(100 if chosen.small else TRIALS)
    if chosen.docs:
        put_into_page("sbc_power.py", as_markdown(table), STATISTICS)
