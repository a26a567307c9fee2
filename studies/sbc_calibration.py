"""Simulation-based calibration of the calibration posterior, at length: every parameter of a finger of four elements.

All parameters are drawn from their priors, calibration touches simulated and calibrated with, and the truth ranked:
six parameters of each element, σ, μ, the force sensor's noise, two true loads and the log density. 340 calibrations are
enough for the pooled statistic to notice posteriors 5 % too narrow nine times in ten. The statistics and
their thresholds are those of `bayestouch.RankStatistics`; what they notice is the table of `sbc_power.py`.

    python studies/sbc_calibration.py [FOLDER] [--small] [--no-pictures] [--scheduler ADDRESS]
    python studies/sbc_calibration.py --docs             writes the table of docs/statistics.md
    python studies/sbc_calibration.py --cases [--docs]   the same with effects, and of pads (100 calibrations each)

Cases are small sensors, so that a calibration takes a second or two. Effects have the values of their priors, which the
calibration uses too; no default prior was made narrower.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from _page import STATISTICS, docs_of, markdown_table, put_into_page
from _published import options, save
from _shared_out import scheduler_of
from sbc_power import pooled as pooled_check
from sbc_power import power

import bayestouch
from bayestouch.simulation import FingerDesign, PadDesign
from bayestouch.simulation_based_calibration.ranks import RankStatistics

DESIGN = FingerDesign(
    n_elements=4,
    samples_per_touch=4,
    calibration_span_deg=36.0,
    edge_step_deg=4.0,
    flat_step_deg=8.0,
    touch_radii_mm=(3.9,),
    touch_span_deg=2.0,
)


# Two elements and contacts that are quickly solved
SMALL = replace(DESIGN, n_elements=2, calibration_span_deg=24.0, contact="hertz")


THREE = replace(SMALL, n_elements=3)
LINE = PadDesign(
    element_x_mm=(0.0, 5.0, 10.0), element_y_mm=None, samples_per_touch=4, calibration_step_mm=0.75, n_touches=2
)
# Sensor, and effects of each case.
CASES: dict[str, tuple[FingerDesign | PadDesign, tuple[str, ...]]] = {
    "finger, cross-talk and creep": (THREE, ("crosstalk", "creep")),
    "finger, gain nonlinearity": (THREE, ("gain_nonlinearity",)),
    "finger, baseline drift": (THREE, ("baseline_drift",)),
    "finger, outliers": (THREE, ("outliers",)),
    "finger, shared noise": (THREE, ("common_mode_noise",)),
    "pad": (LINE, ()),
    "pad, creep": (LINE, ("creep",)),
    "pad, creep and baseline drift": (LINE, ("creep", "baseline_drift")),
}


def cases(simulations: int = 100, names: Sequence[str] = tuple(CASES)) -> dict[str, RankStatistics]:
    """Print p-values and coverage of the cases; returns their ranks."""
    found = {}
    for name in names:
        design, effects = CASES[name]
        dataset = bayestouch.simulate(design, seed=1).dataset
        of_body = {"contact": "hertz"} if isinstance(design, FingerDesign) else {"kernel": "gaussian"}
        found[name] = bayestouch.sbc(dataset, simulations=simulations, effects=effects, seed=1, **of_body)
        print(f"{name}: {'uniform' if found[name].passes(0.01) else 'NOT uniform'} at 1 %")
        print(found[name].table(), end="\n\n", flush=True)
    return found


def cases_as_markdown(found: dict[str, RankStatistics]) -> str:
    """Table of docs/statistics.md: the pooled statistic of each case, and its power."""
    rows = []
    for name, result in found.items():
        pooled, count = result.pooled, len(next(iter(result.ranks.values())))
        worst = min(result.p_value, key=lambda each: result.p_value[each])
        check = pooled_check("", count, pooled.scores / count)
        chances = [f"{100 * power(check, narrow):.0f} %" for narrow in (0.05, 0.1)]
        row = [name, str(count), str(len(result.ranks)), f"{result.p_value[worst]:.4f} ({worst})"]
        row += [f"{pooled.mean_square:.3f}", f"{pooled.p_value:.3f}", f"{pooled.scores:.0f}", *chances]
        rows.append([*row, "yes" if result.passes(0.01) else "**no**"])
    head = [
        "case",
        "calibrations",
        "quantities",
        "least p-value",
        "pooled mean square",
        "pooled p",
        "independent scores",
    ]
    head += ["notices 5 % too narrow", "notices 10 % too narrow", "uniform at 1 %"]
    return markdown_table(head, rows)


def main(
    simulations: int = 340, design: FingerDesign = DESIGN, folder: Path | None = None, scheduler: str | None = None
) -> RankStatistics:
    """Print p-values and coverage; returns the ranks."""
    dataset = bayestouch.simulate(design, seed=1).dataset
    result = bayestouch.sbc(dataset, simulations=simulations, contact=design.contact, seed=1, scheduler=scheduler)
    verdict = "uniform" if result.passes(0.01) else "NOT uniform"
    print(f"{simulations} calibrations, {len(result.ranks)} quantities: {verdict} at 1 %")
    print(f"(p-values: {result.threshold(0.01):.2g} at least, pooled {result.pooled_threshold(0.01):.2g})")
    print(result.table())
    if folder is not None:
        save(result.plot(), folder, "sbc_calibration")
    return result


def as_markdown(result: RankStatistics) -> str:
    """Table of docs/statistics.md: least p-value and range of the others by kind of parameter, and pooled."""
    kinds = list(dict.fromkeys(name.split(" e")[0] for name in result.ranks))
    rows = []
    for kind in kinds:
        names = [name for name in result.ranks if name.split(" e")[0] == kind]
        least = min(result.p_value[name] for name in names)
        squares, shares = ([values[name] for name in names] for values in (result.mean_square, result.coverage_90))
        rows.append([kind, str(len(names)), f"{least:.3f}", _range(squares, "{:.2f}"), _range(shares, "{:.3f}")])
    pooled = result.pooled
    rows.append(["all", str(len(result.ranks)), f"{pooled.p_value:.3f} (pooled)", f"{pooled.mean_square:.3f}", ""])
    count = len(next(iter(result.ranks.values())))
    verdict = "uniform" if result.passes(0.01) else "**not uniform**"
    head = ["quantity", "how many", "least p-value", "mean square of scores", "coverage of 90 %"]
    return (
        f"{count} calibrations: {verdict} at 1 %. A p-value of one quantity is to be {result.threshold(0.01):.2g} at "
        f"least, the pooled one {result.pooled_threshold(0.01):.2g}; the scores of all are worth {pooled.scores:.0f} "
        f"independent ones.\n\n{markdown_table(head, rows)}"
    )


def _range(values: list[float], form: str) -> str:
    low, high = form.format(min(values)), form.format(max(values))
    return low if low == high else f"{low} to {high}"


if __name__ == "__main__":
    scheduler, others = scheduler_of(sys.argv[1:])
    docs, others = docs_of(others)
    if "--cases" in others:
        table = cases_as_markdown(cases(names=[each for each in others if each != "--cases"] or tuple(CASES)))
        print(table)
        if docs:
            put_into_page("sbc_calibration.py cases", table, STATISTICS)
        raise SystemExit
    small, pictures = options(__doc__, others)
    found = main(100, SMALL, pictures, scheduler) if small else main(folder=pictures, scheduler=scheduler)
    if docs:
        put_into_page("sbc_calibration.py", as_markdown(found), STATISTICS)
