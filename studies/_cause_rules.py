"""How `causes` and `blind_study` count the probabilities of causes.

A set of causes is right if it names the effects that were simulated and no others. Beside effects it may name something
in place: most of the simulator's forms are not those of the catalogue. A drift counts as named by "something in time".
Without a listed effect, "nothing" is right where there is none, and "something in place", "something in time",
"something in single touches" or "something else" where the cause is in no catalogue. Effects and something else are
right if these effects were simulated, and others with them. So sets that differ only by something in place beside the
same effects are one statement: its probability is the sum of theirs. The rule that the probabilities are compared
with is the verdict with its effects, taken as a probability of 0.99; "unattributed" counts as something in place.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from _page import markdown_table
from scipy.stats import binomtest

from bayestouch.diagnosis.causes import IN_TIME, IN_TOUCHES, NOTHING
from bayestouch.diagnosis.imitations import SOMETHING_ELSE
from bayestouch.diagnosis.place_or_time import IN_PLACE

Record = Mapping[str, Any]
DRIFTS = {"baseline_drift", "gain_drift"}
# Probabilities in a log score are within these: no study of this size knows more of rare failures.
LEAST, MOST = 0.01, 0.99
EDGES = (0.0, 0.5, 0.7, 0.8, 0.9, 0.95, 0.99, 1.0)
KINDS = {"none": "nothing", "one": "one effect", "pair": "two effects", "unlisted": "an unlisted cause", "all": "all"}


def right(names: Sequence[str], record: Record) -> bool:
    """Whether a set of causes names what was simulated."""
    named, listed = set(names), set(record["truth"])
    if record["kind"] == "none":
        return named == {NOTHING}
    if record["kind"] == "unlisted":
        return bool(named) and named <= {IN_PLACE, IN_TIME, IN_TOUCHES, SOMETHING_ELSE}
    drifts = {each for each in listed - named if each in DRIFTS}
    if IN_TIME in named and len(drifts) == 1:
        named = named - {IN_TIME} | drifts
    effects = named - {IN_PLACE, SOMETHING_ELSE}
    # beside effects, "something else" says that there is more
    return bool(effects) and effects < listed if SOMETHING_ELSE in named else effects == listed


def statements(causes: Sequence[Mapping[str, Any]]) -> list[tuple[tuple[str, ...], float]]:
    """Names and probability of each statement, most probable first: sums over sets that are right together."""
    total: dict[tuple[str, ...], float] = {}
    for each in causes:
        names = tuple(sorted(each["names"]))
        effects = tuple(name for name in names if name != IN_PLACE) or names
        total[effects] = total.get(effects, 0.0) + each["probability"]
    return sorted(total.items(), key=lambda each: -each[1])


def stated(effects: Sequence[str], verdict: str) -> list[str]:
    """Causes by the verdict and its effects."""
    return list(effects) or [NOTHING if verdict == "adequate" else IN_PLACE]


@dataclass(frozen=True, eq=False)
class Forecasts:
    """What is said of n fingers, and whether it is right.

    Attributes
    ----------
    sure : (n,) array
        Probability of the most probable statement.
    hit : (n,) bool array
        Whether that statement is right.
    total : (n,) array
        Probability of all right sets together.
    rule_hit : (n,) bool array
        Whether the verdict with its effects is right.
    """

    sure: np.ndarray
    hit: np.ndarray
    total: np.ndarray
    rule_hit: np.ndarray

    @classmethod
    def of(cls, results: Sequence[Record]) -> Forecasts:
        """Of results with their `causes`, and with what is `stated`."""
        first = [statements(each["causes"])[0] for each in results]
        return cls(
            np.array([probability for _, probability in first], dtype=float),
            np.array([right(names, each) for (names, _), each in zip(first, results, strict=True)], dtype=bool),
            np.array([sum(c["probability"] for c in each["causes"] if right(c["names"], each)) for each in results]),
            np.array([right(each["stated"], each) for each in results], dtype=bool),
        )

    @property
    def log_score(self) -> float:
        """Mean log probability of all right sets."""
        return float(np.log(np.clip(self.total, LEAST, MOST)).mean())

    @property
    def rule_log_score(self) -> float:
        """The same, if the verdict is taken as `MOST` certain."""
        return float(np.log(np.where(self.rule_hit, MOST, 1 - MOST)).mean())

    @property
    def calibration_error(self) -> float:
        """Mean over fingers of the difference between probability and share right, in bins."""
        inside = np.digitize(self.sure, EDGES[1:-1], right=True)
        sums = [abs((self.hit - self.sure)[inside == k].sum()) for k in np.unique(inside)]
        return float(sum(sums) / len(self.sure))


@dataclass(frozen=True)
class Bin:
    """Fingers whose first statement has a probability between two edges: how often it is right.

    Attributes
    ----------
    above, up_to : float
        Edges; the upper one belongs to the bin.
    fingers, right : int
        Their number, and of how many the statement is right.
    probability : float
        Mean probability of the statement.
    """

    above: float
    up_to: float
    fingers: int
    right: int
    probability: float

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of the share that is right (Clopper and Pearson)."""
        low, high = binomtest(self.right, self.fingers).proportion_ci(method="exact")
        return float(low), float(high)


def bins(forecasts: Forecasts) -> list[Bin]:
    """All bins that hold a finger."""
    out = []
    for low, high in pairwise(EDGES):
        inside = (forecasts.sure > low) & (forecasts.sure <= high)
        if inside.any():
            hits, mean = int(forecasts.hit[inside].sum()), float(forecasts.sure[inside].mean())
            out.append(Bin(low, high, int(inside.sum()), hits, mean))
    return out


def tables(results: Sequence[Record]) -> str:
    """Reliability of the first statement, and both log scores, by kind of finger."""
    rows = []
    for each in bins(Forecasts.of(results)):
        low, high = each.interval
        share = f"{100 * each.right / each.fingers:.0f}"
        ends = f"{100 * low:.0f} to {100 * high:.0f}"
        name = f"{each.above:g} to {each.up_to:g}"
        rows.append([name, str(each.fingers), f"{100 * each.probability:.0f}", share, ends])
    head = ("probability of the first statement", "fingers", "mean probability, %", "right, %", "95 % interval")
    first = markdown_table(head, rows)
    by_kind = []
    for kind in KINDS:
        some = [each for each in results if kind in (each["kind"], "all")]
        if some:
            of = Forecasts.of(some)
            shares = (f"{100 * part.mean():.0f}" for part in (of.sure, of.hit, of.rule_hit))
            by_kind.append([KINDS[kind], str(len(some)), *shares, f"{of.log_score:.2f}", f"{of.rule_log_score:.2f}"])
    other = ("simulated", "fingers", "mean probability of the first statement, %", "right, %", "verdict right, %")
    second = markdown_table((*other, "log score", "log score of the verdict"), by_kind)
    return f"{first}\nExpected calibration error {Forecasts.of(results).calibration_error:.3f}.\n\n{second}"
