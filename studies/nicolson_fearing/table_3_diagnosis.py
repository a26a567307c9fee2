"""Table 3 as a diagnosis: a finger with a rigid core, calibrated as if it had none, and the core found in what is left.

Tips are pressed by the exact contact on the bonded layer. The chain that is calibrated has Hertz contacts, on rubber
without end. `bayestouch.diagnose` is told nothing else. The paper calibrated with edges alone, which say nothing of the
contact; here tips of every radius are among the touches that are fitted, so that the modulus takes up a part of the
core before anything is traced, and the bias before is smaller than the printed one.

    python studies/nicolson_fearing/table_3_diagnosis.py [FOLDER] [--small] [--no-pictures] [--page PAGE]
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import _path  # noqa: F401
import numpy as np
from _page import write_between
from _published import OUTPUT, figure, plain_ticks, save

import bayestouch
from bayestouch.diagnosis.traced import EvaluatedModel
from bayestouch.paper.published import TABLE_3
from nicolson_fearing.paper_design import paper_design

MARK = "<!-- made by studies/nicolson_fearing/table_3_diagnosis.py -->"
#: Errors of the page: key, name, format, factor.
SHOWN = (
    ("prediction_error_percent_peak", "prediction error, % of peak", ".2f", 1),
    ("lack_of_fit", "lack of fit (1: none)", ".2f", 1),
    ("R_bias_mm", "bias of R, mm", "+.2f", 1),
    ("R_rms_mm", "rms error of R, mm", ".2f", 1),
    ("coverage_90", "90 % intervals that hold R, %", ".0f", 100),
)


@dataclass(frozen=True)
class Found:
    """What the study gives; k tips.

    Attributes
    ----------
    diagnosis : Diagnosis
        Of the simulated finger.
    tip_mm : (k,) array
        Radii of the tips.
    before_mm, after_mm : (k,) arrays
        r_c of the mean estimate of R over the held-out touches of each tip.
    """

    diagnosis: bayestouch.Diagnosis
    tip_mm: np.ndarray
    before_mm: np.ndarray
    after_mm: np.ndarray


def mean_radii(stand: EvaluatedModel, tip_mm: np.ndarray, outer_mm: float) -> np.ndarray:
    """r_c of the mean R of each tip's held-out touches, mm."""
    held, read = stand.held_out, stand.read
    assert held is not None
    assert read is not None
    known = held.observed.means.indenter_radius_mm
    R = np.array([read.R_mm[np.isclose(known, tip)].mean() for tip in tip_mm])
    return 1 / (1 / R - 1 / outer_mm)


def run(small: bool, seed: int = 0) -> Found:
    """Simulate, diagnose, and compare."""
    fewer = {"n_elements": 8, "touch_step_deg": 5.0, "edge_step_deg": 3.0, "flat_step_deg": 9.0, "samples_per_touch": 5}
    design = paper_design(touch_step_deg=2.0) if not small else paper_design(calibration_span_deg=45.0, **fewer)
    dataset = bayestouch.simulate(design, seed=seed).dataset
    diagnosis = bayestouch.diagnose(dataset, contact="hertz", seed=seed)
    tips = np.array([row.r_c for row in TABLE_3])
    before, after = (
        mean_radii(s, tips, design.outer_radius_mm) for s in (diagnosis.traced.before, diagnosis.traced.after)
    )
    return Found(diagnosis, tips, before, after)


def print_found(found: Found) -> None:
    """The diagnosis in words, and the radii beside the printed ones."""
    print(found.diagnosis)
    numbers = found.diagnosis.to_dict()
    for name in ("before", "after"):
        print(f"  {name}: bias of R {numbers[name]['R_bias_mm']:+.2f} mm, rms {numbers[name]['R_rms_mm']:.2f} mm")
    print(f"{'':8s}{'printed':>24s}{'diagnosed':>22s}")
    print(f"{'r_c mm':>8s}{'Hertz':>12s}{'frictionless':>14s}{'before':>10s}{'after':>10s}")
    for row, before, after in zip(TABLE_3, found.before_mm, found.after_mm, strict=True):
        print(f"{row.r_c:8.2f}{row.hertz_model:12.2f}{row.frictionless_model:14.2f}{before:10.2f}{after:10.2f}")


def as_tables(found: Found) -> str:
    """Markdown: errors before and after, and the radii beside the printed ones."""
    numbers = found.diagnosis.to_dict()
    effects = [
        f"`{effect['name']}` ("
        + ", ".join(f"{name} {each['mean']:.2f} ± {each['sd']:.2g}" for name, each in effect["parameters"].items())
        + ")"
        for effect in numbers["effects"]
    ]
    said = (
        f"Verdict: {numbers['verdict']}. Named: {', '.join(effects)}. Errors on {numbers['data']['held_out_touches']} "
        "held-out touches:"
    )
    lines = [said, "", "| error | calibrated by Hertz | with what was found |", "|---|---|---|"]
    for key, name, form, factor in SHOWN:
        before, after = (format(factor * numbers[stand][key], form) for stand in ("before", "after"))
        lines.append(f"| {name} | {before} | {after} |")
    head = (
        "r_c, mm",
        "printed: Hertz",
        "printed: frictionless on the core",
        "calibrated by Hertz",
        "with what was found",
    )
    lines += ["", f"| {' | '.join(head)} |", "|---|---|---|---|---|"]
    for row, before, after in zip(TABLE_3, found.before_mm, found.after_mm, strict=True):
        cells = (row.r_c, row.hertz_model, row.frictionless_model, before, after)
        lines.append("| " + " | ".join(f"{cell:.2f}" for cell in cells) + " |")
    return "\n".join(lines)


def draw(found: Found, folder: Path) -> None:
    """Save estimates over radius, before and after, and as printed."""
    picture, axis = figure(figsize=(6.4, 4.4))
    axis.plot(found.tip_mm, [row.hertz_model for row in TABLE_3], "s", mfc="none", color="C1", label="paper, Hertz")
    paper = [row.frictionless_model for row in TABLE_3]
    axis.plot(found.tip_mm, paper, "s", mfc="none", color="C0", label="paper, frictionless on the core")
    axis.plot(found.tip_mm, found.before_mm, "o-", color="C1", label="calibrated by Hertz")
    axis.plot(found.tip_mm, found.after_mm, "o-", color="C0", label="with what was found: rigid core")
    axis.plot(found.tip_mm, found.tip_mm, color="0.6", lw=1, label="the tip's own")
    axis.set(
        xlabel="radius of the tip $r_c$ (mm)", ylabel="$r_c$ of the mean estimate (mm)", xscale="log", yscale="log"
    )
    for side in (axis.xaxis, axis.yaxis):
        plain_ticks(side, (0.5, 1, 2, 5, 10, 20))
    axis.legend()
    save(picture, folder, "table_3_diagnosis")


def main(small: bool = False, folder: Path | None = None, page: Path | None = None) -> Found:
    """Run, print, draw, and write the tables into a page where one is given."""
    found = run(small)
    print_found(found)
    if folder is not None:
        draw(found, folder)
    if page is not None:
        write_between(MARK, as_tables(found), page)
    return found


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", nargs="?", type=Path, default=OUTPUT, help="where pictures go")
    parser.add_argument("--small", action="store_true", help="seconds in place of minutes")
    parser.add_argument("--no-pictures", action="store_true")
    parser.add_argument("--page", type=Path, help="Markdown page whose tables are to be made anew")
    chosen = parser.parse_args()
    main(chosen.small, None if chosen.no_pictures else chosen.folder, chosen.page)
