"""Tables of `error_rates`: what was said of what was there."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from contextlib import redirect_stdout
from io import StringIO
from typing import Any

import numpy as np
from independent.unlisted import PLACED as PLACED_EFFECTS
from scipy.stats import beta

Record = dict[str, Any]

#: Effects outside the catalogue that are functions of element, relative location and load, which a correction can hold.
PLACED = tuple(effect.name for effect in PLACED_EFFECTS)

PAGE = """# Error rates of the diagnosis

How often `bayestouch diagnose` is right, on simulated fingers of which it is told nothing. The simulator shares no code
with the package and gives effects other formulas than the catalogue's: a tanh for a power of the reading, a triangular
aperture for a rectangular one, two exponentials for a spectrum, second neighbours for ever further ones. A *size* is
what an effect leaves in the touch means after the base parameters have absorbed what they can, root mean square, over
the noise of an averaged touch: the lack of fit is about 1 + size².

This page is written by `studies/error_rates.py` from its results and holds {n} diagnoses of two kinds of fingers. Small
ones have 8 elements, 175 touches that are fitted and 52 that are held out; whole ones are as the practice fingers, with
16 elements, 468 touches that are fitted and 225 that are held out. Ten small fingers take 40 minutes on two
cores, ten whole ones two to three hours. Cases of a finger are run in random order, so that a part of a run is a
smaller study:

    python studies/error_rates.py -o FOLDER --small --light
    python studies/error_rates.py -o FOLDER --light --minutes 60 --docs docs/error_rates.md

Intervals are 95 % (Clopper and Pearson) and treat the cases as drawn from the effects, forms and sizes of the study;
those of a finger share its touches, and are less sure by that. The noise of readings is drawn anew for each case.

The lack of fit of 416 held-out readings of a small finger scatters by 0.07 of itself if nothing is missing, and what
the fit leaves open adds a few hundredths (a drift more): the test of [](diagnosis.md) allows for both, and the rows
"no effect" show what chance alone leaves above 1.1. In large effects the difference between an effect's own formula and
the catalogue's is beyond the noise, too; then the verdict is "partly explained", and a correction takes what it can.

{headlines}

```{{figure}} figures/error_rates_detection.png
Share of fingers in which an effect was detected and named, against its size.
```

```{{figure}} figures/error_rates_confusion.png
What was named first, for what was there (size 1 and above). Both figures are of the small fingers.
```

{tables}
"""

SECTION = """## {Design} fingers

| what | how often | interval | aim |
|---|---|---|---|
{rows}

| touches held out, mean ± standard error (cases) | before | after | no effect |
|---|---|---|---|
{read}
"""

#: Errors of readings: what, key.
READ = (
    ("R, bias (mm)", "R_bias_mm"),
    ("R, rms (mm)", "R_rms_mm"),
    ("θ_c, rms (degree)", "theta_rms_deg"),
    ("P, read without the force sensor, rms (N/m)", "P_rms_N_per_m"),
    ("R, coverage of 90 % intervals", "coverage_90"),
)

TABLES = """## Tables of the {design} fingers

```text
{tables}
```
"""


def interval(hits: int, n: int) -> str:
    """95 % interval of a rate after Clopper and Pearson, in percent."""
    low = beta.ppf(0.025, hits, n - hits + 1) if hits else 0.0
    high = beta.ppf(0.975, hits + 1, n - hits) if hits < n else 1.0
    return f"{100 * low:.0f} to {100 * high:.0f} %"


def headline(records: list[Record]) -> list[tuple[str, int, int, str]]:
    """What was aimed at: question, hits, of how many, aim."""
    plain, two, outside = (of_kind(records, kind) for kind in ("none", "pair", "unlisted"))
    large, named = at_least(records, 1.0), named_first(records)

    def count(question: str, some: list[Record], hit: Callable[[Record], bool], aim: str) -> tuple[str, int, int, str]:
        return question, sum(map(hit, some)), len(some), aim

    return [
        count("no effect: `adequate`", plain, lambda r: r["diagnosis"]["verdict"] == "adequate", "95 %"),
        count("size 1 and above: named first", large, is_named, "90 %"),
        count(
            "... or declared indistinguishable from what was named",
            large,
            is_named_or_alike,
            "",
        ),
        count("pairs, size 1.5 each: both found", two, lambda r: set(r["names"]) <= set(found(r)), "80 %"),
        count(
            "outside the catalogue: `unattributed`",
            outside,
            lambda r: r["diagnosis"]["verdict"] == "unattributed",
            "90 %",
        ),
        count(
            "... and half of the held-out excess or more corrected",
            outside,
            lambda r: excess_cut(r) >= 0.5,
            "",
        ),
        count(
            "... where it goes with element, relative location and load",
            [r for r in outside if r["names"][0] in PLACED],
            lambda r: excess_cut(r) >= 0.5,
            "",
        ),
        count(
            "named first: nothing is left that the test sees",
            named,
            lambda r: r["diagnosis"]["verdict"] == "explained",
            "",
        ),
        *(
            count(
                f"... held-out lack of fit after at most 1.1, size {size:g}",
                [record for record in named if record["effects"][0][1] == size],
                fits,
                "",
            )
            for size in sorted({record["effects"][0][1] for record in named})
        ),
        count("no effect: held-out lack of fit at most 1.1", plain, fits, ""),
    ]


def fits(record: Record) -> bool:
    """Whether the lack of fit after is what was aimed at."""
    return float(record["diagnosis"]["after"]["lack_of_fit"]) <= 1.1


def readings(records: list[Record]) -> str:
    """Held-out errors of readings of touches before and after, beside those of fingers without effects.

    Means over cases and their standard errors, where the true effect was named first and touches were read.
    """
    right, plain = named_first(records), of_kind(records, "none")

    def mean(some: list[Record], when: str, key: str) -> str:
        known = [record["diagnosis"][when][key] for record in some]
        values = np.array([value for value in known if value is not None])
        if len(values) < 2:
            return "-"
        return f"{values.mean():.3g} ± {values.std(ddof=1) / np.sqrt(len(values)):.1g} ({len(values)})"

    rows = [
        f"| {what} | {mean(right, 'before', key)} | {mean(right, 'after', key)} | {mean(plain, 'after', key)} |"
        for what, key in READ
    ]
    return "\n".join(rows)


def by_design(records: list[Record]) -> dict[str, list[Record]]:
    """Records of small fingers, then of whole ones."""
    several = {design: [r for r in records if r["design"] == design] for design in ("small", "whole")}
    return {design: some for design, some in several.items() if any("diagnosis" in record for record in some)}


def page(records: list[Record]) -> str:
    """A page of the documentation."""
    headlines, tables = [], []
    for design, some in by_design(records).items():
        done = [record for record in some if "diagnosis" in record]
        rows = [
            f"| {question} | {hits} of {n} | {interval(hits, n) if n else '-'} | {aim} |"
            for question, hits, n, aim in headline(done)
        ]
        headlines.append(SECTION.format(Design=design.capitalize(), rows="\n".join(rows), read=readings(done)))
        with StringIO() as text, redirect_stdout(text):
            print_tables(some)
            tables.append(TABLES.format(design=design, tables=text.getvalue().rstrip()))
    n = sum("diagnosis" in record for record in records)
    return PAGE.format(headlines="\n".join(headlines), tables="\n".join(tables).rstrip(), n=n)


def print_tables(records: list[Record]) -> None:
    """All tables. Cases out of reach, and those that failed, are counted first."""
    failed = [record for record in records if "error" in record]
    beyond = [record for record in records if "out_of_reach" in record]
    done = [record for record in records if "diagnosis" in record]
    print(f"{len(done)} diagnoses, {len(beyond)} cases out of reach, {len(failed)} failed")
    for record in failed[:10]:
        print(f"  failed: {record['key']}: {record['error']}")
    if not done:
        return
    for table in (nothing_there, detection, confusion, pairs, unlisted, before_and_after, cost):
        print()
        table(done)


def of_kind(records: list[Record], kind: str) -> list[Record]:
    """Records of one kind of case."""
    return [record for record in records if record["kind"] == kind]


def found(record: Record) -> list[str]:
    """Effects that were added, in order."""
    return [effect["name"] for effect in record["diagnosis"]["effects"]]


def said(record: Record) -> str:
    """The effect named first, else the verdict."""
    names = found(record)
    return names[0] if names else str(record["diagnosis"]["verdict"])


def alike(record: Record) -> set[str]:
    """Effects that the data could not tell from one that was added."""
    return {name for effect in record["diagnosis"]["effects"] for name in effect.get("indistinguishable_from", ())}


def rate(records: Iterable[Record], hit: Callable[[Record], bool]) -> str:
    """Hits of all, as ``9/10``."""
    hits = [hit(record) for record in records]
    return f"{sum(hits)}/{len(hits)}" if hits else "-"


def at_least(records: list[Record], size: float) -> list[Record]:
    """Single effects of at least this size."""
    return [record for record in of_kind(records, "one") if record["effects"][0][1] >= size]


def is_named(record: Record) -> bool:
    """Whether the effect that is there was named first."""
    return said(record) == record["names"][0]


def is_named_or_alike(record: Record) -> bool:
    """The same, or declared indistinguishable from what was named."""
    return is_named(record) or record["names"][0] in alike(record)


def named_first(records: list[Record]) -> list[Record]:
    """Single effects of size 1 and above that were named first."""
    return list(filter(is_named, at_least(records, 1.0)))


def nothing_there(records: list[Record]) -> None:
    """False alarms."""
    plain = of_kind(records, "none")
    print("no effect: adequate in", rate(plain, lambda r: r["diagnosis"]["verdict"] == "adequate"), "(aim: 95 %)")
    for alarm in sorted(said(record) for record in plain if record["diagnosis"]["verdict"] != "adequate"):
        print(f"  false alarm: {alarm}")


def detection(records: list[Record]) -> None:
    """Detected (anything but adequate), named first, named first or not told from what was, by effect and size."""
    ones = of_kind(records, "one")
    sizes = sorted({record["effects"][0][1] for record in ones})
    print("detected / named first / named first or declared alike, by size (noise of an averaged touch)")
    print(f"{'':26s}" + "".join(f"{size:>22g}" for size in sizes))
    for name in [*dict.fromkeys(record["names"][0] for record in ones), "all"]:
        cells = []
        for size in sizes:
            here = [r for r in ones if r["effects"][0][1] == size and name in ("all", r["names"][0])]
            counts = (
                rate(here, lambda r: r["diagnosis"]["verdict"] != "adequate"),
                rate(here, is_named),
                rate(here, is_named_or_alike),
            )
            cells.append(" ".join(f"{count:>6s}" for count in counts))
        print(f"{name:26s}" + "".join(f"{cell:>22s}" for cell in cells))
    print("size 1 and above, named first:", rate(at_least(records, 1.0), is_named), "(aim: 90 %)")


def confusion(records: list[Record]) -> None:
    """What was named first for each single effect of size 1 and above."""
    print("named first, for effects of size 1 and above")
    large = at_least(records, 1.0)
    for name in dict.fromkeys(record["names"][0] for record in large):
        counts = Counter(said(record) for record in large if record["names"][0] == name)
        print(f"{name:26s}" + ", ".join(f"{what} {count}" for what, count in counts.most_common()))


def pairs(records: list[Record]) -> None:
    """Both effects of a pair found."""
    two = of_kind(records, "pair")
    print("pairs, both found:", rate(two, lambda r: set(r["names"]) <= set(found(r))), "(aim: 80 %)")
    for names in dict.fromkeys(tuple(record["names"]) for record in two):
        here = [record for record in two if tuple(record["names"]) == names]
        counts = Counter(" + ".join(found(record)) or said(record) for record in here)
        print(f"  {' + '.join(names):44s}" + ", ".join(f"{what} {count}" for what, count in counts.most_common()))


def excess_cut(record: Record) -> float:
    """Share of the held-out lack of fit above 1 (the noise floor) that was taken away; NaN where there is none."""
    before, after = (record["diagnosis"][when]["lack_of_fit"] for when in ("before", "after"))
    if before is None or after is None or before <= 1:
        return float("nan")
    return float((before - after) / (before - 1))


def unlisted(records: list[Record]) -> None:
    """Effects outside the catalogue."""
    print("outside the catalogue: unattributed (or an effect and then unattributed), share of the excess cut, median")
    outside = of_kind(records, "unlisted")
    for name in [*dict.fromkeys(record["names"][0] for record in outside), "all"]:
        for size in sorted({record["effects"][0][1] for record in outside}):
            here = [r for r in outside if r["effects"][0][1] == size and name in ("all", r["names"][0])]
            counts = Counter(r["diagnosis"]["verdict"] + "".join(f" +{each}" for each in found(r)) for r in here)
            verdicts = rate(here, lambda r: r["diagnosis"]["verdict"] == "unattributed")
            half = rate(here, lambda r: excess_cut(r) >= 0.5)
            cut = np.nanmedian([excess_cut(record) for record in here]) if here else np.nan
            listed = ", ".join(f"{what} {count}" for what, count in counts.most_common(4)) if name != "all" else ""
            print(f"{name:18s}{size:4g}{verdicts:>8s}  cut {cut:5.2f}, half or more {half:>6s}  {listed}")


def before_and_after(records: list[Record]) -> None:
    """Held-out figures before and after, where the true effect was named first; medians."""
    keys = ("lack_of_fit", "R_bias_mm", "R_rms_mm", "theta_rms_deg", "P_rms_N_per_m", "coverage_90")
    print("held out, before -> after: medians; named first, size 1 and above (R, θ_c, P, coverage: size 2)")
    print(f"{'':26s}" + "".join(f"{key:>20s}" for key in keys))
    right, plain = named_first(records), of_kind(records, "none")
    for name in [*dict.fromkeys(record["names"][0] for record in right), "all", "none"]:
        here = plain if name == "none" else [record for record in right if name in ("all", record["names"][0])]
        cells = []
        for key in keys:
            pair = [_median([record["diagnosis"][when].get(key) for record in here]) for when in ("before", "after")]
            cells.append(f"{pair[0]:.3g} -> {pair[1]:.3g}")
        print(f"{name:26s}" + "".join(f"{cell:>20s}" for cell in cells))
    print("lack of fit after at most 1.1:", rate(right, fits))


def _median(values: list[float | None]) -> float:
    known = [value for value in values if value is not None]
    return float(np.median(known)) if known else float("nan")


def cost(records: list[Record]) -> None:
    """Time of a diagnosis."""
    seconds = [record["seconds"] for record in records]
    quantiles = ", ".join(f"{value:.1f}" for value in np.quantile(seconds, [0.0, 0.5, 0.9, 1.0]))
    cpu = np.median([record["cpu_seconds"] for record in records])
    print(f"seconds a diagnosis (least, median, 90 %, most): {quantiles}; of the processor, median {cpu:.1f}")
