"""Tables of `error_rates`: what was said of what was there."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from independent.dataset import EFFECTS

Record = dict[str, Any]
#: Verdict of a diagnosis that failed.
FAILED = "failed"
#: A figure of held-out touches that has a sign.
BIAS = "R_bias_mm"


def print_tables(records: list[Record]) -> None:
    """All tables. Cases out of reach, and those that failed, are counted first."""
    failed = [record for record in records if "error" in record]
    beyond = [record for record in records if "out_of_reach" in record]
    done = counted(records)
    print(f"{len(done)} diagnoses, {len(failed)} of them failed; {len(beyond)} cases out of reach")
    for record in failed[:10]:
        print(f"  failed: {record['key']}: {record['error']}")
    if not done:
        return
    for table in (nothing_there, detection, confusion, pairs, unlisted, before_and_after, cost):
        print()
        table(done)


def counted(records: list[Record]) -> list[Record]:
    """Cases that rates are of: a diagnosis that failed counts as wrong, as one that says nothing."""
    failed = {"verdict": FAILED, "effects": [], "before": {}, "after": {}}
    return [
        {**record, "diagnosis": failed} if "error" in record else record
        for record in records
        if "out_of_reach" not in record
    ]


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


def indistinguishable(record: Record) -> set[str]:
    """Effects that the data could not tell from one that was added."""
    return {name for effect in record["diagnosis"]["effects"] for name in effect.get("indistinguishable_from", ())}


def rate(records: Iterable[Record], hit: Callable[[Record], bool]) -> str:
    """Hits of all, as ``9/10``."""
    hits = [hit(record) for record in records]
    return f"{sum(hits)}/{len(hits)}" if hits else "-"


def at_least(records: list[Record], size: float) -> list[Record]:
    """Single effects of at least this size."""
    return [record for record in of_kind(records, "one") if record["effects"][0][1] >= size]


def is_detected(record: Record) -> bool:
    """Whether the diagnosis said that something is missing."""
    return record["diagnosis"]["verdict"] not in ("adequate", FAILED)


def is_named(record: Record) -> bool:
    """Whether the effect that is there was named first."""
    return said(record) == record["names"][0]


def is_named_or_indistinguishable(record: Record) -> bool:
    """The same, or declared indistinguishable from what was named."""
    return is_named(record) or record["names"][0] in indistinguishable(record)


def is_member(record: Record) -> bool:
    """Whether the catalogue's formulas can be the forms of all effects that are there."""
    return all(EFFECTS[key].in_catalogue for key, _ in record["effects"])


def fits(record: Record) -> bool:
    """Whether the lack of fit after is what was aimed at."""
    after = record["diagnosis"]["after"].get("lack_of_fit")
    return after is not None and bool(after <= 1.1)


def named_first(records: list[Record]) -> list[Record]:
    """Single effects of size 1 and above that were named first."""
    return list(filter(is_named, at_least(records, 1.0)))


def nothing_there(records: list[Record]) -> None:
    """False alarms."""
    plain = of_kind(records, "none")
    print("no effect: adequate in", rate(plain, lambda r: r["diagnosis"]["verdict"] == "adequate"), "(aim: 95 %)")
    for alarm in sorted(said(record) for record in plain if record["diagnosis"]["verdict"] != "adequate"):
        print(f"  false alarm: {alarm}" if alarm != FAILED else "  failed")


def detection(records: list[Record]) -> None:
    """Detected (anything but adequate), named first, named first or not told from what was, by form and size."""
    ones = of_kind(records, "one")
    sizes = sorted({record["effects"][0][1] for record in ones})
    print("detected / named first / named first or declared indistinguishable, by size (noise of an averaged touch)")
    print("* members: the catalogue's formula can give the readings of this form")
    print(f"{'':42s}" + "".join(f"{size:>22g}" for size in sizes))
    forms = sorted({record["effects"][0][0] for record in ones}, key=list(EFFECTS).index)
    for form in [*forms, "all"]:
        cells = []
        for size in sizes:
            here = [r for r in ones if r["effects"][0][1] == size and form in ("all", r["effects"][0][0])]
            counts = (
                rate(here, is_detected),
                rate(here, is_named),
                rate(here, is_named_or_indistinguishable),
            )
            cells.append(" ".join(f"{count:>6s}" for count in counts))
        star = " *" if form != "all" and EFFECTS[form].in_catalogue else ""
        print(f"{form + star:42s}" + "".join(f"{cell:>22s}" for cell in cells))
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


def held_out(record: Record, part: str, key: str) -> float | None:
    """A figure of the touches that were held out; a bias without its sign, since those of several fingers cancel."""
    value = (record["diagnosis"].get(part) or {}).get(key)
    return abs(value) if key == BIAS and value is not None else value


def excess_cut(record: Record) -> float:
    """Share of the held-out lack of fit above 1 (the noise floor) that was taken away; NaN where there is none."""
    before, after = (record["diagnosis"][when].get("lack_of_fit") for when in ("before", "after"))
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
            cut = _median([share for share in map(excess_cut, here) if not np.isnan(share)])
            listed = ", ".join(f"{what} {count}" for what, count in counts.most_common(4)) if name != "all" else ""
            print(f"{name:18s}{size:4g}{verdicts:>8s}  cut {cut:5.2f}, half or more {half:>6s}  {listed}")


def before_and_after(records: list[Record]) -> None:
    """Held-out figures before and after, where the true effect was named first; medians."""
    keys = ("lack_of_fit", BIAS, "R_rms_mm", "theta_rms_deg", "P_rms_N_per_m", "coverage_90")
    print("held out, before -> after: medians; named first, size 1 and above (R, θ_c, P, coverage: size 2)")
    print(f"{'':26s}" + "".join(f"{f'|{key}|' if key == BIAS else key:>20s}" for key in keys))
    right, plain = named_first(records), of_kind(records, "none")
    for name in [*dict.fromkeys(record["names"][0] for record in right), "all", "none"]:
        here = plain if name == "none" else [record for record in right if name in ("all", record["names"][0])]
        cells = []
        for key in keys:
            pair = [_median([held_out(record, when, key) for record in here]) for when in ("before", "after")]
            cells.append(f"{pair[0]:.3g} -> {pair[1]:.3g}")
        print(f"{name:26s}" + "".join(f"{cell:>20s}" for cell in cells))
    print("lack of fit after at most 1.1:", rate(right, fits))


def _median(values: list[float | None]) -> float:
    known = [value for value in values if value is not None]
    return float(np.median(known)) if known else float("nan")


def cost(records: list[Record]) -> None:
    """Time of a diagnosis that came to its end."""
    whole = [record for record in records if "seconds" in record]
    if not whole:
        return
    seconds = [record["seconds"] for record in whole]
    quantiles = ", ".join(f"{value:.1f}" for value in np.quantile(seconds, [0.0, 0.5, 0.9, 1.0]))
    cpu = np.median([record["cpu_seconds"] for record in whole])
    print(f"seconds a diagnosis (least, median, 90 %, most): {quantiles}; of the processor, median {cpu:.1f}")
