"""The paper's tables explained by all unknowns: posterior, fingers under it, and what it says of each number."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

from bayestouch.paper import published
from bayestouch.reliability import Beside
from nicolson_fearing.explained_fingers import PREDICTED, ExplainedFingers
from nicolson_fearing.explained_fit import DRAWS, STEPS, Explanation, Inferred
from nicolson_fearing.unknowns import OF_PLACES, PRIOR, Unknowns

LENGTH_MM = published.number("tips.length").value
FREE = tuple(name for name in PRIOR if name not in OF_PLACES)


@dataclass(frozen=True, eq=False)
class Case:
    """An explanation, its posterior, and fingers under it."""

    inferred: Inferred
    fingers: ExplainedFingers

    @classmethod
    def of(cls, explanation: Explanation, small: bool, near: Case | None = None) -> Case:
        """Infer, beginning at another posterior perhaps, and simulate."""
        begin = near.inferred if near else None
        inferred = explanation.inferred(near=begin, draws=200 if small else DRAWS, steps=200 if small else STEPS)
        return cls(inferred, ExplainedFingers.of(inferred, 60 if small else PREDICTED))


@lru_cache(maxsize=2)
def full(small: bool = False) -> Case:
    """All effects, inferred from all tables."""
    return Case.of(Explanation("all effects", FREE, Unknowns(length_mm=LENGTH_MM)), small)


def after(small: bool = False) -> dict[str, Beside]:
    """Numbers of the paper under all effects, by key."""
    fingers = full(small).fingers
    return {row.key: row for row in (*fingers.rows(), *fingers.thresholds, *fingers.text())}


def posterior_mean(small: bool = False) -> Unknowns:
    """Posterior means of the unknowns, under all effects."""
    inferred = full(small).inferred
    return inferred.explanation.unknowns(inferred.shares.mean(axis=0))
