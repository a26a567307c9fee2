"""Tables that studies put into the documentation."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
from pathlib import Path

DOCS = Path(__file__).parent.parent / "docs"
PAGE, RELIABILITY, STATISTICS = DOCS / "robustness.md", DOCS / "reliability.md", DOCS / "statistics.md"
PUBLISHED = DOCS / "published.md"
MADE_BY_HAND = DOCS / "made_by_hand.md"


def write_between(mark: str, text: str, page: Path) -> None:
    """Put text between two equal comments of a page, in place of what is there."""
    head, *parts = page.read_text("utf-8").split(mark)
    if len(parts) != 2:
        raise LookupError(f"{page.name}: expected {mark} twice")
    page.write_text(f"{head}{mark}\n\n{text}\n\n{mark}{parts[1]}", "utf-8")


def put_into_page(script: str, table: str, page: Path = PAGE) -> None:
    """Put a table between the comments of a script in a page, in place of what is there.

    Raises
    ------
    LookupError
        The page has no such comments.
    """
    begin, end = f"<!-- table of studies/{script} -->\n", f"<!-- end of studies/{script} -->"
    text = page.read_text("utf-8")
    before, _, rest = text.partition(begin)
    _, found, after = rest.partition(end)
    if not found:
        raise LookupError(f"{page.name} has no place for {script}")
    page.write_text(f"{before}{begin}\n{table}\n{end}{after}", "utf-8")


def markdown_table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a Markdown table, with the end of its last line."""
    return "".join(f"| {' | '.join(line)} |\n" for line in (head, ["---"] * len(head), *rows))


def ends(values: Iterable[float], digits: int = 2) -> str:
    """Return smallest and largest of some values as text, or the one that both are."""
    known = list(values)
    low, high = (f"{each:.{digits}f}" for each in (min(known), max(known)))
    return low if low == high else f"{low} to {high}"


def docs_of(arguments: list[str]) -> tuple[bool, list[str]]:
    """Return whether ``--docs`` is among the arguments of a study, and the other arguments."""
    parser = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    parser.add_argument("--docs", action="store_true")
    chosen, others = parser.parse_known_args(arguments)
    return chosen.docs, others
