"""Diagnosis of three pads that other laboratories measured: what the linear model misses, traced, added, what remains.

Nobody wrote down which effects are in these data. Every error is on touches that no fit has seen: every
fourth block of touches that follow each other. The linear model is a kernel with an empirical map: any sensitivity that
depends on where the touch is, in proportion to the load.

    python studies/measured_diagnosis.py [FOLDER] [--small] [--only NAME] [--page PAGE]
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from operator import attrgetter
from pathlib import Path

import numpy as np
from _in_turn import IN_TURN, MOST, in_turn, in_turn_table
from _loop_picture import file_name, save_loop
from _page import write_between
from _paired import PAIRED, paired_table
from _published import OUTPUT, figure, save
from _worth import WORTH, worth_table, worths

import bayestouch
from bayestouch.data.dataset import DataSet
from bayestouch.diagnosis.where import where_it_is
from bayestouch.model.held_out import HeldOut
from bayestouch.model.quantities import Quantity
from bayestouch.pad.held_out import held_out
from bayestouch.pad.start import pad_fit

SHARED = Path(os.environ.get("BAYESTOUCH_SHARED", Path(__file__).resolve().parents[2] / "shared"))
MARK = "<!-- made by studies/measured_diagnosis.py -->"
#: What a small run takes: of these cases, runs of so many touches, one in so many.
RUN, SMALL = 6, {"baro-line": 1, "fluid-oil-1.5": 4}
#: Readings of a bin of the picture, at least.
FEWEST = 5
#: The last step, which has no cause.
CORRECTION = "correction"
#: Prediction error of every sample, and of the mean readings of touches, percent of the peak.
of_samples: Callable[[HeldOut], float] = attrgetter("error_percent_peak")
of_touches: Callable[[HeldOut], float] = attrgetter("touch_error_percent_peak")


def one_rest_reading(dataset: DataSet) -> DataSet:
    """The same with no-contact rows as touches of their own, so that their mean is the rest reading of all touches."""
    touches = dataset.touches
    apart = np.where(touches.in_contact, touches.touch, touches.touch + touches.touch.max() + 1)
    return replace(dataset, touches=touches.with_(touch=apart))


@dataclass(frozen=True)
class Case:
    """A data set, and how it is taken."""

    name: str
    folder: str
    change: Callable[[DataSet], DataSet] = lambda dataset: dataset


CASES = (
    Case("baro-line", "baro-line"),
    Case("baro-line, one rest reading", "baro-line", one_rest_reading),
    Case("fluid-oil-1.5", "fluid-oil-1.5"),
    Case("array8-soft", "array8-soft"),
)


@dataclass(frozen=True)
class Found:
    """A diagnosis with the held-out touches as the kernel without a map predicts them."""

    case: Case
    dataset: DataSet
    diagnosis: bayestouch.Diagnosis
    kernel_alone: HeldOut


def diagnosed(case: Case, small: bool, scheduler: str | None = None) -> Found:
    """Diagnose one data set as `bayestouch diagnose` does; a small run, with one kernel and without reading touches."""
    dataset = bayestouch.load_dataset(SHARED / "measured" / case.folder)
    if small:
        place = np.unique(dataset.touches.touch, return_inverse=True)[1]
        dataset = replace(dataset, touches=dataset.touches.select((place // RUN) % SMALL[case.folder] == 0))
    dataset = case.change(dataset)
    options = {"kernel": "gaussian", "sample": False} if small else {}
    diagnosis = bayestouch.diagnose(dataset, scheduler=scheduler, **options)
    data, before = diagnosis.traced.data, diagnosis.traced.before
    observed, table = data.observations(data.training), data.table.select(data.training)
    name = str(before.calibration.settings["kernel"])
    alone, _ = pad_fit(observed, table, data.dataset, kernel=name, empirical=False)
    assert before.held_out is not None
    return Found(case, dataset, diagnosis, held_out(alone, None, before.held_out.observed, before.fitted.model.peak))


def rest_wander(dataset: DataSet) -> float:
    """Largest range of an element's rest readings from touch to touch, percent of its peak; NaN without such rows."""
    touches = dataset.touches
    if touches.in_contact.all():
        return float("nan")
    rest, pressed = touches.readings[~touches.in_contact], touches.readings[touches.in_contact]
    return float(100 * np.max(np.ptp(rest, axis=0) / (pressed.max(axis=0) - np.median(rest, axis=0))))


def fall_while_held(dataset: DataSet) -> list[str]:
    """Fall of readings between first and last sample of a touch, percent of the first: mean ± sd of each element."""
    table = dataset.touches.baseline_corrected()
    pressed = table.select(table.in_contact)
    first = np.unique(pressed.touch, return_index=True)[1]
    last = np.r_[first[1:], pressed.n_rows] - 1
    one, two = pressed.readings[first], pressed.readings[last]
    large = one > 0.3 * one.max(axis=0)
    falls = [100 * (1 - b[some] / a[some]) for a, b, some in zip(one.T, two.T, large.T, strict=True)]
    return [f"{fall.mean():.1f} ± {fall.std(ddof=1):.1f}" for fall in falls] if (last > first).any() else []


def of_all_means(held: HeldOut) -> float:
    """Error of touch means, rms over the readings of all elements together: those that are read worst weigh most."""
    return 100 * float(np.sqrt(np.nanmean(held.residual**2)))


def steps_percent(found: Found, error: Callable[[HeldOut], float] = of_samples) -> list[tuple[str, float]]:
    """Held-out prediction error of the kernel, with a map, with each effect that was added, and with the correction."""
    traced = found.diagnosis.traced
    names = ["linear", *(each.added.effect.name for each in traced.rounds if each.added is not None)]
    held = [("kernel alone", found.kernel_alone), *zip(names, traced.steps, strict=False)]
    if traced.corrected is not None and traced.corrected.held_out is not None:
        held.append((CORRECTION, traced.corrected.held_out))
    return [(name, error(each)) for name, each in held]


def found_row(found: Found) -> list[str]:
    """What was found in one data set, and what touches are read to with it."""
    numbers = found.diagnosis.to_dict()
    traced = [
        each["name"] + (f" (or {', '.join(each['indistinguishable_from'])})" if each["indistinguishable_from"] else "")
        for each in numbers["effects"]
    ]
    left = found.diagnosis.traced.remaining

    def pair(key: str) -> str:
        before, after = (numbers[stand].get(key) for stand in ("before", "after"))
        return "–" if before is None else f"{before:.2f} → {after:.2f}"

    return [
        found.case.name,
        f"{numbers['data']['held_out_touches']} of {numbers['data']['touches']}",
        "; ".join(traced) or "nothing",
        f"{left.before.ratio:.2f} → {left.after.ratio:.2f} (up to {left.after.high:.2f})",
        numbers["verdict"],
        "yes" if numbers["correction"] is not None else "no",
        pair("location_rms_mm"),
        pair("P_rms_N"),
        pair("coverage_90"),
    ]


def error_rows(found: Found) -> list[list[str]]:
    """Prediction errors of one data set on held-out touches: of samples and of touch means."""
    held = found.kernel_alone
    kinds = (("samples", of_samples), ("touch means", of_touches), ("touch means, elements pooled", of_all_means))
    if held.samples is None or len(held.samples) == len(held.residual):
        kinds = (("samples = touch means (one sample a touch)", of_touches),)
    rows = []
    for kind, error in kinds:
        steps = steps_percent(found, error)
        explained = [value for name, value in steps if name != CORRECTION][-1]
        corrected = [f"{value:.2f}" for name, value in steps if name == CORRECTION]
        shown = [f"{value:.2f}" for value in (steps[0][1], steps[1][1], explained)]
        rows.append([found.case.name, kind, *shown, *(corrected or ["–"])])
    return rows


FOUND = (
    *("data", "held out", "traced to"),
    "mean square of residuals over that of noise, before → after (limit)",
    *("verdict", "correction", "location rms, mm", "load rms, N", "90 % regions hold"),
)
ERRORS = ("data", "error of", "kernel alone", "kernel and map", "with what was found", "and a correction")


def as_tables(all_found: list[Found]) -> str:
    """Markdown: what was found, and prediction errors."""
    errors = [row for each in all_found for row in error_rows(each)]
    found = _table(FOUND, [found_row(each) for each in all_found])
    return f"{found}\n\nPrediction error on held-out touches, % of each element's peak:\n\n{_table(ERRORS, errors)}"


def _table(head: tuple[str, ...], rows: list[list[str]]) -> str:
    return "\n".join("| " + " | ".join(cells) + " |" for cells in (head, ["---"] * len(head), *rows))


def print_found(found: Found) -> None:
    """What was missed, traced to, before and after, and what remains."""
    diagnosis = found.diagnosis
    traced, numbers = diagnosis.traced, diagnosis.to_dict()
    print(f"\n{found.case.name}: {traced.before.calibration.settings['kernel']} kernel")
    for kind, error in (("samples", of_samples), ("touch means", of_touches)):
        steps = ", ".join(f"{name} {value:.2f}" for name, value in steps_percent(found, error))
        print(f"  error of {kind}, % of peak: {steps}")
    dataset = bayestouch.load_dataset(SHARED / "measured" / found.case.folder)
    if falls := fall_while_held(dataset):
        print(f"  readings above 30 % of the peak fall while they are held by {', '.join(falls)} %")
    wander = rest_wander(dataset)
    if np.isfinite(wander):
        print(f"  rest readings of one element wander by up to {wander:.1f} % of its peak from touch to touch")
    print(f"  missed by the linear model: {where_it_is(traced.before.held_out)}")
    for line in str(diagnosis).splitlines():
        print(f"  {line}")
    print(f"  remains: {where_it_is(traced.after.held_out)}")
    for each in numbers["rounds"]:
        tried = [c for c in each["candidates"] if c["elpd_gain"] is not None][:4]
        print(
            f"  round: added {each['added']}; correction {each['correction_elpd_gain']:.0f}; "
            + ", ".join(f"{c['name']} {c['elpd_gain']:.0f} ± {c['elpd_gain_se']:.0f}" for c in tried)
        )


def rms_along(quantity: Quantity, held: HeldOut, bins: int = 12) -> tuple[np.ndarray, np.ndarray]:
    """Middle and rms residual (percent of peak) of bins along a quantity, as wide as it takes for enough readings."""
    values, residual = np.broadcast_arrays(quantity.values, 100 * held.residual)
    some = np.isfinite(values) & np.isfinite(residual)
    order = np.argsort(values[some], kind="stable")
    value, square = values[some][order], residual[some][order] ** 2
    starts = [0]
    for k in range(1, len(value) - FEWEST + 1):
        if k - starts[-1] >= FEWEST and value[k] - value[starts[-1]] > np.ptp(value) / bins:
            starts.append(k)
    count = np.diff([*starts, len(value)])
    return np.add.reduceat(value, starts) / count, np.sqrt(np.add.reduceat(square, starts) / count)


def draw(all_found: list[Found], folder: Path) -> None:
    """Save one picture: rms residual of held-out touches along three quantities, before and after."""
    picture, axes = figure(3, len(all_found), squeeze=False, figsize=(12.5, 3.0 * len(all_found)))
    for line, found in zip(axes, all_found, strict=True):
        before, after = found.diagnosis.traced.before.held_out, found.diagnosis.traced.after.held_out
        assert before is not None
        assert after is not None
        names = [each.name for each in before.quantities]
        wanted = ("load", "time", "predicted signal", "reading of the touch before", "x")
        for axis, name in zip(line, [each for each in wanted if each in names], strict=False):
            for held, colour, label in ((before, "C1", "linear"), (after, "C0", "with what was found")):
                quantity = next(each for each in held.quantities if each.name == name)
                axis.plot(*rms_along(quantity, held), "o-", color=colour, label=label)
            axis.set(xlabel=f"{name} ({quantity.unit})", ylabel="rms residual (% of peak)", ylim=(0, None))
        line[0].set_title(found.case.name, loc="left")
    picture.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    save(picture, folder, "measured_diagnosis")


def main(
    small: bool = False,
    folder: Path | None = None,
    only: str | None = None,
    page: Path | None = None,
    scheduler: str | None = None,
) -> list[Found]:
    """Run, print, draw, and write the table into a page where one is given."""
    if not (SHARED / "measured").is_dir():
        print("no measured data: set $BAYESTOUCH_SHARED, or put the folder `shared` beside the checkout")
        return []
    cases = [case for case in CASES if only in (None, case.name) and (not small or case.name in SMALL)]
    found = []
    for case in cases:
        one = diagnosed(case, small, scheduler)
        found.append(one)
        print_found(one)
        if folder is not None and not small:
            one.diagnosis.save(folder / file_name(case.name))
    tables = as_tables(found)
    print("\n" + tables)
    if folder is not None:
        draw(found, folder)
    if small:
        return found
    worth = {each.case.name: worths(each.dataset, each.diagnosis.traced) for each in found}
    print("\n" + worth_table(worth))
    print("\n" + paired_table(worth))
    turned = {each.case.name: in_turn(each.dataset) for each in found if each.dataset.touches.n_touches <= MOST}
    if turned:
        print("\n" + in_turn_table(turned))
    if folder is not None:
        for each in found:
            save_loop(each.case.name, each.diagnosis.traced, steps_percent(each), worth[each.case.name], folder)
    if page is not None:
        write_between(MARK, tables, page)
        write_between(WORTH, worth_table(worth), page)
        write_between(PAIRED, paired_table(worth), page)
        write_between(IN_TURN, in_turn_table(turned), page)
    return found


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", nargs="?", type=Path, default=OUTPUT, help="where pictures and diagnoses go")
    parser.add_argument("--small", action="store_true", help="seconds in place of minutes")
    parser.add_argument("--only", choices=[case.name for case in CASES])
    parser.add_argument("--page", type=Path, help="Markdown page whose table is to be made anew")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="Dask cluster that does the work")
    chosen = parser.parse_args()
    if chosen.only and chosen.page:
        parser.error("--page needs all data sets; leave --only out")
    main(chosen.small, chosen.folder, chosen.only, chosen.page, chosen.scheduler)
