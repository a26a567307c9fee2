"""How often is a cause there that a diagnosis names? Shares for probabilities of causes, from two studies.

A diagnosis compares the models that it fitted. None of them may be right: an effect may follow another formula than
that of the catalogue, and a cause that no catalogue has may imitate an effect. This study counts how often named causes
were there, on simulated fingers whose causes are known: those of the first blind study (formulas that nobody had seen)
and those of `causes.py` for development (formulas like those of the catalogue). Each study has half of the weight.
`bayestouch.diagnosis.imitations` has these shares, and a test compares them.

Results of development are those of ``causes.py -o FILE --development --fingers 10 --cases 146``; of each finger, sets
of causes with a probability below one in a million are left out.

    python studies/imitations.py [--docs]

`--docs` writes the table of docs/diagnosis.md.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))

from _page import DOCS, markdown_table, put_into_page
from _result_lines import kept_lines
from causes import with_statement

from bayestouch.diagnosis.causes import NOTHING
from bayestouch.diagnosis.place_or_time import IN_PLACE
from bayestouch.diagnosis.verdict import structure_left

Record = dict[str, Any]
#: Results of each study.
FILES = {
    "blind study": DOCS / "results" / "blind_study" / "results.jsonl",
    "development": DOCS / "results" / "causes" / "development.jsonl",
}
#: A share of fewer causes than this is too uncertain to have half of the weight.
FEW = 10
#: What is counted, in the order of the table.
ROWS = {
    ("first", False): "named first, nothing left",
    ("first", True): "named first, structure left",
    ("later", False): "added to others, nothing left",
    ("later", True): "added to others, structure left",
    ("in_place", True): "none named, structure left: none is there",
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


def named(record: Record) -> Iterator[tuple[tuple[str, bool], bool]]:
    """Row of the table and whether it was there, for each cause that the verdict of a diagnosis names."""
    left = structure_left(record["verdict"])
    effects = [each for each in record["stated"] if each not in (IN_PLACE, NOTHING)]
    for i, name in enumerate(effects):
        yield ("later" if i else "first", left), name in record["truth"]
    if not effects and left:
        yield ("in_place", True), record["kind"] == "unlisted"


def counted(records: Iterable[Record]) -> dict[tuple[str, bool], Count]:
    """Counts by row, of all diagnoses that ended."""
    total = dict.fromkeys(ROWS, Count())
    for record in records:
        if record.get("causes"):
            for row, is_there in named(with_statement(record)):
                before = total[row]
                total[row] = Count(before.there + is_there, before.named + 1)
    return total


def shares(of: Sequence[dict[tuple[str, bool], Count]]) -> dict[tuple[str, bool], float]:
    """Mean of the studies' shares, by row. Where one of the studies has less than ten causes, the share is of all."""
    out = {}
    for row in ROWS:
        counts = [each[row] for each in of]
        total = Count(sum(each.there for each in counts), sum(each.named for each in counts))
        few = min(each.named for each in counts) < FEW
        out[row] = total.share if few else sum(each.share for each in counts) / len(counts)
    return out


def results() -> dict[str, dict[tuple[str, bool], Count]]:
    """Counts of each study."""
    return {name: counted(kept_lines(path)) for name, path in FILES.items()}


def table(found: dict[str, dict[tuple[str, bool], Count]]) -> str:
    """Counts of each study, and the shares that follow."""
    share = shares(list(found.values()))
    rows = [[text, *(str(each[row]) for each in found.values()), f"{share[row]:.2f}"] for row, text in ROWS.items()]
    return markdown_table(["causes", *found, "share"], rows)


def main(arguments: list[str] | None = None) -> str:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    parser.add_argument("--docs", action="store_true", help="write the table of docs/diagnosis.md")
    given = parser.parse_args(arguments)
    text = table(results())
    print(text)
    if given.docs:
        put_into_page("imitations.py", text, DOCS / "diagnosis.md")
    return text


if __name__ == "__main__":
    main()
