"""Tables of `blind_study`, counted by the rules that its first lines state."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

import _cause_rules
import numpy as np
from _page import markdown_table
from scipy.stats import binomtest

Record = dict[str, Any]
NOT_RUN = "Not run yet.\n"
DRIFTS = {"baseline_drift", "gain_drift"}
KINDS = ("one", "none", "unlisted", "pair")
#: A reading is worse if its squared errors grew by more than so many standard errors.
WORSE = 2.0
UNITS = {"R": "mm", "theta_c": "degree", "P": "N/m"}


def found(record: Record) -> list[str]:
    """Effects that were added, in order; none if the diagnosis failed."""
    return [each["name"] for each in record.get("effects_found", ())]


def is_named_first(record: Record) -> bool:
    """Whether the effect that is there was added first."""
    return found(record)[:1] == record["truth"]


def is_named_or_indistinguishable(record: Record) -> bool:
    """The same, or declared indistinguishable from an effect that was added."""
    others = {name for each in record.get("effects_found", ()) for name in each["indistinguishable_from"]}
    return is_named_first(record) or record["truth"][0] in others


def is_adequate(record: Record) -> bool:
    """Whether nothing is missing, by the verdict."""
    return record.get("verdict") == "adequate"


def is_left_unnamed(record: Record) -> bool:
    """Whether no effect was blamed, and the verdict is "unattributed" or says "something smooth in place"."""
    return (
        "verdict" in record
        and not found(record)
        and (record["verdict"] == "unattributed" or (record["in_place"] is not None and not is_adequate(record)))
    )


def are_both_named(record: Record) -> bool:
    """Whether both effects were added."""
    return set(record["truth"]) <= set(found(record))


RULES = {
    "one": is_named_first,
    "none": is_adequate,
    "unlisted": is_left_unnamed,
    "pair": are_both_named,
}


def is_counted(record: Record) -> bool:
    """Whether a rate counts it: listed effects have a size of 1 and above."""
    return record["kind"] in {"none", "unlisted"} or min(record["sizes"].values()) >= 1


def rate(records: Sequence[Record], hit: Callable[[Record], bool]) -> str:
    """Hits of all."""
    return f"{sum(map(hit, records))} of {len(records)}" if records else "-"


def interval(records: Sequence[Record], hit: Callable[[Record], bool]) -> str:
    """95 % interval of a rate after Clopper and Pearson, in percent."""
    if not records:
        return "-"
    low, high = binomtest(sum(map(hit, records)), len(records)).proportion_ci(method="exact")
    return f"{100 * low:.0f} to {100 * high:.0f} %"


def of_kind(records: Sequence[Record], kind: str) -> list[Record]:
    """Records of one kind that a rate counts."""
    return [each for each in records if each["kind"] == kind and is_counted(each)]


def with_drift(records: Sequence[Record]) -> list[Record]:
    """Single effects and pairs in which there is a listed drift."""
    return [each for kind in ("one", "pair") for each in of_kind(records, kind) if DRIFTS & {*each["truth"]}]


def is_drift_found(record: Record) -> bool:
    """Whether all drifts that are there were added."""
    return DRIFTS & {*record["truth"]} <= set(found(record))


def headline(records: Sequence[Record]) -> str:
    """Rates beside their aims."""
    one, none, unlisted, pair = (of_kind(records, kind) for kind in KINDS)
    rows = [
        ("one effect, size 1 and above: named first", one, is_named_first, "95 %"),
        ("... or indistinguishable from what was named", one, is_named_or_indistinguishable, ""),
        ("nothing is missing: `adequate`", none, is_adequate, "95 %"),
        ("unlisted: `unattributed`, or something smooth in place", unlisted, is_left_unnamed, "90 %"),
        ("two effects, size 1 and above: both named", pair, are_both_named, "80 %"),
        ("listed drifts, alone or in a pair: found", with_drift(records), is_drift_found, "95 %"),
    ]
    return markdown_table(
        ("what", "how often", "interval", "aim"),
        [(what, rate(some, hit), interval(some, hit), aim) for what, some, hit, aim in rows],
    )


def by_condition(records: Sequence[Record]) -> str:
    """The four rates by rubber and order."""
    rows = []
    for rubber in ("soft", "stiff"):
        for order in ("scan", "random"):
            here = [each for each in records if (each["rubber"], each["order"]) == (rubber, order)]
            rows.append((rubber, order, *(rate(of_kind(here, kind), RULES[kind]) for kind in KINDS)))
    head = ("rubber", "order", "one: named first", "nothing: adequate", "unlisted: left unnamed", "pair: both named")
    return markdown_table(head, rows)


def by_form(records: Sequence[Record]) -> str:
    """Every single effect and unlisted cause, by form and size that was reached: what was named first."""
    some = [each for each in records if each["kind"] in {"one", "unlisted"}]
    rows = []
    for key in sorted({each["effects"][0][0] for each in some}):
        here = sorted((each for each in some if each["effects"][0][0] == key), key=lambda each: _size(each))
        said = [f"{_size(each):g} {each['rubber']}, {each['order']}: {_said(each)}" for each in here]
        hits = rate(here, RULES[here[0]["kind"]])
        rows.append((key.rstrip(": "), hits, "; ".join(said)))
    return markdown_table(("form", "right", "size, rubber, order: what was named first"), rows)


def by_size(records: Sequence[Record]) -> str:
    """Effects by size: named first, and named first or indistinguishable."""
    some = [each for each in records if each["kind"] == "one"]
    bins = (("below 1", 0, 1), ("1 to 1.5", 1, 2), ("2 to 3", 2, 5), ("5", 5, np.inf))
    rows = []
    for name in [*sorted({each["truth"][0] for each in some}), "all"]:
        cells = []
        for _, low, high in bins:
            here = [each for each in some if low <= _size(each) < high and name in {"all", each["truth"][0]}]
            cells.append(" / ".join(rate(here, hit) for hit in (is_named_first, is_named_or_indistinguishable)))
        rows.append((name, *cells))
    return markdown_table(("effect: named first / or indistinguishable", *(f"size {each[0]}" for each in bins)), rows)


def by_pair(records: Sequence[Record]) -> str:
    """Pairs: what was named."""
    rows = [
        (" + ".join(each["truth"]), f"{each['rubber']}, {each['order']}", " + ".join(found(each)) or _said(each))
        for each in sorted(of_kind(records, "pair"), key=lambda each: each["seed"])
    ]
    return markdown_table(("pair", "rubber, order", "named"), rows)


def worse(records: Sequence[Record]) -> list[tuple[str, str, str, str]]:
    """Readings that are worse after than before: cause, condition, quantity with both errors, change."""
    rows = []
    for each in records:
        for name, error in each.get("exam", {}).items():
            if error["change"] > WORSE * error["standard_error"]:
                what = " + ".join(key.rstrip(": ") for key, _ in each["effects"]) or "nothing"
                errors = f"{name}: {error['before']:.3g} → {error['after']:.3g} {UNITS[name]}"
                times = f"{error['change'] / error['standard_error']:.1f}"
                rows.append((what, f"{each['rubber']}, {each['order']}", errors, times))
    return rows


def harm(records: Sequence[Record]) -> str:
    """Readings that became worse, and how many there were to become so; exams that failed."""
    exams = [error for each in records for error in each.get("exam", {}).values()]
    changed = sum(error["change"] != 0 for error in exams)
    rows = worse(records)
    text = f"{len(rows)} of {len(exams)} readings (R, θ_c and P of each finger; {changed} of them changed) are worse.\n"
    failed = [f"- {each['key']}: {each['exam_error']}\n" for each in records if "exam_error" in each]
    text += f"Exams that failed, so that nothing is known of these readings: {len(failed)}.\n" + "".join(failed)
    head = ("cause", "rubber, order", "rms error before → after", "change, standard errors")
    return f"{text}\n{markdown_table(head, rows)}" if rows else text


def of_causes(records: Sequence[Record]) -> str:
    """Reliability of the probabilities of causes."""
    some = with_statement(records)
    return _cause_rules.tables(some) if some else "-\n"


def with_statement(records: Sequence[Record]) -> list[Record]:
    """Records that have probabilities of causes, with what the verdict states beside them."""
    return [
        {**each, "stated": _cause_rules.stated(found(each), each["verdict"])} for each in records if each.get("causes")
    ]


def times(records: Sequence[Record]) -> str:
    """Processor time of a case: the diagnosis, and four readings of the exam."""
    seconds = [each["processor_s"] for each in records if "processor_s" in each]
    if not seconds:
        return ""
    quantiles = [f"{value:.0f}" for value in np.quantile(seconds, (0, 0.5, 0.9, 1))]
    return f"Processor time of a case, s (least, median, 90 %, most): {', '.join(quantiles)}.\n"


def is_diagnosed(record: Record) -> bool:
    """Whether a diagnosis was tried: the cause was in reach, and could be simulated."""
    return not {"out_of_reach", "not_simulated"} & record.keys()


def tables(results: Sequence[Record]) -> str:
    """All tables, with the version of the code. Whole fingers are apart."""
    beyond = [each for each in results if "out_of_reach" in each]
    absent = [each for each in results if "not_simulated" in each]
    failed = [each for each in results if "error" in each]
    done = list(filter(is_diagnosed, results))
    small, whole = ([each for each in done if each["design"] == of] for of in ("small", "whole"))
    versions = ", ".join(sorted({f"`{each['version']}` (commit {each['commit'][:10]})" for each in results}))
    text = [
        f"{len(results)} cases, {len(beyond)} of them out of reach. Version of the code: {versions}.\n",
        f"Cases that could not be simulated, left out: {len(absent)}.\n",
        *(f"- {each['key']}: {each['not_simulated']}\n" for each in absent),
        f"Diagnoses that failed, counted as wrong: {len(failed)}.\n",
        *(f"- {each['key']}: {each['error']}\n" for each in failed),
        headline(small),
        f"### By rubber and order\n\n{by_condition(small)}",
        f"### By effect and size\n\n{by_size(small)}",
        f"### Every form\n\n{by_form(small)}",
        f"### Pairs\n\n{by_pair(small)}",
        f"### Fingers on which nothing is missing\n\n{_alarms(small)}",
        f"### Readings that became worse\n\n{harm(done)}",
        f"### Probabilities of causes\n\n{of_causes(small)}",
        f"### Whole fingers\n\n{headline(whole)}",
        times(done),
    ]
    return "\n".join(text)


def _alarms(records: Sequence[Record]) -> str:
    counts = Counter(_said(each) for each in of_kind(records, "none"))
    return markdown_table(("named", "fingers"), [(what, str(n)) for what, n in counts.most_common()])


def _size(record: Record) -> float:
    return float(min(record["sizes"].values()))


def _said(record: Record) -> str:
    """The effect that was added first, else the verdict."""
    return next(iter(found(record)), record.get("verdict", "failed"))
