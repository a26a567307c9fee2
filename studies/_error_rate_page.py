"""The page docs/error_rates.md, made from the results of `error_rates`."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import redirect_stdout
from io import StringIO
from itertools import groupby

import numpy as np
from _error_rate_tables import (
    BIAS,
    Record,
    at_least,
    counted,
    excess_cut,
    fits,
    found,
    held_out,
    is_member,
    is_named,
    is_named_or_indistinguishable,
    named_first,
    of_kind,
    print_tables,
)
from _error_rate_text import FRESH, LOOKED_AT, PAGE, SECTION, TABLES
from _error_rate_versions import the_version
from independent.dataset import LISTED
from independent.unlisted import PLACED as PLACED_EFFECTS
from scipy.stats import beta

#: Effects outside the catalogue that are functions of element, relative location and load, which a correction can hold.
PLACED = tuple(effect.name for effect in PLACED_EFFECTS)

#: Fingers that were looked at while the catalogue and the search were changed.
DEVELOPMENT = range(10)

#: Errors of readings: what, key.
READ = (
    ("R, bias without its sign (mm)", BIAS),
    ("R, rms (mm)", "R_rms_mm"),
    ("θ_c, rms (degree)", "theta_rms_deg"),
    ("P without the force sensor, rms (N/m)", "P_rms_N_per_m"),
    ("R, coverage of 90 % intervals", "coverage_90"),
)

#: Column of the errors: its title, part of the diagnosis, whether of fingers with an effect.
COLUMNS = (
    ("before", "before", True),
    ("after", "after", True),
    ("after, against references as stated", "after_against_stated", True),
    ("no effect", "after", False),
)


def page(records: list[Record]) -> str:
    """A page of the documentation.

    Raises
    ------
    ValueError
        The results are of several versions of the code.
    """
    version = the_version(records)
    headlines, tables, several = [], [], groups(records)
    for title, some in several.items():
        done = counted(some)
        rows = [
            f"| {question} | {hits} of {n} | {interval(hits, n) if n else '-'} | {aim} |"
            for question, hits, n, aim in headline(done)
        ]
        headlines.append(SECTION.format(Title=title.capitalize(), rows="\n".join(rows), read=readings(done)))
        with StringIO() as text, redirect_stdout(text):
            print_tables(some)
            tables.append(TABLES.format(title=title, tables=text.getvalue().rstrip()))
    return PAGE.format(
        development="\n\n".join(statements(records)),
        n=len(counted(records)),
        fingers=" and ".join(f"{len({r['finger'] for r in some})} {title}" for title, some in several.items()),
        version=version,
        forms=forms(),
        headlines="\n".join(headlines),
        first=next(iter(several)),
        tables="\n".join(tables).rstrip(),
    )


def is_looked_at(record: Record) -> bool:
    """Whether the finger is of the development set."""
    return record["finger"] in DEVELOPMENT


def groups(records: list[Record]) -> dict[str, list[Record]]:
    """Records by design, and by whether the finger is of the development set, under what they are called."""
    several = {}
    for design in ("small", "whole"):
        for looked_at in (True, False):
            some = [r for r in records if r["design"] == design and is_looked_at(r) == looked_at]
            if counted(some):
                fingers = sorted({record["finger"] for record in some})
                kind = "development set" if looked_at else "fresh"
                several[f"{design} fingers {numbers(fingers)} ({kind})"] = some
    return several


def numbers(fingers: list[int]) -> str:
    """Numbers in order as text: ``0 to 4, 7``."""
    runs = [[n for _, n in run] for _, run in groupby(enumerate(fingers), key=lambda each: each[1] - each[0])]
    return ", ".join(f"{run[0]} to {run[-1]}" if len(run) > 1 else f"{run[0]}" for run in runs)


def statements(records: list[Record]) -> list[str]:
    """What the fingers are: looked at before, fresh, or both kinds."""
    said = []
    for looked_at, text in ((True, LOOKED_AT), (False, FRESH)):
        fingers = sorted({record["finger"] for record in records if is_looked_at(record) == looked_at})
        if fingers:
            said.append(text.format(fingers=numbers(fingers)))
    return said


def forms() -> str:
    """The forms of the effects, and whether the catalogue's formula can be them, as a table."""
    rows = [f"| {e.name} | {e.form} | {'yes' if e.in_catalogue else 'no'} | {e.reason} |" for e in LISTED]
    return "\n".join(["| effect | form | member | why |", "|---|---|---|---|", *rows])


def interval(hits: int, n: int) -> str:
    """95 % interval of a rate after Clopper and Pearson, in percent."""
    low = beta.ppf(0.025, hits, n - hits + 1) if hits else 0.0
    high = beta.ppf(0.975, hits + 1, n - hits) if hits < n else 1.0
    return f"{100 * low:.0f} to {100 * high:.0f} %"


def headline(records: list[Record]) -> list[tuple[str, int, int, str]]:
    """What was aimed at: question, hits, of how many, aim."""
    plain, two, outside = (of_kind(records, kind) for kind in ("none", "pair", "unlisted"))
    large, named = at_least(records, 1.0), named_first(records)

    def count(
        question: str, some: list[Record], hit: Callable[[Record], bool], aim: str = ""
    ) -> tuple[str, int, int, str]:
        return question, sum(map(hit, some)), len(some), aim

    def by_form(
        question: str, some: list[Record], hit: Callable[[Record], bool], aim: str = ""
    ) -> list[tuple[str, int, int, str]]:
        return [
            count(question, some, hit, aim),
            count("... forms that are members of the catalogue", list(filter(is_member, some)), hit),
            count("... other forms", [record for record in some if not is_member(record)], hit),
        ]

    def says(verdict: str) -> Callable[[Record], bool]:
        return lambda record: bool(record["diagnosis"]["verdict"] == verdict)

    sizes = sorted({record["effects"][0][1] for record in named})
    return [
        count("no effect: `adequate`", plain, says("adequate"), "95 %"),
        *by_form("size 1 and above: named first", large, is_named, "90 %"),
        count(
            "size 1 and above: named first, or indistinguishable from what was named",
            large,
            is_named_or_indistinguishable,
        ),
        count("size 1 and above: another effect named first", large, lambda r: bool(found(r)) and not is_named(r)),
        *by_form("pairs, size 1.5 each: both found", two, lambda r: set(r["names"]) <= set(found(r)), "80 %"),
        count("outside the catalogue: `unattributed`", outside, says("unattributed"), "90 %"),
        count("... and half of the held-out excess or more corrected", outside, lambda r: excess_cut(r) >= 0.5),
        count(
            f"... half or more corrected, of {', '.join(PLACED)}",
            [r for r in outside if r["names"][0] in PLACED],
            lambda r: excess_cut(r) >= 0.5,
        ),
        *by_form("named first: nothing is left that the test sees", named, says("explained")),
        *(
            count(
                f"named first, size {size:g}: held-out lack of fit after at most 1.1",
                [record for record in named if record["effects"][0][1] == size],
                fits,
            )
            for size in sizes
        ),
        count("no effect: held-out lack of fit at most 1.1", plain, fits),
    ]


def readings(records: list[Record]) -> str:
    """Held-out errors of readings of touches before and after, beside those of fingers without effects, as a table.

    Means over cases and their standard errors, where the true effect was named first and touches were read. Columns
    that no result has are left out.
    """
    right, plain = named_first(records), of_kind(records, "none")

    def mean(some: list[Record], part: str, key: str) -> str:
        known = [held_out(record, part, key) for record in some]
        values = np.array([value for value in known if value is not None])
        if len(values) < 2:
            return "-"
        return f"{values.mean():.3g} ± {values.std(ddof=1) / np.sqrt(len(values)):.1g} ({len(values)})"

    there = [column for column in COLUMNS if any(record["diagnosis"].get(column[1]) for record in records)]
    titles = ["touches held out, mean ± standard error (cases)", *(title for title, _, _ in there)]
    rows = [[what, *(mean(right if effect else plain, part, key) for _, part, effect in there)] for what, key in READ]
    return "\n".join(f"| {' | '.join(row)} |" for row in [titles, ["---"] * len(titles), *rows])
