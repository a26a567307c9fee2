"""The score of a trial and its survivors, as text and as a section of ``docs/verified.md``."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from scipy.stats import binomtest

JUDGED = Path(__file__).parent / "mutants" / "judged.toml"


@dataclass(frozen=True)
class Judgement:
    """What was found on looking at a survivor."""

    equivalent: bool
    reason: str


@dataclass(frozen=True)
class Tried:
    """A change and what became of it: ``killed``, ``timeout``, ``survived``, or ``broken``: not made."""

    part: str
    module: str
    line: int
    before: str
    after: str
    outcome: str


def judgements() -> dict[tuple[str, str, str], Judgement]:
    """Judgements by module, line before and line after."""
    read = tomllib.loads(JUDGED.read_text("utf-8")).get("survivor", ())
    return {(s["module"], s["before"], s["after"]): Judgement(s["equivalent"], s["reason"]) for s in read}


@dataclass(frozen=True)
class Score:
    """Counts of a trial or of a part of it."""

    made: int
    killed: int
    timeouts: int
    equivalent: int

    @property
    def survived(self) -> int:
        return self.made - self.killed - self.timeouts - self.equivalent

    @property
    def share(self) -> float:
        """Noticed changes, as a share of those that change anything."""
        return (self.killed + self.timeouts) / max(self.made - self.equivalent, 1)

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson's interval of 95 % for the share among all places of the core."""
        noticed = self.killed + self.timeouts
        found = binomtest(noticed, max(self.made - self.equivalent, 1)).proportion_ci(method="wilson")
        return found.low, found.high

    @classmethod
    def of(cls, tried: Sequence[Tried], judged: dict[tuple[str, str, str], Judgement]) -> Score:
        made = [each for each in tried if each.outcome != "broken"]
        equal = [each for each in made if each.outcome == "survived" and _equivalent(each, judged)]
        counts = (sum(each.outcome == outcome for each in made) for outcome in ("killed", "timeout"))
        return cls(len(made), *counts, len(equal))


def _equivalent(each: Tried, judged: dict[tuple[str, str, str], Judgement]) -> bool:
    found = judged.get((each.module, each.before, each.after))
    return found is not None and found.equivalent


def summary(tried: Sequence[Tried]) -> str:
    """The score in one line."""
    score = Score.of(tried, judgements())
    low, high = score.interval
    return (
        f"mutation score {score.share:.1%} (95 % interval {low:.1%} to {high:.1%}): of {score.made} changes "
        f"{score.killed + score.timeouts} were noticed ({score.timeouts} of these by time), {score.equivalent} change "
        f"nothing, {score.survived} survived"
    )


def _code(text: str) -> str:
    fence = "``" if "`" in text else "`"
    return f"{fence}{text.replace('|', chr(92) + '|')}{fence}"


def section(tried: Sequence[Tried], seed: int, places: int) -> str:
    """The trial as a section: how it was made, the score by part, and every survivor."""
    judged = judgements()
    lines = [
        f"{len(tried)} places (seed {seed}) of the {places:,} in the core that the program cosmic-ray can change, "
        "one change at each.",
        f"{summary(tried).capitalize()}.",
        "",
        "| part | changes | noticed | of these by time | change nothing | survived |",
        "|---|---|---|---|---|---|",
    ]
    for part in dict.fromkeys(each.part for each in tried):
        s = Score.of([each for each in tried if each.part == part], judged)
        lines.append(f"| {part} | {s.made} | {s.killed + s.timeouts} | {s.timeouts} | {s.equivalent} | {s.survived} |")
    for equivalent, title in ((False, "Survived"), (True, "Change nothing")):
        survived = (each for each in tried if each.outcome == "survived")
        kept = [each for each in survived if _equivalent(each, judged) is equivalent]
        if kept:
            lines += ["", f"| {title.lower()}: line | becomes | reason |", "|---|---|---|"]
        for each in kept:
            found = judged.get((each.module, each.before, each.after))
            where = f"{each.module.removeprefix('bayestouch/')}:{each.line}"
            reason = found.reason if found else "not judged yet"
            lines.append(f"| {where} {_code(each.before)} | {_code(each.after)} | {reason} |")
    return "\n".join(lines)
