"""How often is a cause there that a diagnosis names? Shares for probabilities of causes, from five studies.

A diagnosis compares the models that it fitted. None of them may be right: an effect may follow another formula than
that of the catalogue, and a cause that no catalogue has may imitate an effect. This study counts how often named causes
were there, on the fingers of the five blind studies, whose causes are known and whose formulas nobody had seen. Each
finger has the same weight. `bayestouch.diagnosis.imitations` has these shares, and a test compares them.

A second table shows what the shares are worth on fingers that were not counted: calibration error and log score of the
probabilities in each study, with the shares of the others.

    python studies/imitations.py [--docs]

`--docs` writes both tables of docs/diagnosis.md.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))

from _cause_rules import DRIFTS, Forecasts
from _page import DOCS, markdown_table, put_into_page
from _result_lines import kept_lines
from causes import with_statement

from bayestouch.diagnosis.causes import IN_TIME, IN_TOUCHES, NOTHING, Causes, Names
from bayestouch.diagnosis.imitations import (
    NO_EFFECTS,
    SOMETHING_ELSE,
    Named,
    Shares,
    allowing,
    best_effect,
    split,
)
from bayestouch.diagnosis.place_or_time import IN_PLACE
from bayestouch.diagnosis.verdict import structure_left

Record = dict[str, Any]
#: What is counted, and whether structure was left; None where both are counted together.
Row = tuple[str, bool | None]
# In the order of the table.
WORDS = {
    "alone": "named alone",
    "first": "named first of several",
    "beside": "second, after one that is there",
    "instead": "second, after one that is not",
    "further": "third or later",
    "more": "not named, beside one that is there",
    "passed_over": "tried and not named",
}
OF_BOTH = {
    "in_time": "something in time, tried and not named",
    "unlisted": "unattributed: the cause is in no catalogue",
    "hidden": "unattributed: the best effect is there",
}
ROWS: dict[Row, str] = {
    **{(word, False): f"{text}; nothing left" for word, text in WORDS.items()},
    **{(word, True): f"{text}; structure left" for word, text in WORDS.items()},
    **{(word, None): text for word, text in OF_BOTH.items()},
}


@dataclass(frozen=True)
class Study:
    """A blind study, and the shares that the code had that was examined.

    Attributes
    ----------
    folder : str
        Folder in docs/results.
    had : Shares by structure left, or None
        Shares that the recorded probabilities allow for; None where they allow for no imitations.
    """

    folder: str
    had: dict[bool, Shares] | None


def of_two(first: float, later: float, unlisted: float, hidden: float) -> Shares:
    """Shares of earlier code, which told first causes from later ones only."""
    return Shares(
        alone=first,
        first=first,
        beside=later,
        instead=later,
        further=later,
        more=0.0,
        # all that was fitted counted as named (`ALL_OPEN`)
        passed_over=0.0,
        in_time=0.0,
        unlisted=unlisted,
        hidden=hidden,
    )


ALL_OPEN = Named((), structure_left=True)
HAD = {False: of_two(0.92, 0.56, 0.80, 0.0), True: of_two(0.86, 0.51, 0.80, 0.0)}
HAD_LATER = {False: of_two(0.85, 0.36, 0.60, 0.16), True: of_two(0.77, 0.50, 0.60, 0.16)}
STUDIES = {
    "first": Study("blind_study", None),
    "second": Study("second_blind_study", HAD),
    "third": Study("third_blind_study", HAD),
    "fourth": Study("fourth_blind_study", HAD_LATER),
    "fifth": Study("fifth_blind_study", HAD_LATER),
}


@dataclass(frozen=True)
class Count:
    """Of so many causes, how many were there; of causes that were passed over, their probabilities."""

    there: float = 0
    of: float = 0

    def __str__(self) -> str:
        return " of ".join(f"{round(each, 1):g}" for each in (self.there, self.of))

    @property
    def share(self) -> float:
        """Share that was there."""
        return self.there / self.of


def effects_of(names: Iterable[str]) -> list[str]:
    """The names that are effects."""
    return [each for each in names if each not in NO_EFFECTS]


def counts_of(record: Record) -> Iterator[tuple[Row, bool, float]]:
    """Row of the table, whether it was there, and its weight, for each cause that a diagnosis names or passes over."""
    left = structure_left(record["verdict"])
    effects, truth = effects_of(record["stated"]), set(record["truth"])
    for i, name in enumerate(effects):
        after = "beside" if effects[0] in truth else "instead"
        row = ("further" if i > 1 else after if i else "first") if len(effects) > 1 else "alone"
        yield (row, left), name in truth, 1
    if truth & set(effects):
        yield ("more", left), bool(truth - set(effects)), 1
    yield from _passed_over(record)
    if left and not effects:
        yield ("unlisted", None), record["kind"] == "unlisted", 1
        yield ("hidden", None), record["best"] is not None and list(record["best"]) == list(record["truth"]), 1


def _passed_over(record: Record) -> Iterator[tuple[Row, bool, float]]:
    named, truth = named_by(record), set(record["truth"])
    for each in recorded(record):
        for name in {*each.names} - {NOTHING, IN_PLACE}:
            if named.passed_over(name, each.names):
                if name in (IN_TIME, IN_TOUCHES):
                    yield ("in_time", None), bool(truth & DRIFTS - {*named.effects}), each.probability
                else:
                    yield ("passed_over", named.structure_left), name in truth, each.probability


def named_by(record: Record) -> Named:
    """What the verdict of a result says of causes."""
    effects = effects_of(record["stated"])
    drifts = DRIFTS - {*effects}
    pairs = [
        tuple(IN_TIME if each in drifts else each for each in pair) for pair in record.get("not_distinguishable", ())
    ]
    return Named(tuple(effects), structure_left(record["verdict"]), tuple(pairs))


def recorded(record: Record) -> list[Causes]:
    """The sets of causes of a result."""
    return [Causes(tuple(each["names"]), each["probability"]) for each in record["causes"]]


def counted(records: Iterable[Record]) -> dict[Row, Count]:
    """Counts by row, of all diagnoses that ended."""
    total = dict.fromkeys(ROWS, Count())
    for record in records:
        for row, is_there, weight in counts_of(record):
            before = total[row]
            total[row] = Count(before.there + is_there * weight, before.of + weight)
    return total


def shares(of: Sequence[dict[Row, Count]]) -> dict[Row, float]:
    """Shares of all fingers of these studies together, by row."""
    return {row: Count(sum(each[row].there for each in of), sum(each[row].of for each in of)).share for row in ROWS}


def by_structure(share: dict[Row, float]) -> dict[bool, Shares]:
    """The shares as the package has them, by whether structure is left."""
    of_both = {word: share[word, None] for word in OF_BOTH}
    return {left: Shares(**{word: share[word, left] for word in WORDS}, **of_both) for left in (False, True)}


def results() -> dict[str, list[Record]]:
    """Diagnoses of each study that ended, with what they state, and probabilities as if a fitted set were right."""
    return {
        name: [
            with_fitted(with_statement(each), one.had)
            for each in kept_lines(DOCS / "results" / one.folder / "results.jsonl")
            if each.get("causes")
        ]
        for name, one in STUDIES.items()
    }


def with_fitted(record: Record, had: dict[bool, Shares] | None) -> Record:
    """The result with probabilities as if one of the fitted sets of causes were right, and with its `best` effect.

    The probabilities were stated with shares `had`. The best effect is that of the stated ones: where it got a share of
    a place, what it had before may be too little for the rounding.
    """
    stated = recorded(record)
    best = best_effect(stated)
    fitted = stated if had is None else as_fitted(stated, had[structure_left(record["verdict"])], best)
    return {**record, "causes": [asdict(each) for each in fitted], "best": best}


def as_fitted(causes: Sequence[Causes], had: Shares, best: Names | None) -> list[Causes]:
    """Probabilities as if one of the fitted sets were right, from those that allow for imitations with shares `had`."""
    left, out = {each.names: each.probability for each in causes}, list[Causes]()
    # Each set has given parts to smaller ones only, and a place to an effect. So what a largest set has now is a known
    # part of what it had.
    for names in sorted(left, key=lambda each: (len(each), each == (IN_PLACE,)), reverse=True):
        if SOMETHING_ELSE in names:  # it was not fitted
            continue
        parts = dict(split(names, ALL_OPEN, had, best))
        whole = max(left[names] / parts[names], 0.0)
        out.append(Causes(names, whole))
        for part, share in parts.items():
            left[part] = left.get(part, 0.0) - share * whole
    return sorted(out, key=lambda each: -each.probability)


def again(record: Record, now: Mapping[bool, Shares]) -> Record:
    """The result with probabilities of causes that allow for imitations with the shares `now`."""
    named = named_by(record)
    allowed = allowing(recorded(record), named, now[named.structure_left], record["best"])
    return {**record, "causes": [asdict(each) for each in allowed]}


def left_out(found: dict[str, list[Record]]) -> str:
    """Calibration error and log scores of each study with the shares of the others.

    The calibration error, too, of the fingers on which the verdict decides what is there.
    """
    counts = {name: counted(records) for name, records in found.items()}
    rows = []
    for name, records in found.items():
        now = by_structure(shares([each for other, each in counts.items() if other != name]))
        all_of_it = [again(each, now) for each in records]
        of = Forecasts.of(all_of_it)
        decided = Forecasts.of([each for each in all_of_it if each["verdict"] != "unattributed"])
        errors = f"{of.calibration_error:.3f}", f"{decided.calibration_error:.3f}"
        rows.append([name, str(len(records)), *errors, f"{of.log_score:.2f}", f"{of.rule_log_score:.2f}"])
    head = ("study", "fingers", "calibration error", "without unattributed", "log score", "log score of the verdict")
    return markdown_table(head, rows)


def table(found: dict[str, list[Record]]) -> str:
    """Counts of each study, and the shares that follow."""
    counts = {name: counted(records) for name, records in found.items()}
    share = shares(list(counts.values()))
    rows = [[text, *(str(each[row]) for each in counts.values()), f"{share[row]:.2f}"] for row, text in ROWS.items()]
    return markdown_table(["causes", *counts, "share"], rows)


def main(arguments: list[str] | None = None) -> str:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    parser.add_argument("--docs", action="store_true", help="write the tables of docs/diagnosis.md")
    given = parser.parse_args(arguments)
    found = results()
    text = f"{table(found)}\nWith the shares of the other studies:\n\n{left_out(found)}"
    print(text)
    if given.docs:
        put_into_page("imitations.py", text, DOCS / "diagnosis.md")
    return text


if __name__ == "__main__":
    main()
