"""How often is a cause there that a diagnosis names? Shares for probabilities of causes, from three studies.

A diagnosis compares the models that it fitted. None of them may be right: an effect may follow another formula than
that of the catalogue, and a cause that no catalogue has may imitate an effect. This study counts how often named causes
were there, on the fingers of the first three blind studies, whose causes are known and whose formulas nobody had seen.
Each study has the same weight. `bayestouch.diagnosis.imitations` has these shares, and a test compares them.

A second table shows what the shares are worth on fingers that were not counted: calibration error and log score of the
probabilities in each study, with the shares of the two others.

    python studies/imitations.py [--docs]

`--docs` writes both tables of docs/diagnosis.md.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))

from _cause_rules import Forecasts
from _page import DOCS, markdown_table, put_into_page
from _result_lines import kept_lines
from causes import with_statement

from bayestouch.diagnosis.causes import Causes
from bayestouch.diagnosis.imitations import NO_EFFECTS, SOMETHING_ELSE, Shares, allowing, best_effect, split
from bayestouch.diagnosis.verdict import structure_left

Record = dict[str, Any]
Row = tuple[str, bool]
#: What is counted, in the order of the table.
ROWS: dict[Row, str] = {
    ("first", False): "named first, nothing left",
    ("first", True): "named first, structure left",
    ("later", False): "added to others, nothing left",
    ("later", True): "added to others, structure left",
    ("in_place", True): "none named, structure left: none is there",
    ("hidden", True): "none named, structure left: the best effect is there",
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


HAD = {False: Shares(0.92, 0.56, 0.80, 0.0), True: Shares(0.86, 0.51, 0.80, 0.0)}
STUDIES = {
    "first": Study("blind_study", None),
    "second": Study("second_blind_study", HAD),
    "third": Study("third_blind_study", HAD),
}


@dataclass(frozen=True)
class Count:
    """Of so many causes that were named, how many were there."""

    there: int = 0
    named: int = 0

    def __str__(self) -> str:
        return f"{self.there} of {self.named}"

    @property
    def share(self) -> float:
        """Share that was there."""
        return self.there / self.named


def effects_of(names: Iterable[str]) -> list[str]:
    """The names that are effects."""
    return [each for each in names if each not in NO_EFFECTS]


def named(record: Record) -> Iterator[tuple[Row, bool]]:
    """Row of the table and whether it was there, for each cause that the verdict of a diagnosis names."""
    left = structure_left(record["verdict"])
    effects = effects_of(record["stated"])
    for i, name in enumerate(effects):
        yield ("later" if i else "first", left), name in record["truth"]
    if not effects and left:
        yield ("in_place", True), record["kind"] == "unlisted"
        best = best_effect(recorded(record))
        yield ("hidden", True), best is not None and list(best) == list(record["truth"])


def recorded(record: Record) -> list[Causes]:
    """The sets of causes of a result."""
    return [Causes(tuple(each["names"]), each["probability"]) for each in record["causes"]]


def counted(records: Iterable[Record]) -> dict[Row, Count]:
    """Counts by row, of all diagnoses that ended."""
    total = dict.fromkeys(ROWS, Count())
    for record in records:
        for row, is_there in named(record):
            before = total[row]
            total[row] = Count(before.there + is_there, before.named + 1)
    return total


def shares(of: Sequence[dict[Row, Count]]) -> dict[Row, float]:
    """Mean of the studies' shares, by row."""
    return {row: sum(each[row].share for each in of) / len(of) for row in ROWS}


def by_structure(share: dict[Row, float]) -> dict[bool, Shares]:
    """The shares as the package has them, by whether structure is left."""
    of_place = share["in_place", True], share["hidden", True]
    return {left: Shares(share["first", left], share["later", left], *of_place) for left in (False, True)}


def results() -> dict[str, list[Record]]:
    """Diagnoses of each study that ended, with what they state."""
    return {
        name: [
            with_statement(each)
            for each in kept_lines(DOCS / "results" / one.folder / "results.jsonl")
            if each.get("causes")
        ]
        for name, one in STUDIES.items()
    }


def as_fitted(causes: Sequence[Causes], had: Shares) -> list[Causes]:
    """Probabilities as if one of the fitted sets were right, from those that allow for imitations with shares `had`."""
    left, out = {each.names: each.probability for each in causes}, list[Causes]()
    # Each set has given parts to smaller ones only. So what a largest set has now is a known part of what it had.
    for names in sorted(left, key=len, reverse=True):
        if names == (SOMETHING_ELSE,):
            continue
        parts = dict(split(names, had, None))
        whole = max(left[names] / parts[names], 0.0)
        out.append(Causes(names, whole))
        for part, share in parts.items():
            left[part] = left.get(part, 0.0) - share * whole
    return sorted(out, key=lambda each: -each.probability)


def again(record: Record, had: dict[bool, Shares] | None, now: dict[bool, Shares]) -> Record:
    """The result with probabilities of causes that allow for imitations with the shares `now`."""
    left = structure_left(record["verdict"])
    fitted = recorded(record) if had is None else as_fitted(recorded(record), had[left])
    return {**record, "causes": [asdict(each) for each in allowing(fitted, now[left], best_effect(recorded(record)))]}


def left_out(found: dict[str, list[Record]]) -> str:
    """Calibration error and log scores of each study with the shares of the others."""
    counts = {name: counted(records) for name, records in found.items()}
    rows = []
    for name, records in found.items():
        now = by_structure(shares([each for other, each in counts.items() if other != name]))
        of = Forecasts.of([again(each, STUDIES[name].had, now) for each in records])
        scores = f"{of.calibration_error:.3f}", f"{of.log_score:.2f}", f"{of.rule_log_score:.2f}"
        rows.append([name, str(len(records)), *scores])
    return markdown_table(["study", "fingers", "calibration error", "log score", "log score of the verdict"], rows)


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
    text = f"{table(found)}\nWith the shares of the two other studies:\n\n{left_out(found)}"
    print(text)
    if given.docs:
        put_into_page("imitations.py", text, DOCS / "diagnosis.md")
    return text


if __name__ == "__main__":
    main()
