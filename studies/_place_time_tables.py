"""Tables of `places_and_times`: what was named, errors before and after, and every finger."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from _page import markdown_table

Record = dict[str, Any]
KINDS, ORDERS, RUBBERS = ("place", "time", "none"), ("scan", "random"), ("soft", "stiff")
WHAT = ("drift", "place", "not distinguishable", "nothing", "other")
# R is read as well as on the same finger without the error if its rms is below this multiple.
AS_WELL = 1.1
# A reading is worse if its error grew by more than so many standard errors.
WORSE = 2.0


def rms(record: Record, when: str) -> float | None:
    """Root mean square of the error of R of held-out touches (mm), against references as stated; None if not read."""
    value = record.get(when, {}).get("R_rms_mm")
    return None if value is None else float(value)


def change(record: Record) -> tuple[float, float] | None:
    """Change of the rms of R and its standard error; None if touches were not read."""
    before, after = (rms(record, when) for when in ("before", "after_against_stated"))
    if before is None or after is None:
        return None
    return after - before, float(record["change_against_stated_se"].get("R_rms_mm") or 0.0)


def is_worse(record: Record) -> bool:
    """Whether R is read worse after than before, beyond `WORSE` standard errors."""
    found = change(record)
    return found is not None and found[0] > max(WORSE * found[1], 1e-9)


def ratio(record: Record, results: Sequence[Record]) -> float | None:
    """Rms of R after, over that of the same touches without the error, by the calibration without effects."""
    if record["kind"] == "none":
        return None
    same = ("rubber", "order", "seed")
    plain = [each for each in results if each["kind"] == "none" and all(each[key] == record[key] for key in same)]
    after, before = rms(record, "after_against_stated"), rms(plain[0], "before") if plain else None
    return None if after is None or before is None else after / before


def by_condition(results: Sequence[Record]) -> str:
    """Of each kind of error, rubber and order: what was named, and errors."""
    rows = []
    for kind in KINDS:
        for order in ORDERS:
            for rubber in RUBBERS:
                some = [
                    each for each in results if (each["kind"], each["order"], each["rubber"]) == (kind, order, rubber)
                ]
                done = [each for each in some if "said" in each]
                if done:
                    counts = [str(sum(each["said"] == what for each in done)) for what in WHAT]
                    head = f"{kind}, {rubber} rubber, {order}"
                    rows.append([head, str(len(done)), *counts, *_errors(done, results)])
    head = ("error, finger, order", "fingers", *WHAT, "rms of R, mm (median)", "R worse", "beyond two standard errors")
    return markdown_table((*head, f"R within {AS_WELL:g} of no error", "lack of fit (median)"), rows)


def _errors(some: Sequence[Record], results: Sequence[Record]) -> list[str]:
    changes = [found for found in map(change, some) if found is not None]
    if not changes:
        return [""] * 5
    r, fit = (
        [np.median([each[when][key] for each in some]) for when in ("before", "after_against_stated")]
        for key in ("R_rms_mm", "lack_of_fit")
    )
    ratios = [each for each in (ratio(one, results) for one in some) if each is not None]
    within = f"{sum(each <= AS_WELL for each in ratios)} of {len(ratios)}" if ratios else ""
    grown = str(sum(found[0] > 1e-9 for found in changes))
    worse = str(sum(map(is_worse, some)))
    return [f"{r[0]:.2f} → {r[1]:.2f}", grown, worse, within, f"{fit[0]:.1f} → {fit[1]:.2f}"]


def every_finger(results: Sequence[Record]) -> str:
    """Each finger whose touches were read."""
    rows = []
    for each in sorted(results, key=lambda one: (one["kind"], one["rubber"], one["order"], one["seed"])):
        found = change(each)
        if found is not None:
            of_plain = ratio(each, results)
            said = each["said"] + ("" if not each["effects"] else f" ({', '.join(each['effects'])})")
            errors = f"{rms(each, 'before'):.3f} → {rms(each, 'after_against_stated'):.3f}"
            share = "" if of_plain is None else f"{of_plain:.2f}"
            name = f"{each['kind']} {each['percent']:g} %, {each['rubber']}, {each['order']}, {each['seed']}"
            rows.append([name, said, errors, f"{found[0]:+.3f} ± {found[1]:.3f}", share])
    head = ("error, rubber, order, seed", "named", "rms of R, mm", "change", "after over no error")
    return markdown_table(head, rows)


def tables(results: Sequence[Record]) -> str:
    """All tables."""
    failed = [each for each in results if "error" in each]
    text = f"{by_condition(results)}\nDiagnoses that failed: {len(failed)}.\n"
    text += "".join(f"- {each['key']}: {each['error']}\n" for each in failed)
    return f"{text}\nEvery finger whose touches were read:\n\n{every_finger(results)}"
